//! Readers as serde uses them.

use serde::de::{Deserializer, Error, Visitor};
use serde::forward_to_deserialize_any;

use super::Reader;
use super::entries::List;
use super::variant::within_settings;
use crate::document::content::Content;
use crate::document::read_error::ReadError;
use crate::value::VALUE;

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
