//! The price of a parameter: what a better sensor, a stiffer gear or a lighter link costs.

use serde::{Deserialize, Serialize};
use supple_kernels::math;
use supple_text::digits;

/// The price of a parameter's value `phi`, in the units of budgets (theory, equation N.9).
///
/// Example: the [module](crate::parameters).
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(
    feature = "schema",
    schemars(description = "The price of a parameter's value `phi`, in the units of budgets (theory, equation N.9).")
)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Price {
    /// `c / phi`: if `phi` is a variance, the price of averaging several identical sensors.
    Inverse(f64),
    /// `c phi`
    Linear(f64),
    /// `c ln(reference / phi)`: the same for every halving; 0 at the reference, which `phi` may not exceed.
    Log {
        /// `c`, the price of a reduction by the factor e.
        coefficient: f64,
        /// The value that has no price.
        reference: f64,
    },
    /// `c (phi / reference)^exponent`
    Power {
        /// `c`, the price at the reference.
        coefficient: f64,
        /// The exponent; negative where small values are expensive.
        exponent: f64,
        /// The value at which the price is `c`; above 0.
        reference: f64,
    },
}

/// What is wrong with the price of a parameter.
///
/// ```
/// use supple_model::parameters::{Price, PriceError};
///
/// let wrong = Price::Inverse(1.0).check([0.0, 2.0]);
/// assert_eq!(wrong, Err(PriceError::LowerBound { lower: 0.0 }));
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PriceError {
    /// One of its numbers is not finite.
    #[error("must consist of finite numbers; found {}", digits(*found))]
    NotFinite {
        /// The number.
        found: f64,
    },
    /// The parameter can be 0 or less, where the price has no value.
    #[error("requires a parameter above 0 (except `linear`); its lower bound is {}", digits(*lower))]
    LowerBound {
        /// The lower bound of the parameter.
        lower: f64,
    },
    /// The reference is not above 0.
    #[error("needs a reference above 0; found {}", digits(*found))]
    Reference {
        /// The reference.
        found: f64,
    },
    /// The price is infinite at a bound.
    #[error("is not finite within the bounds [{lower}, {upper}]")]
    Infinite {
        /// The lower bound of the parameter.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// The price is negative at a bound.
    #[error("must be at least 0 within the bounds [{lower}, {upper}]; it can be {least}")]
    Negative {
        /// The lower bound of the parameter.
        lower: f64,
        /// Its upper bound.
        upper: f64,
        /// The least price.
        least: f64,
    },
}

impl Price {
    /// The price of a value.
    #[must_use]
    pub fn at(self, phi: f64) -> f64 {
        match self {
            Self::Inverse(c) => c / phi,
            Self::Linear(c) => c * phi,
            Self::Log { coefficient, reference } => coefficient * math::ln(reference / phi),
            Self::Power { coefficient, exponent, reference } => coefficient * math::powf(phi / reference, exponent),
        }
    }

    /// The derivative of the price with respect to the value.
    #[must_use]
    pub fn slope(self, phi: f64) -> f64 {
        match self {
            Self::Inverse(c) => -c / (phi * phi),
            Self::Linear(c) => c,
            Self::Log { coefficient, .. } => -coefficient / phi,
            Self::Power { coefficient, exponent, reference } => {
                coefficient * exponent / reference * math::powf(phi / reference, exponent - 1.0)
            }
        }
    }

    /// Checks its numbers, given the least and greatest value of the parameter.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(self, [lower, upper]: [f64; 2]) -> Result<(), PriceError> {
        let numbers = match self {
            Self::Inverse(c) | Self::Linear(c) => vec![c],
            Self::Log { coefficient, reference } => vec![coefficient, reference],
            Self::Power { coefficient, exponent, reference } => vec![coefficient, exponent, reference],
        };
        if let Some(number) = numbers.iter().find(|number| !number.is_finite()) {
            return Err(PriceError::NotFinite { found: *number });
        }
        if !matches!(self, Self::Linear(_)) && lower <= 0.0 {
            return Err(PriceError::LowerBound { lower });
        }
        if let Self::Log { reference, .. } | Self::Power { reference, .. } = self
            && reference <= 0.0
        {
            return Err(PriceError::Reference { found: reference });
        }
        // All forms are monotonic.
        let least = self.at(lower).min(self.at(upper));
        if !self.at(lower).max(self.at(upper)).is_finite() {
            return Err(PriceError::Infinite { lower, upper });
        }
        if least < 0.0 {
            return Err(PriceError::Negative { lower, upper, least });
        }
        Ok(())
    }
}
