//! Lists of numbers as JSON has them: `null`, which stands for all that is not finite, is NaN.

use serde::{Deserialize, Deserializer};

/// Reads so many numbers.
pub fn array<'de, D, const N: usize>(deserializer: D) -> Result<[f64; N], D::Error>
where
    D: Deserializer<'de>,
    [Option<f64>; N]: Deserialize<'de>,
{
    Ok(<[Option<f64>; N]>::deserialize(deserializer)?.map(|number| number.unwrap_or(f64::NAN)))
}

/// Reads any count of numbers.
pub fn list<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let list = Vec::<Option<f64>>::deserialize(deserializer)?;
    Ok(list.into_iter().map(|number| number.unwrap_or(f64::NAN)).collect())
}
