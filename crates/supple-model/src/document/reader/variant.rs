//! Reads one of several names from a parsed file through serde.

use std::ops::Range;

use serde::de::value::{MapDeserializer, StrDeserializer};
use serde::de::{self, DeserializeSeed, Deserializer, EnumAccess, Error, VariantAccess, Visitor};
use serde::forward_to_deserialize_any;
use supple_text::{nearest, quoted};

use super::Reader;
use crate::document::content::Content;
use crate::document::read_error::{ReadError, name_of};
use crate::value::as_key;

/// One of several names, alone or with settings: `"name"`, or `{ name = { key = value } }`.
///
/// ```
/// use supple_model::document::{Content, Reader, Spanned};
///
/// let value = Spanned::new(0..11, Content::Text("quadratic".into()));
/// let norm = Reader::new(&value).variant(&["absolute", "quadratic"])?;
/// assert_eq!(norm.name(), "quadratic");
/// # Ok::<(), supple_model::document::ReadError>(())
/// ```
pub struct Variant<'a> {
    pub(super) name: &'a str,
    /// Byte range of the name, if it is a key.
    pub(super) span: Option<Range<usize>>,
    pub(super) settings: Option<Reader<'a>>,
}

impl<'a> Reader<'a> {
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
}

impl<'a, 'de> EnumAccess<'de> for Variant<'a> {
    type Error = ReadError;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Self), ReadError> {
        match seed.deserialize(StrDeserializer::<ReadError>::new(self.name)) {
            Ok(value) => Ok((value, self)),
            Err(error) => Err(ReadError { span: self.span, ..error }),
        }
    }
}

/// An error in the settings of a name, as seen from the value that holds both.
pub(super) fn within_settings(error: ReadError, name: &str, settings: Option<Reader>) -> ReadError {
    match settings {
        Some(settings) => error.within(&as_key(name), settings.span()),
        None => error,
    }
}

impl<'a> Variant<'a> {
    /// The name.
    #[must_use]
    pub fn name(&self) -> &str {
        self.name
    }

    /// The error for a name that is not one of `valid`.
    #[must_use]
    pub fn unknown(self, valid: &[&str]) -> ReadError {
        let found = self.name;
        let error = ReadError::custom(format_args!("must be one of {}; found `{found}`", quoted(valid)));
        let error = ReadError { help: nearest(found, valid), span: self.span, ..error };
        within_settings(error, found, self.settings)
    }

    /// Its settings as a struct; may be omitted if the struct needs no keys.
    pub fn read<T: for<'de> de::Deserialize<'de>>(self) -> Result<T, ReadError> {
        let (name, settings) = (self.name, self.settings);
        T::deserialize(Settings(self)).map_err(|error| within_settings(error, name, settings))
    }

    fn settings(self, keys: &[&str]) -> Result<Reader<'a>, ReadError> {
        let keys: Vec<_> = keys.iter().map(|key| format!("{key} = ..")).collect();
        let example = format!("{{ {} = {{ {} }} }}", self.name, keys.join(", "));
        self.settings.ok_or_else(|| ReadError::custom(format_args!("`{}` needs settings: {example}", self.name)))
    }
}

impl<'de> VariantAccess<'de> for Variant<'_> {
    type Error = ReadError;

    fn unit_variant(self) -> Result<(), ReadError> {
        match self.settings {
            None => Ok(()),
            Some(_) => Err(ReadError::custom(format_args!("takes no settings: write \"{}\"", self.name))),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, ReadError> {
        seed.deserialize(self.settings(&[])?)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, ReadError> {
        self.settings(&[])?.deserialize_any(visitor)
    }

    fn struct_variant<V: Visitor<'de>>(self, keys: &'static [&'static str], visitor: V) -> Result<V::Value, ReadError> {
        self.settings(keys)?.deserialize_struct("", keys, visitor)
    }
}

/// The settings of a name, for a struct.
struct Settings<'a>(Variant<'a>);

impl<'de> Deserializer<'de> for Settings<'_> {
    type Error = ReadError;

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        keys: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        if keys.is_empty() {
            self.0.unit_variant()?;
            return visitor.visit_map(MapDeserializer::<_, ReadError>::new(std::iter::empty::<(&str, &str)>()));
        }
        self.0.settings(keys)?.deserialize_struct(name, keys, visitor)
    }

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        self.0.settings(&[])?.deserialize_any(visitor)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}
