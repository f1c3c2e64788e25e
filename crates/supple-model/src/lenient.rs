//! Numbers as JSON has them.

use serde::{Deserialize, Deserializer};

/// Reads a number; `null`, which JSON has for all that is not finite, is NaN.
///
/// # Errors
/// Where it is neither.
pub fn or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}
