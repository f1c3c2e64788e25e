//! Parsed files whose errors name file, line and key.
//!
//! # A file with one key
//!
//! ```
//! use serde::Deserialize;
//! use supple_model::document::{Content, Document, Spanned, Table};
//!
//! // What a parser makes of a file; each key and value has its byte range.
//! let text = "weight = 2.0";
//! let weight = (Spanned::new(0..6, "weight".into()), Spanned::new(9..12, Content::Decimal("2.0".into())));
//! let document = Document::new("cost.toml", text, Table::from([weight]));
//! assert_eq!(document.read::<f64>(&["weight".into()])?, 2.0);
//!
//! // The same in two steps.
//! let value = document.get(&["weight".into()]).ok_or("there is no weight")?;
//! assert_eq!(f64::deserialize(document.reader(value))?, 2.0);
//!
//! let error = document.error(&["weight".into()], "must be below 1");
//! assert_eq!((error.line, error.key.as_str()), (1, "weight"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod content;
mod described;
mod pattern;
mod read_error;
mod reader;
mod registry;
#[cfg(feature = "schema")]
mod schemas;
mod unfit;

pub use content::{Content, Spanned, Table};
pub use described::Described;
pub use pattern::matches;
pub use read_error::ReadError;
pub use reader::{Reader, Variant};
pub use registry::NoKeys;
pub use registry::Registry;
#[cfg(feature = "schema")]
pub use schemas::{merged, one_of, plain};
pub use supple_text::FileError;
pub use unfit::Unfit;

use std::ops::Range;
use std::rc::Rc;

use serde::de::DeserializeOwned;
use supple_text::{Files, nearest, quoted};

use crate::value::{Names, as_key};
use read_error::join;

/// A step on the way to a place in a file.
///
/// Example: the [module](crate::document).
#[derive(Clone, Copy, Debug)]
pub enum Place<'a> {
    /// To the value of a key.
    Key(&'a str),
    /// To an entry of a list, from 0.
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

/// A parsed file in which every value has its position.
///
/// Example: the [module](crate::document).
pub struct Document<'a> {
    name: &'a str,
    text: &'a str,
    root: Spanned<Content<'a>>,
    /// Whether its strings are table cells, which may represent numbers and lists.
    of_cells: bool,
    /// The names that values may use.
    names: Option<Rc<Names>>,
    /// Where the files that it names are read.
    files: Files,
}

/// A table of a document, by its place: where an error about it points.
///
/// Example: [`read_sensor`](crate::quantity::read_sensor).
#[derive(Clone, Copy)]
pub struct Spot<'a> {
    /// The document.
    pub document: &'a Document<'a>,
    /// The table's place in it.
    pub at: &'a [Place<'a>],
}

impl<'a> Document<'a> {
    /// The table at a place.
    #[must_use]
    pub fn spot(&'a self, at: &'a [Place<'a>]) -> Spot<'a> {
        Spot { document: self, at }
    }

    /// A document parsed from `text`; errors call the file `name`. `supple_file::parse_document` reads TOML.
    #[must_use]
    pub fn new(name: &'a str, text: &'a str, root: Table<'a>) -> Self {
        Self {
            name,
            text,
            root: Spanned::new(0..0, Content::Table(root)),
            of_cells: false,
            names: None,
            files: Files::default(),
        }
    }

    /// A document made of table cells of another format. A cell is read as whatever type is requested: text, a number,
    /// or a list with `;` between its entries.
    #[must_use]
    pub fn of_cells(name: &'a str, text: &'a str, root: Table<'a>) -> Self {
        Self { of_cells: true, ..Self::new(name, text, root) }
    }

    /// The same document, but its values may use parameter names.
    #[must_use]
    pub fn naming(self, names: Rc<Names>) -> Self {
        Self { names: Some(names), ..self }
    }

    /// The same document, but the files that it names are read there.
    #[must_use]
    pub fn reading(self, files: Files) -> Self {
        Self { files, ..self }
    }

    /// Where the files that it names are read.
    #[must_use]
    pub fn files(&self) -> &Files {
        &self.files
    }

    /// The names that its values may use.
    #[must_use]
    pub fn names(&self) -> Option<Rc<Names>> {
        self.names.clone()
    }

    /// Reads a value of this document.
    #[must_use]
    pub fn reader<'b>(&'b self, value: &'b Spanned<Content<'b>>) -> Reader<'b> {
        let mut reader = Reader::new(value);
        if self.of_cells {
            reader = reader.of_cells();
        }
        match &self.names {
            Some(names) => reader.naming(names),
            None => reader,
        }
    }

    /// The value at a place.
    #[must_use]
    pub fn get(&self, at: &[Place]) -> Option<&Spanned<Content<'a>>> {
        at.iter().try_fold(&self.root, |value, place| match (place, value.get_ref()) {
            (Place::Key(key), Content::Table(table)) => table.get(*key),
            (Place::Index(index), Content::List(array)) => array.get(*index),
            _ => None,
        })
    }

    /// Reads the value at a place.
    ///
    /// # Errors
    /// If it is missing or has the wrong type.
    pub fn read<T: DeserializeOwned>(&self, at: &[Place]) -> Result<T, FileError> {
        let value = self.get(at).ok_or_else(|| self.error(at, "is missing"))?;
        T::deserialize(self.reader(value)).map_err(|error| self.read_error(at, error))
    }

    /// The key `kind` of the table at a place, and a reader for the rest of that table.
    pub fn table_with_kind(&self, at: &[Place], kinds: &[&str]) -> Result<(&str, Reader<'_>), FileError> {
        let value = self.get(at).ok_or_else(|| self.error(at, "is missing"))?;
        let Content::Table(table) = value.get_ref() else {
            return Err(self.error(at, "must be a table with a key `kind`"));
        };
        let at_kind: Vec<Place> = at.iter().copied().chain([Place::Key("kind")]).collect();
        let wrong = |what: &str| Err(self.error(&at_kind, format!("{what} one of {}", quoted(kinds))));
        match table.get("kind").map(Spanned::get_ref) {
            Some(Content::Text(kind)) => Ok((kind, self.reader(value).beside(&["kind"]))),
            Some(_) => wrong("must be"),
            None => wrong("is missing: it must be"),
        }
    }

    /// The text under a key of the table at a place, which must not be empty.
    pub fn text_of(&self, at: &[Place], key: &'static str) -> Result<String, FileError> {
        let place: Vec<Place> = at.iter().copied().chain([key.into()]).collect();
        let text: String = self.read(&place)?;
        if text.is_empty() { Err(self.error(&place, "must not be empty")) } else { Ok(text) }
    }

    /// How many tables the list at a place has; 0 if nothing is there.
    ///
    /// # Errors
    /// If something other than a list of tables is there.
    pub fn tables(&self, at: &[Place]) -> Result<usize, FileError> {
        match self.get(at).map(Spanned::get_ref) {
            None => Ok(0),
            Some(Content::List(list)) => Ok(list.len()),
            Some(_) => Err(self.error(at, "must be a list of tables")),
        }
    }

    /// The error for a table at a place whose kind is not one of `kinds`.
    #[must_use]
    pub fn unknown_kind(&self, at: &[Place], kind: &str, kinds: &[&str]) -> FileError {
        let at_kind: Vec<Place> = at.iter().copied().chain([Place::Key("kind")]).collect();
        let error = self.error(&at_kind, format!("must be one of {}; found `{kind}`", quoted(kinds)));
        FileError { help: nearest(kind, kinds), ..error }
    }

    /// An error about the value at a place, or about its nearest parent that exists.
    pub fn error(&self, at: &[Place], message: impl Into<String>) -> FileError {
        let existing = (0..=at.len()).rev().find_map(|len| self.get(&at[..len])).unwrap_or(&self.root);
        self.error_in(existing.span(), write_path(at), message)
    }

    /// An error in a file named by the value at a place; if that file cannot be read, the error points to the value.
    #[must_use]
    pub fn error_of_file(&self, at: &[Place], error: FileError) -> FileError {
        if error.line == 0 { self.error(at, error.to_string()) } else { error }
    }

    /// An error about a key itself, not its value.
    pub fn error_at_key(&self, at: &[Place], message: impl Into<String>) -> FileError {
        if let Some((Place::Key(key), table)) = at.split_last()
            && let Some(Content::Table(table)) = self.get(table).map(Spanned::get_ref)
            && let Some((key, _)) = table.get_key_value(*key)
        {
            return self.error_in(key.span(), write_path(at), message);
        }
        self.error(at, message)
    }

    /// An error from reading the value at a place.
    #[must_use]
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
