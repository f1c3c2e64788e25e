use supple_text::quoted;

use super::expression::Function;
use super::{Value, as_key};

/// Limits on the length of an expression, and on its open parentheses.
pub(super) const MOST_CHARACTERS: usize = 500;
pub(super) const MOST_OPEN: usize = 50;

/// What is wrong with a value of a problem.
///
/// ```
/// use supple_model::Names;
/// use supple_model::value::ValueError;
///
/// let names = Names::new(vec!["mass".to_owned()]);
/// let wrong = names.value("2 * length").err();
/// assert!(matches!(&wrong, Some(ValueError::Undeclared { name, .. }) if name == "length"));
/// let message = wrong.map(|wrong| wrong.to_string()).unwrap_or_default();
/// assert!(message.starts_with("parameter `length` is not declared"));
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ValueError {
    /// Nothing but spaces.
    #[error("must be a number, the name of a parameter or an expression of parameters; found {text:?}")]
    Empty {
        /// The text.
        text: String,
    },
    /// A number in quotes.
    #[error("write numbers without quotes; found \"{text}\"")]
    Quoted {
        /// The text.
        text: String,
    },
    /// A name that no parameter has.
    #[error("{}", undeclared(name, declared))]
    Undeclared {
        /// The name.
        name: String,
        /// The names of all parameters.
        declared: Vec<String>,
    },
    /// An expression that is too long.
    #[error(
        "an expression has at most {MOST_CHARACTERS} characters and {MOST_OPEN} parentheses; found {characters} and \
         {parentheses}"
    )]
    TooLong {
        /// How many characters it has.
        characters: usize,
        /// How many opening parentheses it has.
        parentheses: usize,
    },
    /// Parentheses that do not match.
    #[error("is not a valid expression: {opening} opening and {closing} closing parentheses")]
    Parentheses {
        /// How many open.
        opening: usize,
        /// How many close.
        closing: usize,
    },
    /// Text that no expression has at this place.
    #[error("is not a valid expression: unexpected {} {}", found(after), place(before))]
    Unexpected {
        /// The text before that place.
        before: String,
        /// The text from there on.
        after: String,
    },
    /// A function that there is not.
    #[error("unknown function `{name}`; valid: {}", quoted(&Function::ALL.map(|(name, _)| name)))]
    UnknownFunction {
        /// Its name.
        name: String,
    },
    /// An expression without parameters whose number is not finite.
    #[error("is {found}, not a finite number")]
    NotANumber {
        /// Its number.
        found: f64,
    },
    /// A number that is not finite.
    #[error("must be finite; found {found}")]
    NotFinite {
        /// The number.
        found: f64,
    },
    /// An expression that is not finite at the initial values of the parameters.
    #[error("must be finite; at the initial values of the parameters `{text}` is {found}")]
    NotFiniteAtFirst {
        /// The expression.
        text: String,
        /// Its number.
        found: f64,
    },
    /// A parameter of another problem.
    #[error("uses a parameter that the problem does not have")]
    ForeignParameter,
    /// A variance or standard deviation that can be 0 or less.
    #[error("{}", value.found(*least))]
    NotPositive {
        /// The value.
        value: Value,
        /// The least it can be.
        least: f64,
    },
    /// A list of another length than there are entries.
    #[error("must be one number, or {expected} of them, one for each entry; found {found}")]
    Count {
        /// How many entries there are.
        expected: usize,
        /// The length of the list.
        found: usize,
    },
}

fn undeclared(name: &str, declared: &[String]) -> String {
    let add = format!("parameter `{name}` is not declared: add a table [parameters.{}]", as_key(name));
    if declared.is_empty() { add } else { format!("{add}, or use one of {}", quoted(declared)) }
}

fn found(after: &str) -> String {
    if after.is_empty() { "end".to_owned() } else { format!("`{after}`") }
}

fn place(before: &str) -> String {
    if before.is_empty() { "at the beginning".to_owned() } else { format!("after `{before}`") }
}
