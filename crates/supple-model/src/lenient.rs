//! Numbers as JSON represents them.

use serde::{Deserialize, Deserializer};

/// Reads a number; `null`, which stands for all non-finite numbers in JSON, becomes NaN.
///
/// # Errors
/// If it is neither a number nor `null`.
///
/// ```
/// #[derive(serde::Deserialize)]
/// struct Found {
///     #[serde(deserialize_with = "supple_model::or_nan")]
///     cost: f64,
/// }
///
/// let found: Found = serde_json::from_str(r#"{ "cost": null }"#)?;
/// assert!(found.cost.is_nan());
/// # Ok::<(), serde_json::Error>(())
/// ```
pub fn or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}
