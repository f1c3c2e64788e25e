//! The keys that specify noise in tables.

use super::Reader;
use crate::Value;
use crate::parameters::Parameters;

/// Key of a standard deviation, which may be given instead of a variance.
///
/// Example: [`variances`].
pub const DEVIATION: &str = "deviation";

/// The key that gives the noise of a table, `variance` or `deviation`, and the table with that key read as `variance`.
///
/// # Errors
/// If both are given; the message advises what to remove.
///
/// ```
/// use supple_model::document::{Content, DEVIATION, Reader, Spanned, Table, with_noise_key};
///
/// // `deviation = 0.1`
/// let (key, value) = (Spanned::new(0..9, DEVIATION.into()), Spanned::new(12..15, Content::Decimal("0.1".into())));
/// let table = Spanned::new(0..15, Content::Table(Table::from([(key, value)])));
/// let (key, table) = with_noise_key(Reader::new(&table))?;
/// assert_eq!(key, DEVIATION);
/// # Ok::<(), &'static str>(())
/// ```
pub fn with_noise_key<'a>(table: Reader<'a>) -> Result<(&'static str, Reader<'a>), &'static str> {
    match (table.has(DEVIATION), table.has("variance")) {
        (true, true) => Err("`variance` and `deviation` are both given; keep one"),
        (true, false) => Ok((DEVIATION, table.renamed(DEVIATION, "variance"))),
        (false, _) => Ok(("variance", table)),
    }
}

/// The variances given under a key, each above 0.
///
/// # Errors
/// If one is not; the message states what was found.
///
/// ```
/// use supple_model::Value;
/// use supple_model::document::{DEVIATION, variances};
/// use supple_model::parameters::Parameters;
///
/// let found = variances(DEVIATION, vec![Value::Number(0.5)], &Parameters::default());
/// assert_eq!(found, Ok(vec![Value::Number(0.25)]));
/// assert!(variances("variance", vec![Value::Number(-1.0)], &Parameters::default()).is_err());
/// ```
pub fn variances(key: &str, given: Vec<Value>, parameters: &Parameters) -> Result<Vec<Value>, String> {
    let one = |value: Value| match parameters.least(value).filter(|&least| least <= 0.0) {
        Some(least) => Err(value.found(least)),
        None if key == DEVIATION => Ok(value.squared()),
        None => Ok(value),
    };
    given.into_iter().map(one).collect()
}
