use std::ops::Range;

use serde::de::{DeserializeOwned, IntoDeserializer};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Something wrong in a task file, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    /// The file's name.
    pub file: String,
    /// Line, from 1; 0 where the file could not be read.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// The key, as a path from the top: `tasks[0].noise.initial`.
    pub key: String,
    /// What was found, and what is valid.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// Bytes of the text that are meant.
    pub span: Range<usize>,
    /// The text of the file.
    pub text: String,
}

impl std::fmt::Display for FileError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}", self.file)?;
        if self.line > 0 {
            write!(f, ":{}:{}", self.line, self.column)?;
        }
        if !self.key.is_empty() {
            write!(f, ": {}", self.key)?;
        }
        write!(f, ": {}", self.message)?;
        match &self.help {
            Some(help) => write!(f, " ({help})"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for FileError {}

impl FileError {
    /// A file that cannot be read.
    pub(crate) fn unreadable(file: &str, error: &std::io::Error) -> Self {
        Self {
            file: file.to_owned(),
            line: 0,
            column: 0,
            key: String::new(),
            message: format!("cannot be read: {error}"),
            help: None,
            span: 0..0,
            text: String::new(),
        }
    }

    /// The same error with advice.
    pub(crate) fn with_help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }
}

/// A step on the way to a place in a file.
#[derive(Clone, Copy, Debug)]
pub(super) enum Place<'a> {
    Key(&'a str),
    Index(usize),
}

impl<'a> From<&'a str> for Place<'a> {
    fn from(key: &'a str) -> Self {
        Self::Key(key)
    }
}

impl From<usize> for Place<'_> {
    fn from(index: usize) -> Self {
        Self::Index(index)
    }
}

/// A parsed file that knows where everything is.
pub(super) struct Document<'a> {
    name: &'a str,
    text: &'a str,
    root: Spanned<DeValue<'a>>,
}

impl<'a> Document<'a> {
    pub fn parse(text: &'a str, name: &'a str) -> Result<Self, FileError> {
        let of = |table: DeTable<'a>| Self { name, text, root: Spanned::new(0..text.len(), DeValue::Table(table)) };
        match DeTable::parse(text) {
            Ok(table) => Ok(of(table.into_inner())),
            Err(error) => Err(of(DeTable::new()).serde_error(error)),
        }
    }

    /// The value at a place.
    pub fn get(&self, at: &[Place]) -> Option<&Spanned<DeValue<'a>>> {
        at.iter().try_fold(&self.root, |value, place| match (place, value.get_ref()) {
            (Place::Key(key), DeValue::Table(table)) => table.get(*key),
            (Place::Index(index), DeValue::Array(array)) => array.get(*index),
            _ => None,
        })
    }

    /// Reads the value at a place.
    pub fn read<T: DeserializeOwned>(&self, at: &[Place]) -> Result<T, FileError> {
        let value = self.get(at).cloned().ok_or_else(|| self.error(at, "is missing"))?;
        T::deserialize(value.into_deserializer()).map_err(|error| self.serde_error(error))
    }

    /// The table at a place without its key `kind`, and that kind.
    pub fn table_with_kind(&self, at: &[Place], kinds: &[&str]) -> Result<(String, Spanned<DeValue<'a>>), FileError> {
        let value = self.get(at).ok_or_else(|| self.error(at, "is missing"))?;
        let DeValue::Table(table) = value.get_ref() else {
            let found = value.get_ref().type_str();
            return Err(self.error(at, format!("must be a table with a key `kind`, not {found}")));
        };
        let mut table = table.clone();
        let Some(kind) = table.remove("kind") else {
            let message = format!("needs a key `kind`: one of {}", crate::value::quoted(kinds));
            return Err(self.error(at, message));
        };
        let at_kind: Vec<Place> = at.iter().copied().chain([Place::Key("kind")]).collect();
        let kind = kind
            .get_ref()
            .as_str()
            .ok_or_else(|| self.error(&at_kind, format!("must be one of {}", crate::value::quoted(kinds))))?
            .to_owned();
        Ok((kind, Spanned::new(value.span(), DeValue::Table(table))))
    }

    /// An error about the value at a place, or about the nearest place above it that exists.
    pub fn error(&self, at: &[Place], message: impl Into<String>) -> FileError {
        let existing = (0..=at.len()).rev().find_map(|len| self.get(&at[..len])).unwrap_or(&self.root);
        self.error_in(existing.span(), write_path(at), message)
    }

    /// An error about the key itself at a place.
    pub fn error_at_key(&self, at: &[Place], message: impl Into<String>) -> FileError {
        if let Some((Place::Key(key), table)) = at.split_last()
            && let Some(DeValue::Table(table)) = self.get(table).map(Spanned::get_ref)
            && let Some((key, _)) = table.get_key_value(*key)
        {
            return self.error_in(key.span(), write_path(at), message);
        }
        self.error(at, message)
    }

    /// An error of the parser or of a reader, with its place found from its span.
    pub fn serde_error(&self, error: toml::de::Error) -> FileError {
        let span = error.span().unwrap_or(0..self.text.len());
        let mut path = String::new();
        path_to(&self.root, span.start, &mut path);
        let message = error.message().trim().to_owned();
        let suggestion = nearest(&message);
        let error = self.error_in(span, path, message);
        match suggestion {
            Some(name) => error.with_help(format!("did you mean `{name}`?")),
            None => error,
        }
    }

    fn error_in(&self, span: Range<usize>, key: String, message: impl Into<String>) -> FileError {
        let before = &self.text[..span.start.min(self.text.len())];
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
        FileError {
            file: self.name.to_owned(),
            line,
            column,
            key,
            message: message.into(),
            help: None,
            span,
            text: self.text.to_owned(),
        }
    }
}

fn write_path(at: &[Place]) -> String {
    let mut path = String::new();
    for place in at {
        push(&mut path, place);
    }
    path
}

fn push(path: &mut String, place: &Place) {
    match place {
        Place::Key(key) if path.is_empty() => path.push_str(key),
        Place::Key(key) => path.extend([".", key]),
        Place::Index(index) => path.push_str(&format!("[{index}]")),
    }
}

/// The path to the innermost key or value that covers a byte.
fn path_to(value: &Spanned<DeValue>, offset: usize, path: &mut String) {
    match value.get_ref() {
        DeValue::Table(table) => {
            for (key, value) in table {
                if key.span().contains(&offset) || covers(value, offset) {
                    push(path, &Place::Key(key.get_ref()));
                    return path_to(value, offset, path);
                }
            }
        }
        DeValue::Array(array) => {
            if let Some((index, value)) = array.iter().enumerate().find(|(_, value)| covers(value, offset)) {
                push(path, &Place::Index(index));
                path_to(value, offset, path);
            }
        }
        _ => {}
    }
}

/// Whether a value or anything in it covers a byte; the span of a table's header does not cover its body.
fn covers(value: &Spanned<DeValue>, offset: usize) -> bool {
    value.span().contains(&offset)
        || match value.get_ref() {
            DeValue::Table(table) => {
                table.iter().any(|(key, value)| key.span().contains(&offset) || covers(value, offset))
            }
            DeValue::Array(array) => array.iter().any(|value| covers(value, offset)),
            _ => false,
        }
}

/// The valid name nearest to an unknown one, from serde's message about it.
fn nearest(message: &str) -> Option<String> {
    let rest = message.strip_prefix("unknown field `").or_else(|| message.strip_prefix("unknown variant `"))?;
    let (found, rest) = rest.split_once('`')?;
    let valid = rest.split('`').skip(1).step_by(2);
    let closest = valid.map(|name| (strsim::jaro_winkler(found, name), name)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (closest.0 > 0.7).then(|| closest.1.to_owned())
}
