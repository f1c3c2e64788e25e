//! Reads values of a parsed file through serde. Submodules read lists and tables, table cells, and names with
//! settings.

use serde::de::Unexpected;

use super::content::{Content, Spanned};
use crate::value::Names;

mod cells;
mod deserializer;
mod entries;
mod variant;

pub use variant::Variant;

/// Reads a value of a parsed file.
///
/// Stricter than the reader that comes with the parser: a list for `[T; N]` has N entries, neither fewer nor more, and
/// only a table is accepted for a struct. Errors carry the path to the offending value.
///
/// Example: the [module](crate::document).
#[derive(Clone, Copy)]
pub struct Reader<'a> {
    value: &'a Spanned<Content<'a>>,
    /// Keys of the table that are read separately.
    apart: [&'static [&'static str]; 3],
    /// The only keys of the table to be read; `None` to read all.
    only: Option<&'static [&'static str]>,
    /// A key of the table that is read under another name.
    renamed: Option<(&'static str, &'static str)>,
    /// Whether strings are table cells, which may represent numbers and lists.
    of_cells: bool,
    /// The names that values may use; `None` if they may not use any.
    names: Option<&'a Names>,
}

impl<'a> Reader<'a> {
    /// Bytes of the value.
    fn span(&self) -> std::ops::Range<usize> {
        self.value.span()
    }

    /// A reader of a whole value.
    #[must_use]
    pub fn new(value: &'a Spanned<Content<'a>>) -> Self {
        Self { value, apart: [&[]; 3], only: None, renamed: None, of_cells: false, names: None }
    }

    /// The same reader, with strings treated as table cells, which may represent numbers and lists.
    #[must_use]
    pub fn of_cells(self) -> Self {
        Self { of_cells: true, ..self }
    }

    /// The same reader, but its values may use names.
    #[must_use]
    pub fn naming(self, names: &'a Names) -> Self {
        Self { names: Some(names), ..self }
    }

    /// A reader for a value nested in this one, with the same settings.
    fn inside(&self, value: &'a Spanned<Content<'a>>) -> Self {
        Self { of_cells: self.of_cells, names: self.names, ..Reader::new(value) }
    }

    /// Skips keys of the table that are read separately; may be called up to three times. Errors about unknown keys list
    /// the skipped ones among the valid ones, except for `kind`.
    #[must_use]
    pub fn beside(self, keys: &'static [&'static str]) -> Self {
        Self { apart: [self.apart[1], self.apart[2], keys], ..self }
    }

    /// Reads only some keys of the table.
    #[must_use]
    pub fn only(self, keys: &'static [&'static str]) -> Self {
        Self { only: Some(keys), ..self }
    }

    /// Reads a key of the table under another name.
    #[must_use]
    pub fn renamed(self, key: &'static str, as_key: &'static str) -> Self {
        Self { renamed: Some((key, as_key)), ..self }
    }

    /// Whether it is a table with a key.
    #[must_use]
    pub fn has(&self, key: &str) -> bool {
        matches!(self.value.get_ref(), Content::Table(table) if table.contains_key(key))
    }

    fn unexpected(&self) -> Unexpected<'a> {
        match self.value.get_ref() {
            Content::Text(text) => Unexpected::Str(text),
            Content::Whole { digits, .. } => Unexpected::Other(digits),
            Content::Decimal(number) => Unexpected::Other(number),
            Content::Boolean(value) => Unexpected::Bool(*value),
            Content::Date => Unexpected::Other("a date or a time"),
            Content::List(_) => Unexpected::Seq,
            Content::Table(_) => Unexpected::Map,
        }
    }
}
