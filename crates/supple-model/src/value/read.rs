//! Reads values from files. Serde passes no context to nested fields, so a value requests itself by the name [`VALUE`],
//! and a reader that has the names of parameters responds with the meaning of the text.

use serde::de::{self, Deserialize, Deserializer, Error, SeqAccess, Visitor};

use super::{Expression, Names, ParameterHandle, Value};

/// The newtype name by which values identify themselves to readers.
pub const VALUE: &str = "$supple::Value";

impl Value {
    /// Gives a value to a visitor that requested [`VALUE`]: parameters and expressions are encoded as 128-bit numbers, which
    /// no file format has.
    pub(crate) fn visit<'de, V: Visitor<'de>, E: Error>(self, visitor: V) -> Result<V::Value, E> {
        match self {
            Self::Number(number) => visitor.visit_f64(number),
            Self::Parameter(parameter) => visitor.visit_u128(parameter.index() as u128),
            Self::Expression(expression) => visitor.visit_i128(expression.place() as i128),
        }
    }
}

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
    fn visit_u128<E: Error>(self, index: u128) -> Result<Value, E> {
        Ok(ParameterHandle::at(index as usize).into())
    }
    fn visit_i128<E: Error>(self, place: i128) -> Result<Value, E> {
        let expression = usize::try_from(place).ok().and_then(Expression::at);
        expression.map(Value::Expression).ok_or_else(|| E::custom("no such expression"))
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
            fn visit_u128<E: Error>(self, index: u128) -> Result<OneOrList, E> {
                One.visit_u128(index).map(OneOrList::One)
            }
            fn visit_i128<E: Error>(self, place: i128) -> Result<OneOrList, E> {
                One.visit_i128(place).map(OneOrList::One)
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
