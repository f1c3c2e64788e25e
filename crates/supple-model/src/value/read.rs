//! Reads values from files. Serde passes no context to nested fields, so a value requests itself by the name [`VALUE`],
//! and a reader that has the names of parameters responds with a map: the text, and in it what each name stands for.

use std::collections::BTreeMap;

use serde::de::{self, Deserialize, Deserializer, Error, MapAccess, SeqAccess, Unexpected, Visitor};

use super::Value;
use super::error::ValueError;
use super::names::{Names, leaf};

/// The newtype name by which values identify themselves to readers.
pub const VALUE: &str = "$supple::Value";

/// Visitor that reads one value, and fails on everything else.
struct One;

impl<'de> Visitor<'de> for One {
    type Value = Value;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("a number, the name of a parameter or an expression of parameters")
    }
    fn visit_f64<E: Error>(self, number: f64) -> Result<Value, E> {
        if number.is_finite() {
            Ok(Value::Number(number))
        } else {
            Err(E::custom(format!("{number} is not a finite number")))
        }
    }
    fn visit_i64<E: Error>(self, number: i64) -> Result<Value, E> {
        self.visit_f64(number as f64)
    }
    fn visit_u64<E: Error>(self, number: u64) -> Result<Value, E> {
        self.visit_f64(number as f64)
    }
    /// What a reader with names responds: see [`Names::respond`].
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Value, A::Error> {
        let Some((text, indices)) = map.next_entry::<String, BTreeMap<String, Vec<f64>>>()? else {
            return Err(A::Error::invalid_type(Unexpected::Map, &self));
        };
        Value::read(&text, &mut |name| indices.get(name).and_then(|of| leaf(of)), &[]).map_err(A::Error::custom)
    }
    /// Reached if the reader has no names of parameters.
    fn visit_str<E: Error>(self, text: &str) -> Result<Value, E> {
        Names::default().value(text).map_err(E::custom)
    }
    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_newtype_struct(VALUE, One)
    }
}

/// One value, or a list of them.
///
/// ```
/// use supple_model::Value;
/// use supple_model::value::OneOrList;
///
/// let found: OneOrList = serde_json::from_str("[1.0, 2.0]")?;
/// assert_eq!(found, OneOrList::List(vec![Value::Number(1.0), Value::Number(2.0)]));
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum OneOrList {
    /// One value.
    One(Value),
    /// A list.
    List(Vec<Value>),
}

impl<'de> Deserialize<'de> for OneOrList {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;

        impl<'de> Visitor<'de> for Either {
            type Value = OneOrList;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a number, the name of a parameter, or a list of them")
            }
            fn visit_f64<E: Error>(self, number: f64) -> Result<OneOrList, E> {
                One.visit_f64(number).map(OneOrList::One)
            }
            fn visit_i64<E: Error>(self, number: i64) -> Result<OneOrList, E> {
                One.visit_i64(number).map(OneOrList::One)
            }
            fn visit_u64<E: Error>(self, number: u64) -> Result<OneOrList, E> {
                One.visit_u64(number).map(OneOrList::One)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<OneOrList, A::Error> {
                One.visit_map(map).map(OneOrList::One)
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<OneOrList, E> {
                One.visit_str(text).map(OneOrList::One)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<OneOrList, A::Error> {
                Vec::deserialize(de::value::SeqAccessDeserializer::new(list)).map(OneOrList::List)
            }
            fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<OneOrList, D::Error> {
                deserializer.deserialize_any(self)
            }
        }

        deserializer.deserialize_newtype_struct(VALUE, Either)
    }
}

/// One number, or a list of them.
///
/// ```
/// use supple_model::Value;
/// use supple_model::value::OneOrMore;
///
/// let one = OneOrMore(vec![Value::Number(2.0)]);
/// assert_eq!(one.each(3), Ok(vec![Value::Number(2.0); 3]));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct OneOrMore(pub Vec<Value>);

impl OneOrMore {
    /// The number of each of `len` entries.
    ///
    /// # Errors
    /// If there is neither one number nor `len` of them.
    pub fn each(self, len: usize) -> Result<Vec<Value>, ValueError> {
        match <[Value; 1]>::try_from(self.0) {
            Ok([one]) => Ok(vec![one; len]),
            Err(list) if list.len() == len => Ok(list),
            Err(list) => Err(ValueError::Count { expected: len, found: list.len() }),
        }
    }
}

impl<'de> Deserialize<'de> for OneOrMore {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        OneOrList::deserialize(deserializer).map(|given| match given {
            OneOrList::One(value) => Self(vec![value]),
            OneOrList::List(list) => Self(list),
        })
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for OneOrMore {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "OneOrMore".into()
    }
    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let value = generator.subschema_for::<Value>();
        schemars::json_schema!({
            "description": "A number, or a list of numbers",
            "anyOf": [value, { "type": "array", "items": value }]
        })
    }
}
