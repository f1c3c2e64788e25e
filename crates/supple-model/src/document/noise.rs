//! The keys by which tables give noise.

use super::Reader;
use crate::Value;
use crate::parameters::Parameters;

/// Key of a standard deviation, which may stand in the place of a variance.
pub const DEVIATION: &str = "deviation";

/// The key by which a table gives noise, `variance` or else `deviation`, and the table with `variance` in its place.
///
/// # Errors
/// Where it has both: what to do.
pub fn with_noise_key<'a>(table: Reader<'a>) -> Result<(&'static str, Reader<'a>), &'static str> {
    match (table.has(DEVIATION), table.has("variance")) {
        (true, true) => Err("replaces `variance`; give only one of them"),
        (true, false) => Ok((DEVIATION, table.renamed(DEVIATION, "variance"))),
        (false, _) => Ok(("variance", table)),
    }
}

/// The variances that a key gives, each above 0.
///
/// # Errors
/// Where one is not: what was found.
pub fn variances(key: &str, given: Vec<Value>, parameters: &Parameters) -> Result<Vec<Value>, String> {
    let one = |value: Value| match parameters.least(value).filter(|&least| least <= 0.0) {
        Some(least) => Err(value.found(least)),
        None if key == DEVIATION => Ok(value.squared()),
        None => Ok(value),
    };
    given.into_iter().map(one).collect()
}
