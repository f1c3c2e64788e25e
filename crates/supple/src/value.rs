use std::cell::RefCell;

use serde::de::{self, Deserialize, Deserializer, Visitor};
use supple_kernels::Scalar;

/// A number of the problem: written out, or the name of a declared parameter.
///
/// Anything numeric in a task file is a `Value`, so that stiffnesses, noise variances and weights can all be designed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// The number itself.
    Number(f64),
    /// The parameter with this index in [`Parameters`](crate::Parameters).
    Parameter(usize),
}

impl Value {
    /// The value as a scalar, given all parameters as scalars.
    #[inline(always)]
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

    /// Whether this is a number, and zero: a term that can be left out.
    #[inline(always)]
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
pub(crate) fn with_names<T>(declared: &[String], read: impl FnOnce() -> T) -> (T, Vec<bool>) {
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
                    None if names.declared.is_empty() => {
                        Err(E::custom(format!("parameter `{name}` is not declared: add a table [parameters.{name}]")))
                    }
                    None => Err(E::custom(format!(
                        "parameter `{name}` is not declared: add a table [parameters.{name}], or use one of {}",
                        quoted(&names.declared)
                    ))),
                })
            }
        }

        deserializer.deserialize_any(Number)
    }
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

/// Names in back quotes, separated by commas.
pub(crate) fn quoted<T: AsRef<str>>(names: &[T]) -> String {
    names.iter().map(|name| format!("`{}`", name.as_ref())).collect::<Vec<_>>().join(", ")
}
