//! Schemas of tables that differ by their `kind`.

use serde_json::{Value as Json, json};

use super::Reader;
use crate::Value;
use crate::parameters::Parameters;

/// One of several tables, told apart by `kind`.
#[must_use]
pub fn one_of(kinds: Vec<(&'static str, Json)>) -> Json {
    let tables = kinds.into_iter().map(|(kind, mut table)| {
        table["properties"]["kind"] = json!({ "const": kind });
        match table["required"].as_array_mut() {
            Some(required) => required.insert(0, json!("kind")),
            None => table["required"] = json!(["kind"]),
        }
        table
    });
    json!({ "oneOf": tables.collect::<Vec<_>>() })
}

/// Schemas as JSON.
#[must_use]
pub fn plain(kinds: Vec<(&'static str, schemars::Schema)>) -> Vec<(&'static str, Json)> {
    kinds.into_iter().map(|(kind, schema)| (kind, schema.to_value())).collect()
}

/// The schema of a table that has the keys of two.
#[must_use]
pub fn merged(mut own: schemars::Schema, common: &schemars::Schema) -> schemars::Schema {
    let object = own.ensure_object();
    let list = |key: &str| common.get(key).cloned().unwrap_or_default();
    let properties = object.entry("properties").or_insert_with(|| json!({}));
    if let (Some(properties), Json::Object(more)) = (properties.as_object_mut(), list("properties")) {
        properties.extend(more);
    }
    let required = object.entry("required").or_insert_with(|| json!([]));
    if let (Some(required), Json::Array(more)) = (required.as_array_mut(), list("required")) {
        required.extend(more);
    }
    own
}

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

/// Offers a standard deviation in the place of the variance of a table.
pub fn with_deviation(mut schema: schemars::Schema) -> schemars::Schema {
    let object = schema.ensure_object();
    if let Some(properties) = object.get_mut("properties").and_then(Json::as_object_mut)
        && let Some(mut deviation) = properties.get("variance").cloned()
    {
        deviation["description"] =
            json!("Standard deviation of the noise, in the unit of the measured quantity; replaces `variance`");
        properties.insert(DEVIATION.to_owned(), deviation);
        if let Some(required) = object.get_mut("required").and_then(Json::as_array_mut) {
            required.retain(|key| key != "variance");
        }
        object.insert("oneOf".to_owned(), json!([{ "required": ["variance"] }, { "required": [DEVIATION] }]));
    }
    schema
}
