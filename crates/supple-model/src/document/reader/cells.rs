//! Table cells: texts that are read as whatever type is requested.

use std::ops::Range;

use serde::de::{DeserializeSeed, Deserializer, Error, SeqAccess, Visitor};
use serde::forward_to_deserialize_any;

use super::Reader;
use crate::document::content::{Content, Spanned};
use crate::document::read_error::ReadError;
use crate::value::Names;

/// A cell.
pub(super) struct Cell<'a> {
    pub text: &'a str,
    /// Its bytes in the file.
    pub span: Range<usize>,
    /// The names that values may use.
    pub names: Option<&'a Names>,
}

/// Separator between the entries of a list.
const BETWEEN: char = ';';

impl<'a> Cell<'a> {
    /// Whether it is neither a number nor a list.
    pub fn is_text(&self) -> bool {
        !self.text.contains(BETWEEN) && self.text.parse::<f64>().is_err()
    }

    /// Reads a list if there is more than one entry, else a number if it is one, else text.
    pub fn read_any<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        if self.text.contains(BETWEEN) {
            return self.read_list(visitor);
        }
        match (self.text.parse::<i64>(), self.text.parse::<f64>()) {
            (Ok(number), _) => visitor.visit_i64(number),
            // Whether non-finite numbers are valid is up to the visitor.
            (_, Ok(number)) => visitor.visit_f64(number),
            _ => visitor.visit_str(self.text),
        }
    }

    /// Reads a list, which may have a single entry.
    pub fn read_list<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        let mut start = self.span.start;
        // If the text is written differently in the file, for example with quotes, the parts cannot be located in it.
        let is_plain = self.span.len() == self.text.len();
        let words = self.text.split(BETWEEN).filter_map(|word| {
            let from = start + word.len() - word.trim_start().len();
            start += word.len() + BETWEEN.len_utf8();
            let word = word.trim();
            let span = if is_plain { from..from + word.len() } else { self.span.clone() };
            (!word.is_empty()).then(|| Spanned::new(span, Content::Text(word.into())))
        });
        let words: Vec<_> = words.collect();
        let mut left = Words { words: &words, next: 0, names: self.names };
        let value = visitor.visit_seq(&mut left)?;
        match words.len() - left.next {
            0 => Ok(value),
            rest => {
                let valid = words.len() - rest;
                Err(ReadError::custom(format_args!("must be a list of {valid}; found {}", words.len())))
            }
        }
    }
}

impl Reader<'_> {
    /// The value as a cell; `None` if it is not text, or the document is not made of cells.
    pub(super) fn cell(&self) -> Option<Cell<'_>> {
        match self.value.get_ref() {
            Content::Text(text) if self.of_cells => Some(Cell { text, span: self.value.span(), names: self.names }),
            _ => None,
        }
    }
}

/// The entries of a list still to be read.
struct Words<'a> {
    words: &'a [Spanned<Content<'a>>],
    next: usize,
    names: Option<&'a Names>,
}

impl<'de> SeqAccess<'de> for Words<'_> {
    type Error = ReadError;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, ReadError> {
        let index = self.next;
        let Some(word) = self.words.get(index) else { return Ok(None) };
        let read = seed.deserialize(Entry { of: self }).map(Some);
        read.map_err(|error| error.within(&format!("[{index}]"), word.span()))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.words.len() - self.next)
    }
}

/// The next entry of a list. If the entry is itself a list, it takes all remaining words.
struct Entry<'a, 'b> {
    of: &'b mut Words<'a>,
}

impl<'a> Entry<'a, '_> {
    fn word(self) -> Result<Reader<'a>, ReadError> {
        let word = self.of.words.get(self.of.next).ok_or_else(|| ReadError::custom("is missing"))?;
        self.of.next += 1;
        let reader = Reader::new(word).of_cells();
        Ok(self.of.names.map_or(reader, |names| reader.naming(names)))
    }
}

impl<'de> Deserializer<'de> for Entry<'_, '_> {
    type Error = ReadError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        self.word()?.deserialize_any(visitor)
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        self.word()?.deserialize_str(visitor)
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        self.word()?.deserialize_str(visitor)
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        self.word()?.deserialize_bool(visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        self.word()?.deserialize_enum(name, variants, visitor)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        self.word()?.deserialize_newtype_struct(name, visitor)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_seq(self.of)
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_seq(self.of)
    }

    forward_to_deserialize_any! {
        i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char bytes byte_buf option unit unit_struct
        tuple_struct map struct identifier ignored_any
    }
}
