//! The entries of lists and tables.

use std::borrow::Cow;

use serde::de::value::StrDeserializer;
use serde::de::{DeserializeSeed, Error, MapAccess, SeqAccess};
use supple_text::quoted;

use super::Reader;
use crate::document::content::{Content, Spanned, Table};
use crate::document::read_error::{ReadError, instead_of};
use crate::value::as_key;

impl<'a> Reader<'a> {
    /// Checks for unknown keys if some keys are read separately; the error lists all valid ones.
    pub(super) fn check_keys(&self, entries: &Entries, own: &[&'static str]) -> Result<(), ReadError> {
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
    pub(super) fn entries(&self, table: &'a Table<'a>) -> Entries<'a> {
        let is_read = |key: &str| {
            self.only.is_none_or(|only| only.contains(&key)) && !self.apart.iter().any(|keys| keys.contains(&key))
        };
        let mut entries: Vec<_> = table.iter().filter(|(key, _)| is_read(key.get_ref())).collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        Entries { entries: entries.into_iter(), value: None, renamed: self.renamed, of: *self }
    }
}

/// The entries of a list still to be read.
pub(super) struct List<'a> {
    pub entries: std::iter::Enumerate<std::slice::Iter<'a, Spanned<Content<'a>>>>,
    pub of: Reader<'a>,
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
pub(super) struct Entries<'a> {
    pub entries: std::vec::IntoIter<Entry<'a>>,
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
