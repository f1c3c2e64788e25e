use std::borrow::Cow;
use std::cell::RefCell;

use serde::de::{self, Deserialize, Deserializer, Visitor};
use supple_files::quoted;
use supple_kernels::Scalar;

/// A number of the problem: written out, or the name of a declared parameter.
///
/// Anything numeric in a task file is a `Value`, so that stiffnesses, noise variances and weights can all be designed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// The number itself.
    Number(f64),
    /// The parameter with this index in [`Parameters`](crate::parameters::Parameters).
    Parameter(usize),
}

impl Value {
    /// The value as a scalar, given all parameters as scalars.
    pub fn resolve<S: Scalar>(self, phi: &[S]) -> S {
        match self {
            Self::Number(number) => S::constant(number),
            Self::Parameter(index) => phi[index],
        }
    }

    /// The derivative by each parameter that is not zero: its index, where there is one.
    pub fn parameter(self) -> Option<usize> {
        match self {
            Self::Number(_) => None,
            Self::Parameter(index) => Some(index),
        }
    }

    /// What to say of a value that can be as low as `least`, where that is too low.
    pub(crate) fn found(self, least: f64) -> String {
        match self {
            Self::Number(_) => format!("found {least}"),
            Self::Parameter(_) => format!("its parameter can be {least}"),
        }
    }

    /// Whether this is a number, and zero: a term that can be left out.
    pub fn is_zero(self) -> bool {
        self == Self::Number(0.0)
    }
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl Default for Value {
    fn default() -> Self {
        Self::Number(0.0)
    }
}

/// The names that a [`Value`] may use while a file is read, and which of them it did.
#[derive(Debug, Default)]
struct Names {
    declared: Vec<String>,
    used: Vec<bool>,
}

thread_local! {
    static NAMES: RefCell<Names> = RefCell::default();
}

/// Reads something whose [`Value`]s may name the `declared` parameters; returns it with which of them it named.
///
/// Serde has no other way to hand a context to nested fields; errors keep the place of the value.
pub fn with_names<T>(declared: &[String], read: impl FnOnce() -> T) -> (T, Vec<bool>) {
    let fresh = Names { declared: declared.to_vec(), used: vec![false; declared.len()] };
    let outer = NAMES.replace(fresh);
    let result = read();
    (result, NAMES.replace(outer).used)
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Number;

        impl Visitor<'_> for Number {
            type Value = Value;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a number or the name of a parameter")
            }
            fn visit_f64<E: de::Error>(self, number: f64) -> Result<Value, E> {
                if number.is_finite() {
                    Ok(Value::Number(number))
                } else {
                    Err(E::custom(format!("{number} is not a finite number")))
                }
            }
            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Value, E> {
                self.visit_f64(number as f64)
            }
            fn visit_u64<E: de::Error>(self, number: u64) -> Result<Value, E> {
                self.visit_f64(number as f64)
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<Value, E> {
                NAMES.with_borrow_mut(|names| match names.declared.iter().position(|declared| declared == name) {
                    Some(index) => {
                        names.used[index] = true;
                        Ok(Value::Parameter(index))
                    }
                    None => Err(E::custom(undeclared(name, &names.declared))),
                })
            }
        }

        deserializer.deserialize_any(Number)
    }
}

/// What to say of text in place of a number that names no parameter.
fn undeclared(name: &str, declared: &[String]) -> String {
    if name.parse::<f64>().is_ok() {
        return format!("numbers stand without quotes; found \"{name}\"");
    }
    if !is_name(name) {
        return format!("must be a number or the name of a parameter; found {name:?}");
    }
    let add = format!("parameter `{name}` is not declared: add a table [parameters.{}]", as_key(name));
    if declared.is_empty() { add } else { format!("{add}, or use one of {}", quoted(declared)) }
}

/// Whether parameters may have this name: letters, digits, `_`, `-` and `.`.
pub fn is_name(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || "_-.".contains(c))
}

/// A name as files write it in keys: quoted where it must be.
pub(crate) fn as_key(name: &str) -> Cow<'_, str> {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
    if bare { name.into() } else { format!("{name:?}").into() }
}

impl schemars::JsonSchema for Value {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Value".into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "A number, or the name of a parameter declared under [parameters]",
            "anyOf": [{ "type": "number" }, { "type": "string", "minLength": 1 }]
        })
    }
}

/// One number, or a list of them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OneOrMore(pub Vec<Value>);

impl<'de> Deserialize<'de> for OneOrMore {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Numbers;

        impl<'de> Visitor<'de> for Numbers {
            type Value = OneOrMore;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a number, the name of a parameter, or a list of them")
            }
            fn visit_f64<E: de::Error>(self, number: f64) -> Result<OneOrMore, E> {
                Value::deserialize(de::value::F64Deserializer::new(number)).map(|value| OneOrMore(vec![value]))
            }
            fn visit_i64<E: de::Error>(self, number: i64) -> Result<OneOrMore, E> {
                self.visit_f64(number as f64)
            }
            fn visit_u64<E: de::Error>(self, number: u64) -> Result<OneOrMore, E> {
                self.visit_f64(number as f64)
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<OneOrMore, E> {
                Value::deserialize(de::value::StrDeserializer::new(name)).map(|value| OneOrMore(vec![value]))
            }
            fn visit_seq<A: de::SeqAccess<'de>>(self, list: A) -> Result<OneOrMore, A::Error> {
                Vec::deserialize(de::value::SeqAccessDeserializer::new(list)).map(OneOrMore)
            }
        }

        deserializer.deserialize_any(Numbers)
    }
}

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
