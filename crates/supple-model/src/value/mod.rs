//! Numbers of a problem: written out, parameters, and expressions of parameters.

use std::borrow::Cow;

mod error;
mod expression;
mod handle;
mod names;
mod parse;
mod range;
mod read;
mod symmetric;

pub use error::ValueError;
pub use expression::Expression;
use expression::{Operator, Tree};
pub use handle::ParameterHandle;
pub use names::Names;
pub use read::{OneOrList, OneOrMore, VALUE};
pub use symmetric::{Asymmetry, symmetrise};

use supple_kernels::Scalar;
use supple_text::digits;

/// A number of the problem: written out, the name of a declared parameter, or an expression of parameters.
///
/// Anything numeric in a task file is a `Value`, so that stiffnesses, noise variances and weights can all be designed.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// The number itself.
    Number(f64),
    /// One of [`Parameters`](crate::parameters::Parameters).
    Parameter(ParameterHandle),
    /// An expression of parameters.
    Expression(Expression),
}

impl Value {
    /// The value as a scalar, given all parameters as scalars.
    pub fn resolve<S: Scalar>(&self, phi: &[S]) -> S {
        match self {
            Self::Number(number) => S::constant(*number),
            Self::Parameter(parameter) => phi[parameter.index()],
            Self::Expression(expression) => expression.resolve(phi),
        }
    }

    /// The derivative by each parameter that it depends on: the parameter, and the slope at `phi`.
    #[must_use]
    pub fn slopes(&self, phi: &[f64]) -> Vec<(ParameterHandle, f64)> {
        match self {
            Self::Number(_) => Vec::new(),
            Self::Parameter(parameter) => vec![(*parameter, 1.0)],
            Self::Expression(expression) => expression.slopes(phi),
        }
    }

    /// Adds its gradient by all parameters, times a weight, to `out`.
    pub fn add_gradient(&self, phi: &[f64], weight: f64, out: &mut [f64]) {
        match self {
            Self::Number(_) => {}
            Self::Parameter(parameter) => out[*parameter] += weight,
            Self::Expression(_) => {
                self.slopes(phi).into_iter().for_each(|(parameter, slope)| out[parameter] += weight * slope);
            }
        }
    }

    /// This times another value.
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::Number(a), Self::Number(b)) => Self::Number(a * b),
            (Self::Number(0.0), _) | (_, Self::Number(0.0)) => Self::Number(0.0),
            _ => self.with(Operator::Multiply, other),
        }
    }

    /// The sum with another value.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::Number(a), Self::Number(b)) => Self::Number(a + b),
            (Self::Number(0.0), other) => other.clone(),
            (_, Self::Number(0.0)) => self.clone(),
            _ => self.with(Operator::Add, other),
        }
    }

    /// This divided by another value.
    #[must_use]
    pub fn over(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::Number(a), Self::Number(b)) => Self::Number(a / b),
            (Self::Number(0.0), _) => self.clone(),
            _ => self.with(Operator::Divide, other),
        }
    }

    /// Its square.
    #[must_use]
    pub fn squared(&self) -> Self {
        match self {
            Self::Number(number) => Self::Number(number * number),
            _ => self.with(Operator::Power, &Self::Number(2.0)),
        }
    }

    fn with(&self, operator: Operator, other: &Self) -> Self {
        Self::Expression(Expression::new(Tree::Binary(operator, Box::new([self.tree(), other.tree()]))))
    }

    fn tree(&self) -> Tree {
        match self {
            Self::Number(number) => Tree::Number(*number),
            Self::Parameter(parameter) => Tree::Parameter(parameter.index()),
            Self::Expression(expression) => expression.tree().clone(),
        }
    }

    /// Message for a value that can be as low as `least`, if that is too low.
    #[must_use]
    pub fn found(&self, least: f64) -> String {
        if !least.is_finite() && matches!(self, Self::Expression(_)) {
            return "within the bounds of its parameters it may be infinite or undefined".to_owned();
        }
        let least = digits(least);
        match self {
            Self::Number(_) => format!("found {least}"),
            Self::Parameter(_) => format!("its parameter can be as low as {least}"),
            Self::Expression(_) => format!("within the bounds of its parameters it can be {least}"),
        }
    }

    /// Whether this is a number, and zero: a term that can be left out.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        *self == Self::Number(0.0)
    }
}

impl From<ParameterHandle> for Value {
    fn from(parameter: ParameterHandle) -> Self {
        Self::Parameter(parameter)
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

/// Whether parameters may have this name: letters, digits, `_`, `-` and `.`.
///
/// ```
/// use supple_model::is_name;
///
/// assert!(is_name("elbow.stiffness") && !is_name("2 * k"));
/// ```
#[must_use]
pub fn is_name(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || "_-.".contains(c))
}

/// A name as written in keys of files, quoted if necessary.
///
/// ```
/// use supple_model::value::as_key;
///
/// assert_eq!(&*as_key("mass"), "mass");
/// assert_eq!(&*as_key("tool mass"), r#""tool mass""#);
/// ```
#[must_use]
pub fn as_key(name: &str) -> Cow<'_, str> {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
    if bare { name.into() } else { format!("{name:?}").into() }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Value {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Value".into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "A number, the name of a parameter declared under [parameters], or an expression of such names",
            "anyOf": [{ "type": "number" }, { "type": "string", "minLength": 1 }]
        })
    }
}
