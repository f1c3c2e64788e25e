//! The keys that specify noise in tables.

use crate::document::Reader;
use crate::parameters::Parameters;
use crate::{Value, ValueError};

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
/// use supple_model::document::{Content, Reader, Spanned, Table};
/// use supple_model::noise::{DEVIATION, with_noise_key};
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
/// If one is not.
///
/// ```
/// use supple_model::Value;
/// use supple_model::noise::{DEVIATION, variances};
/// use supple_model::parameters::Parameters;
///
/// let found = variances(DEVIATION, vec![Value::Number(0.5)], &Parameters::default());
/// assert_eq!(found, Ok(vec![Value::Number(0.25)]));
/// assert!(variances("variance", vec![Value::Number(-1.0)], &Parameters::default()).is_err());
/// ```
pub fn variances(key: &str, given: Vec<Value>, parameters: &Parameters) -> Result<Vec<Value>, ValueError> {
    let one = |value: Value| match parameters.least(&value).filter(|&least| least <= 0.0) {
        Some(least) => Err(ValueError::NotPositive { value, least }),
        None if key == DEVIATION => Ok(value.squared()),
        None => Ok(value),
    };
    given.into_iter().map(one).collect()
}

/// Allows a standard deviation instead of the variance in a table.
///
/// ```
/// use schemars::json_schema;
/// use supple_model::document::plain;
/// use supple_model::noise::with_deviation;
///
/// let sensor = json_schema!({ "properties": { "variance": { "type": "number" } }, "required": ["variance"] });
/// let schemas = plain(vec![("state", with_deviation(sensor))]);
/// assert_eq!(schemas[0].1["properties"]["deviation"]["type"], "number");
/// ```
#[cfg(feature = "schema")]
#[must_use]
pub fn with_deviation(mut schema: schemars::Schema) -> schemars::Schema {
    let object = schema.ensure_object();
    if let Some(properties) = object.get_mut("properties").and_then(serde_json::Value::as_object_mut)
        && let Some(mut deviation) = properties.get("variance").cloned()
    {
        deviation["description"] = serde_json::json!(
            "Standard deviation of the noise, in the unit of the measured quantity; replaces `variance`"
        );
        properties.insert(DEVIATION.to_owned(), deviation);
        if let Some(required) = object.get_mut("required").and_then(serde_json::Value::as_array_mut) {
            required.retain(|key| key != "variance");
        }
        object
            .insert("oneOf".to_owned(), serde_json::json!([{ "required": ["variance"] }, { "required": [DEVIATION] }]));
    }
    schema
}
