//! The keys that specify noise in tables.

use super::Reader;
use crate::Value;
use crate::parameters::Parameters;

/// Key of a standard deviation, which may be given instead of a variance.
pub const DEVIATION: &str = "deviation";

/// The key that gives the noise of a table, `variance` or `deviation`, and the table with that key read as `variance`.
///
/// # Errors
/// If both are given; the message advises what to remove.
pub fn with_noise_key<'a>(table: Reader<'a>) -> Result<(&'static str, Reader<'a>), &'static str> {
    match (table.has(DEVIATION), table.has("variance")) {
        (true, true) => Err("replaces `variance`; give only one of them"),
        (true, false) => Ok((DEVIATION, table.renamed(DEVIATION, "variance"))),
        (false, _) => Ok(("variance", table)),
    }
}

/// The variances given under a key, each above 0.
///
/// # Errors
/// If one is not; the message states what was found.
pub fn variances(key: &str, given: Vec<Value>, parameters: &Parameters) -> Result<Vec<Value>, String> {
    let one = |value: Value| match parameters.least(value).filter(|&least| least <= 0.0) {
        Some(least) => Err(value.found(least)),
        None if key == DEVIATION => Ok(value.squared()),
        None => Ok(value),
    };
    given.into_iter().map(one).collect()
}
