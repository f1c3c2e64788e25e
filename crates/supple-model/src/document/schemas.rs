//! Schemas of tables that differ by their `kind`.

use serde_json::{Value as Json, json};

/// One of several tables, distinguished by `kind`.
///
/// ```
/// use serde_json::json;
/// use supple_model::document::one_of;
///
/// let sphere = json!({ "type": "object", "properties": { "radius": { "type": "number" } }, "required": ["radius"] });
/// let schema = one_of(vec![("sphere", sphere)]);
/// assert_eq!(schema["oneOf"][0]["properties"]["kind"]["const"], "sphere");
/// ```
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
///
/// Example: [`merged`].
#[must_use]
pub fn plain(kinds: Vec<(&'static str, schemars::Schema)>) -> Vec<(&'static str, Json)> {
    kinds.into_iter().map(|(kind, schema)| (kind, schema.to_value())).collect()
}

/// The schema of a table that has the keys of both.
///
/// ```
/// use schemars::json_schema;
/// use supple_model::document::{merged, plain};
///
/// let own = json_schema!({ "properties": { "select": { "type": "string" } }, "required": ["select"] });
/// let common = json_schema!({ "properties": { "weight": { "type": "number" } }, "required": ["weight"] });
/// let schemas = plain(vec![("state", merged(own, &common))]);
/// assert_eq!(schemas[0].1["required"], serde_json::json!(["select", "weight"]));
/// ```
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
