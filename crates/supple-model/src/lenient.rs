//! Numbers as JSON represents them.

use serde::{Deserialize, Deserializer};

/// Reads a number; `null`, which stands for all non-finite numbers in JSON, becomes NaN.
///
/// # Errors
/// If it is neither a number nor `null`.
pub fn or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}
