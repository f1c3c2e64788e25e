use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::reader::{ReadError, Reader, join};
use crate::value::{as_key, nearest, quoted};

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
    pub(crate) fn unreadable(file: &str, why: impl std::fmt::Display) -> Self {
        Self {
            file: file.to_owned(),
            line: 0,
            column: 0,
            key: String::new(),
            message: format!("cannot be read: {why}"),
            help: None,
            span: 0..0,
            text: String::new(),
        }
    }

    /// An error about bytes of the text.
    pub(crate) fn at(file: &str, text: &str, span: Range<usize>, key: String, message: impl Into<String>) -> Self {
        // The parser may point into the middle of a character.
        let boundary = |byte: usize| (0..=byte.min(text.len())).rev().find(|&byte| text.is_char_boundary(byte));
        let (start, end) = (boundary(span.start).unwrap_or(0), boundary(span.end).unwrap_or(0));
        let before = &text[..start];
        Self {
            file: file.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before.chars().rev().take_while(|&c| c != '\n').count() + 1,
            key,
            message: message.into(),
            help: None,
            span: start..end.max(start),
            text: text.to_owned(),
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
        match DeTable::parse(text) {
            Ok(table) => Ok(Self { name, text, root: Spanned::new(0..0, DeValue::Table(table.into_inner())) }),
            Err(error) => {
                let span = error.span().unwrap_or(0..0);
                match (error.message().trim(), text.get(span.clone())) {
                    ("duplicate key", Some(key)) => {
                        let message = format!("`{key}` is there already; a key is given once");
                        Err(FileError::at(name, text, span, key.to_owned(), message))
                    }
                    (message, _) => Err(FileError::at(name, text, span, String::new(), message)),
                }
            }
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
        let value = self.get(at).ok_or_else(|| self.error(at, "is missing"))?;
        T::deserialize(Reader::new(value)).map_err(|error| self.read_error(at, error))
    }

    /// The key `kind` of the table at a place, and what reads the rest of that table.
    pub fn table_with_kind(&self, at: &[Place], kinds: &[&str]) -> Result<(&str, Reader<'_>), FileError> {
        let value = self.get(at).ok_or_else(|| self.error(at, "is missing"))?;
        let DeValue::Table(table) = value.get_ref() else {
            return Err(self.error(at, "must be a table with a key `kind`"));
        };
        let at_kind: Vec<Place> = at.iter().copied().chain([Place::Key("kind")]).collect();
        let wrong = |what: &str| Err(self.error(&at_kind, format!("{what} one of {}", quoted(kinds))));
        match table.get("kind").map(Spanned::get_ref) {
            Some(DeValue::String(kind)) => Ok((kind, Reader::new(value).without("kind"))),
            Some(_) => wrong("must be"),
            None => wrong("is missing: it must be"),
        }
    }

    /// The kind of the table at a place is not one of `kinds`.
    pub fn unknown_kind(&self, at: &[Place], kind: &str, kinds: &[&str]) -> FileError {
        let at_kind: Vec<Place> = at.iter().copied().chain([Place::Key("kind")]).collect();
        let error = self.error(&at_kind, format!("must be one of {}; found `{kind}`", quoted(kinds)));
        FileError { help: nearest(kind, kinds), ..error }
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

    /// An error of reading the value at a place.
    pub fn read_error(&self, at: &[Place], error: ReadError) -> FileError {
        let here = self.error(at, error.message);
        let span = error.span.unwrap_or(here.span);
        let located = self.error_in(span, join(&here.key, &error.path), here.message);
        FileError { help: error.help, ..located }
    }

    fn error_in(&self, span: Range<usize>, key: String, message: impl Into<String>) -> FileError {
        FileError::at(self.name, self.text, span, key, message)
    }
}

fn write_path(at: &[Place]) -> String {
    at.iter().fold(String::new(), |path, place| match place {
        Place::Key(key) => join(&path, &as_key(key)),
        Place::Index(index) => format!("{path}[{index}]"),
    })
}
