//! Why a value of a parsed file could not be read, in plain words.

use std::borrow::Cow;
use std::ops::Range;

use serde::de::{self, Unexpected};
use supple_text::{nearest, quoted};

/// Why a value could not be read, and where in it.
///
/// Example: the [module](crate::document).
#[derive(Debug)]
pub struct ReadError {
    /// The path from the value being read to the offending one.
    pub path: String,
    /// Byte range of the offending text; `None` if it is the range of the value being read.
    pub span: Option<Range<usize>>,
    /// What was found, and what is valid.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

impl ReadError {
    /// The same error as seen from the enclosing table or list, whose entry `place` has the byte range `span`.
    pub(super) fn within(mut self, place: &str, span: Range<usize>) -> Self {
        self.path = join(place, &self.path);
        self.span.get_or_insert(span);
        self
    }
}

/// Joins two paths.
pub(super) fn join(path: &str, rest: &str) -> String {
    let separator = if path.is_empty() || rest.is_empty() || rest.starts_with('[') { "" } else { "." };
    format!("{path}{separator}{rest}")
}

impl std::fmt::Display for ReadError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for ReadError {}

impl de::Error for ReadError {
    fn custom<T: std::fmt::Display>(message: T) -> Self {
        Self { path: String::new(), span: None, message: message.to_string(), help: None }
    }
    fn invalid_type(found: Unexpected, valid: &dyn de::Expected) -> Self {
        Self::custom(format_args!("must be {}; found {}", plain(&valid.to_string()), name_of(found)))
    }
    fn invalid_value(found: Unexpected, valid: &dyn de::Expected) -> Self {
        match found {
            // The type determines what kind of number is valid, but not its minimum.
            Unexpected::Signed(number) if number < 0 && is_unsigned(&valid.to_string()) => {
                Self::custom(format_args!("must not be negative; found {number}"))
            }
            _ => Self::invalid_type(found, valid),
        }
    }
    fn invalid_length(found: usize, valid: &dyn de::Expected) -> Self {
        Self::custom(format_args!("must be {}; found {found}", plain(&valid.to_string())))
    }
    fn unknown_field(found: &str, valid: &'static [&'static str]) -> Self {
        let error = Self::custom(format_args!("unknown key `{found}`; valid: {}", quoted(valid)));
        Self { help: instead_of(found, valid), ..error }
    }
    fn unknown_variant(found: &str, valid: &'static [&'static str]) -> Self {
        let error = Self::custom(format_args!("must be one of {}; found `{found}`", quoted(valid)));
        Self { help: nearest(found, valid), ..error }
    }
    fn missing_field(key: &'static str) -> Self {
        Self { path: key.to_owned(), ..Self::custom("is missing") }
    }
}

/// What to write instead of an unknown key: the replacement of a key of earlier versions, or the most similar key.
pub(super) fn instead_of(found: &str, valid: &[&str]) -> Option<String> {
    if found == "damping" && valid.contains(&"dissipation") {
        let what = "the force of a contact is multiplied by 1 + dissipation x speed of approach";
        return Some(format!("`dissipation`, s/m, takes its place: {what}"));
    }
    nearest(found, valid)
}

/// Whether serde expects a whole number without a sign.
fn is_unsigned(valid: &str) -> bool {
    ["u8", "u16", "u32", "u64", "usize"].contains(&valid)
}

/// What serde expects, in plain words.
fn plain(valid: &str) -> Cow<'_, str> {
    match valid {
        "f32" | "f64" => "a number".into(),
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number".into(),
        _ if is_unsigned(valid) => "a whole number".into(),
        "a boolean" => "`true` or `false`".into(),
        "a string" => "text in quotes".into(),
        "a sequence" => "a list".into(),
        "a map" => "a table".into(),
        _ if valid.starts_with("struct ") => "a table".into(),
        _ => match valid.strip_prefix("an array of length ") {
            Some(length) => format!("a list of {length}").into(),
            None => valid.into(),
        },
    }
}

/// What was found, in plain words.
pub(super) fn name_of(found: Unexpected) -> String {
    match found {
        Unexpected::Bool(value) => value.to_string(),
        Unexpected::Unsigned(number) => number.to_string(),
        Unexpected::Signed(number) => number.to_string(),
        Unexpected::Float(number) => number.to_string(),
        Unexpected::Str(text) => format!("{text:?}"),
        Unexpected::Seq => "a list".into(),
        Unexpected::Map => "a table".into(),
        other => other.to_string(),
    }
}
