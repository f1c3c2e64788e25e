use std::borrow::Cow;
use std::ops::Range;

use serde::de::value::StrDeserializer;
use serde::de::{self, DeserializeSeed, Deserializer, EnumAccess, MapAccess, SeqAccess, Unexpected, VariantAccess, Visitor};
use serde::forward_to_deserialize_any;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::document::{Place, push};
use crate::value::{nearest, quoted};

/// Why a value could not be read, and where in it.
#[derive(Debug)]
pub(crate) struct ReadError {
    /// The place, from the value that was read.
    pub path: Vec<Place<'static>>,
    /// Bytes of the text that are meant; none where they are those of the value that was read.
    pub span: Option<Range<usize>>,
    /// What was found, and what is valid.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

impl ReadError {
    /// Inside the entry `place`, whose bytes are `span`.
    fn within(mut self, place: Place<'static>, span: Range<usize>) -> Self {
        self.path.insert(0, place);
        self.span.get_or_insert(span);
        self
    }

    fn with_help(self, help: Option<String>) -> Self {
        Self { help, ..self }
    }
}

impl std::fmt::Display for ReadError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for ReadError {}

impl de::Error for ReadError {
    fn custom<T: std::fmt::Display>(message: T) -> Self {
        Self { path: Vec::new(), span: None, message: message.to_string(), help: None }
    }
    fn invalid_type(found: Unexpected, valid: &dyn de::Expected) -> Self {
        Self::custom(format_args!("must be {}; found {}", plain(&valid.to_string()), name_of(found)))
    }
    fn invalid_value(found: Unexpected, valid: &dyn de::Expected) -> Self {
        Self::invalid_type(found, valid)
    }
    fn invalid_length(found: usize, valid: &dyn de::Expected) -> Self {
        Self::custom(format_args!("must be {}; found {found} entries", plain(&valid.to_string())))
    }
    fn unknown_field(found: &str, valid: &'static [&'static str]) -> Self {
        let message = match valid {
            [] => format!("unknown key `{found}`; there are none here"),
            _ => format!("unknown key `{found}`; valid are {}", quoted(valid)),
        };
        Self::custom(message).with_help(nearest(found, valid))
    }
    fn unknown_variant(found: &str, valid: &'static [&'static str]) -> Self {
        Self::custom(format_args!("must be one of {}; found `{found}`", quoted(valid))).with_help(nearest(found, valid))
    }
    fn missing_field(field: &'static str) -> Self {
        Self { path: vec![Place::Key(field.into())], ..Self::custom("is missing") }
    }
}

/// What serde expects, in plain words.
fn plain(valid: &str) -> Cow<'_, str> {
    match valid {
        "f32" | "f64" => "a number".into(),
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number".into(),
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number of at least 0".into(),
        "a boolean" => "true or false".into(),
        "a string" => "text in quotes".into(),
        "a sequence" => "a list".into(),
        "a map" => "a table".into(),
        _ if valid.starts_with("struct ") => "a table".into(),
        _ => match valid.strip_prefix("an array of length ") {
            Some(length) => format!("a list of {length} entries").into(),
            None => valid.into(),
        },
    }
}

/// What was found, in plain words.
fn name_of(found: Unexpected) -> String {
    match found {
        Unexpected::Bool(value) => value.to_string(),
        Unexpected::Unsigned(number) => number.to_string(),
        Unexpected::Signed(number) => number.to_string(),
        Unexpected::Float(number) => number.to_string(),
        Unexpected::Str(text) => format!("{text:?}"),
        Unexpected::Seq => "a list".into(),
        Unexpected::Map => "a table".into(),
        Unexpected::UnitVariant => "a name alone".into(),
        other => other.to_string(),
    }
}

/// Reads a value of a parsed file by serde.
///
/// Stricter than the reader that comes with the parser: a list for `[T; N]` has N entries, neither fewer nor more, and
/// only a table stands for a struct. Errors know the path to the key that is wrong.
#[derive(Clone, Copy)]
pub(crate) struct Reader<'a> {
    value: &'a Spanned<DeValue<'a>>,
    /// A key of the table that was read already.
    done: Option<&'static str>,
}

impl<'a> Reader<'a> {
    pub fn new(value: &'a Spanned<DeValue<'a>>) -> Self {
        Self { value, done: None }
    }

    /// Reads a table without its key `key`.
    pub fn without(self, key: &'static str) -> Self {
        Self { done: Some(key), ..self }
    }

    fn unexpected(&self) -> Unexpected<'a> {
        match self.value.get_ref() {
            DeValue::String(text) => Unexpected::Str(text),
            DeValue::Integer(_) => Unexpected::Other("a whole number"),
            DeValue::Float(_) => Unexpected::Other("a number"),
            DeValue::Boolean(value) => Unexpected::Bool(*value),
            DeValue::Datetime(_) => Unexpected::Other("a date or a time"),
            DeValue::Array(_) => Unexpected::Seq,
            DeValue::Table(_) => Unexpected::Map,
        }
    }

    fn entries(&self, table: &'a DeTable<'a>) -> Table<'a> {
        let mut entries: Vec<_> = table.iter().filter(|(key, _)| Some(key.get_ref().as_ref()) != self.done).collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        Table { entries: entries.into_iter(), value: None }
    }
}

impl<'de> Deserializer<'de> for Reader<'_> {
    type Error = ReadError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        match self.value.get_ref() {
            DeValue::String(text) => visitor.visit_str(text),
            DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
                Ok(number) => visitor.visit_i64(number),
                Err(_) => Err(de::Error::custom(format_args!("{number} is too large for a whole number"))),
            },
            DeValue::Float(number) => match number.as_str().parse::<f64>() {
                Ok(value) if value.is_finite() || number.as_str().contains(['i', 'n']) => visitor.visit_f64(value),
                _ => Err(de::Error::custom(format_args!("{number} is too large a number"))),
            }
            DeValue::Boolean(value) => visitor.visit_bool(*value),
            DeValue::Datetime(_) => Err(de::Error::invalid_type(self.unexpected(), &visitor)),
            DeValue::Array(list) => {
                let mut entries = List { entries: list.iter().enumerate() };
                let read = visitor.visit_seq(&mut entries)?;
                match entries.entries.len() {
                    0 => Ok(read),
                    rest => {
                        let (count, read) = (list.len(), list.len() - rest);
                        Err(de::Error::custom(format_args!("must be a list of {read} entries; found {count} entries")))
                    }
                }
            }
            DeValue::Table(table) => visitor.visit_map(self.entries(table)),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        match self.value.get_ref() {
            DeValue::Table(table) => visitor.visit_map(self.entries(table)),
            _ => Err(de::Error::invalid_type(self.unexpected(), &visitor)),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        let wrong = |found: &str| {
            let names = quoted(variants);
            de::Error::custom(format_args!("must be one of {names}, or a table with one of them as its key; found {found}"))
        };
        match self.value.get_ref() {
            DeValue::String(name) => visitor.visit_enum(Variant { name, settings: None }),
            DeValue::Table(table) => {
                let mut entries = self.entries(table).entries;
                match (entries.next(), entries.next()) {
                    (Some((key, value)), None) => {
                        let name = key.get_ref().as_ref();
                        let place = Place::Key(name.to_owned().into());
                        let read = visitor.visit_enum(Variant { name, settings: Some(Reader::new(value)) });
                        read.map_err(|error| error.within(place, key.span()))
                    }
                    _ => Err(wrong(&format!("{} keys", table.len()))),
                }
            }
            _ => Err(wrong(&name_of(self.unexpected()))),
        }
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_unit()
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map identifier
    }
}

/// The entries of a list that are still to read.
struct List<I> {
    entries: I,
}

impl<'a, 'de, I: ExactSizeIterator<Item = (usize, &'a Spanned<DeValue<'a>>)>> SeqAccess<'de> for List<I> {
    type Error = ReadError;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, ReadError> {
        let Some((index, value)) = self.entries.next() else { return Ok(None) };
        let read = seed.deserialize(Reader::new(value)).map(Some);
        read.map_err(|error| error.within(Place::Index(index), value.span()))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.entries.len())
    }
}

/// A key and its value, with their places.
type Entry<'a> = (&'a Spanned<Cow<'a, str>>, &'a Spanned<DeValue<'a>>);

/// The entries of a table that are still to read, and the one whose key was read last.
struct Table<'a> {
    entries: std::vec::IntoIter<Entry<'a>>,
    value: Option<Entry<'a>>,
}

impl<'de> MapAccess<'de> for Table<'_> {
    type Error = ReadError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, ReadError> {
        self.value = self.entries.next();
        let Some((key, _)) = self.value else { return Ok(None) };
        let name: StrDeserializer<ReadError> = de::IntoDeserializer::into_deserializer(key.get_ref().as_ref());
        let place = || Place::Key(key.get_ref().clone().into_owned().into());
        seed.deserialize(name).map(Some).map_err(|error| error.within(place(), key.span()))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, ReadError> {
        let Some((key, value)) = self.value else { return Err(de::Error::custom("a value is read before its key")) };
        let place = || Place::Key(key.get_ref().clone().into_owned().into());
        seed.deserialize(Reader::new(value)).map_err(|error| error.within(place(), value.span()))
    }
}

/// A name among several, and its settings.
struct Variant<'a> {
    name: &'a str,
    settings: Option<Reader<'a>>,
}

impl<'a, 'de> EnumAccess<'de> for Variant<'a> {
    type Error = ReadError;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Self), ReadError> {
        let name: StrDeserializer<ReadError> = de::IntoDeserializer::into_deserializer(self.name);
        seed.deserialize(name).map(|value| (value, self))
    }
}

impl Variant<'_> {
    fn settings(self, example: &str) -> Result<Self, ReadError> {
        todo!()
    }
}
