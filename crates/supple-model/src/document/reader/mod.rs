//! Reads values of a parsed file through serde. Submodules handle table cells, and names with settings.

use std::borrow::Cow;

use serde::de::value::StrDeserializer;
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Unexpected, Visitor};
use serde::forward_to_deserialize_any;
use supple_text::quoted;

use super::content::{Content, Spanned, Table};
use super::read_error::{ReadError, instead_of, name_of};
use crate::value::{Names, VALUE, as_key};

mod cells;
mod variant;

use cells::Cell;
pub use variant::Variant;
use variant::within_settings;

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

    /// The value as a cell; `None` if it is not text, or the document is not made of cells.
    fn cell(&self) -> Option<Cell<'_>> {
        match self.value.get_ref() {
            Content::Text(text) if self.of_cells => Some(Cell { text, span: self.value.span(), names: self.names }),
            _ => None,
        }
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

    /// The value as one of several names, alone or with settings; does not check that it is one of them.
    pub fn variant(self, names: &[&str]) -> Result<Variant<'a>, ReadError> {
        let wrong = |found: &str| ReadError::custom(format_args!("must be one of {}; found {found}", quoted(names)));
        let table = match self.value.get_ref() {
            Content::Text(name) => return Ok(Variant { name, span: None, settings: None }),
            Content::Table(table) => table,
            _ => return Err(wrong(&name_of(self.unexpected()))),
        };
        let mut entries = self.entries(table).entries;
        match (entries.next(), entries.next()) {
            (Some((key, settings)), None) => {
                Ok(Variant { name: key.get_ref(), span: Some(key.span()), settings: Some(self.inside(settings)) })
            }
            _ => Err(wrong(&format!("a table with {} keys", table.len()))),
        }
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

    /// Checks for unknown keys if some keys are read separately; the error lists all valid ones.
    fn check_keys(&self, entries: &Entries, own: &[&'static str]) -> Result<(), ReadError> {
        let apart = || self.apart.iter().flat_map(|keys| keys.iter().copied()).filter(|&key| key != "kind");
        if apart().next().is_none() {
            return Ok(());
        }
        let known = |key: &str| {
            let renamed = self.renamed.is_some_and(|(from, _)| from == key);
            renamed || own.contains(&key)
        };
        let Some((key, _)) = entries.entries.as_slice().iter().find(|(key, _)| !known(key.get_ref())) else {
            return Ok(());
        };
        let valid: Vec<&str> = own.iter().copied().chain(apart()).collect();
        let found = key.get_ref();
        let error = ReadError::custom(format_args!("unknown key `{found}`; valid: {}", quoted(&valid)));
        Err(ReadError { help: instead_of(found, &valid), ..error }.within(&as_key(found), key.span()))
    }

    /// The entries of a table in the order of the file.
    fn entries(&self, table: &'a Table<'a>) -> Entries<'a> {
        let is_read = |key: &str| {
            self.only.is_none_or(|only| only.contains(&key)) && !self.apart.iter().any(|keys| keys.contains(&key))
        };
        let mut entries: Vec<_> = table.iter().filter(|(key, _)| is_read(key.get_ref())).collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        Entries { entries: entries.into_iter(), value: None, renamed: self.renamed, of: *self }
    }
}

impl<'de> Deserializer<'de> for Reader<'_> {
    type Error = ReadError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        if let Some(cell) = self.cell() {
            return cell.read_any(visitor);
        }
        let too_large = |number: &str| Err(ReadError::custom(format_args!("is too large a number: {number}")));
        match self.value.get_ref() {
            Content::Text(text) => visitor.visit_str(text),
            Content::Whole { digits, radix } => match i64::from_str_radix(digits, *radix) {
                Ok(value) => visitor.visit_i64(value),
                Err(_) => too_large(digits),
            },
            Content::Decimal(number) => match number.parse::<f64>() {
                // `inf` and `nan` are passed to the visitor to decide; a finite number that overflows is an error.
                Ok(value) if value.is_finite() || number.contains('n') => visitor.visit_f64(value),
                _ => too_large(number),
            },
            Content::Boolean(value) => visitor.visit_bool(*value),
            Content::Date => Err(ReadError::invalid_type(self.unexpected(), &visitor)),
            Content::List(list) => {
                let mut entries = List { entries: list.iter().enumerate(), of: self };
                let value = visitor.visit_seq(&mut entries)?;
                match entries.entries.len() {
                    0 => Ok(value),
                    rest => {
                        let valid = list.len() - rest;
                        Err(ReadError::custom(format_args!("must be a list of {valid}; found {}", list.len())))
                    }
                }
            }
            Content::Table(table) => visitor.visit_map(self.entries(table)),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_some(self)
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        match self.cell() {
            Some(cell) => visitor.visit_str(cell.text),
            None => self.deserialize_any(visitor),
        }
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        self.deserialize_str(visitor)
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        match self.cell().and_then(|cell| cell.text.parse().ok()) {
            Some(value) => visitor.visit_bool(value),
            None => self.deserialize_any(visitor),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        match self.cell() {
            Some(cell) => cell.read_list(visitor),
            None => self.deserialize_any(visitor),
        }
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, ReadError> {
        self.deserialize_seq(visitor)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        if name != VALUE {
            return visitor.visit_newtype_struct(self);
        }
        match (self.value.get_ref(), self.names) {
            (Content::Text(text), Some(names)) if self.cell().is_none_or(|cell| cell.is_text()) => {
                names.respond(text, visitor)
            }
            // A table would be mistaken for a response.
            (Content::Table(_), _) => Err(ReadError::invalid_type(self.unexpected(), &visitor)),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        keys: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        match self.value.get_ref() {
            Content::Table(table) => {
                let entries = self.entries(table);
                self.check_keys(&entries, keys)?;
                visitor.visit_map(entries)
            }
            _ => Err(ReadError::invalid_type(self.unexpected(), &visitor)),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        let variant = self.variant(variants)?;
        let (name, settings) = (variant.name, variant.settings);
        visitor.visit_enum(variant).map_err(|error| within_settings(error, name, settings))
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_unit()
    }

    forward_to_deserialize_any! {
        i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char bytes byte_buf unit unit_struct tuple_struct map identifier
    }
}

/// The entries of a list still to be read.
struct List<'a> {
    entries: std::iter::Enumerate<std::slice::Iter<'a, Spanned<Content<'a>>>>,
    of: Reader<'a>,
}

impl<'de> SeqAccess<'de> for List<'_> {
    type Error = ReadError;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, ReadError> {
        let Some((index, value)) = self.entries.next() else { return Ok(None) };
        let read = seed.deserialize(self.of.inside(value)).map(Some);
        read.map_err(|error| error.within(&format!("[{index}]"), value.span()))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.entries.len())
    }
}

/// A key and its value.
type Entry<'a> = (&'a Spanned<Cow<'a, str>>, &'a Spanned<Content<'a>>);

/// The entries of a table still to be read, and the entry whose key was read last.
struct Entries<'a> {
    entries: std::vec::IntoIter<Entry<'a>>,
    value: Option<Entry<'a>>,
    /// A key that is read under another name.
    renamed: Option<(&'static str, &'static str)>,
    of: Reader<'a>,
}

impl<'de> MapAccess<'de> for Entries<'_> {
    type Error = ReadError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, ReadError> {
        self.value = self.entries.next();
        let Some((key, _)) = self.value else { return Ok(None) };
        let renamed = self.renamed.filter(|(from, _)| key.get_ref() == from);
        let name = renamed.map_or(key.get_ref().as_ref(), |(_, to)| to);
        let read = seed.deserialize(StrDeserializer::<ReadError>::new(name)).map(Some);
        read.map_err(|error| error.within(&as_key(key.get_ref()), key.span()))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, ReadError> {
        let Some((key, value)) = self.value else { return Err(ReadError::custom("a value was read before its key")) };
        let read = seed.deserialize(self.of.inside(value));
        read.map_err(|error| error.within(&as_key(key.get_ref()), value.span()))
    }
}
