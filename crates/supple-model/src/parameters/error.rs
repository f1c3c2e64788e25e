use supple_text::digits;

/// An error about the parameters of a problem.
///
/// Example: the [module](crate::parameters).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// A name that no parameter has.
    #[error("no parameter `{name}`; valid: {valid}")]
    Unknown {
        /// The name that was given.
        name: String,
        /// The valid names, in quotes, or `none`.
        valid: String,
    },
    /// A handle of a parameter that was declared elsewhere.
    #[error("this parameter was declared as number {number} of another problem; this one has {count}")]
    Foreign {
        /// Its number there, counted from 1.
        number: usize,
        /// How many parameters there are.
        count: usize,
    },
    /// A value outside the bounds, or not finite.
    #[error("parameter `{name}` = {} is outside [{}, {}]", digits(*value), digits(*lower), digits(*upper))]
    OutOfBounds {
        /// The parameter.
        name: String,
        /// The value given.
        value: f64,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
}
