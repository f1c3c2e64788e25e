//! What the schema of task files offers, and which of it examples use.

use serde_json::Value as Json;
use toml::Value as Toml;

/// The tables that the schema offers at a place, by kind.
pub fn offered(place: &Json) -> Vec<(String, Json)> {
    let tables = place["oneOf"].as_array().unwrap();
    let kind = |table: &Json| table["properties"]["kind"]["const"].as_str().unwrap().to_owned();
    tables.iter().map(|table| (kind(table), table.clone())).collect()
}

/// The schema of a kind of model.
pub fn model(schema: &Json, kind: &str) -> Json {
    offered(&schema["properties"]["model"]).into_iter().find(|(name, _)| name == kind).unwrap().1
}

/// Keys that may hold a parameter by their schema, but hold one in none of the given values.
pub struct Unused<'a> {
    definitions: &'a Json,
    /// Names of parameters.
    pub keys: Vec<String>,
}

/// The keys of a table's schema in which none of `tables` has one of its file's parameters.
pub fn without_parameter(schema: &Json, table: &Json, tables: &[(&Toml, &[String])]) -> Vec<String> {
    let mut unused = Unused { definitions: &schema["$defs"], keys: Vec::new() };
    unused.walk(table, tables, "");
    unused.keys
}

impl Unused<'_> {
    fn walk(&mut self, schema: &Json, values: &[(&Toml, &[String])], path: &str) {
        if let Some(reference) = schema["$ref"].as_str() {
            let name = reference.rsplit('/').next().unwrap();
            if ["Value", "OneOrMore", "Numbers", "Guess", "InitialState"].contains(&name) {
                if !values.iter().any(|(value, names)| holds(value, names)) {
                    self.keys.push(path.to_owned());
                }
            } else {
                let definitions = self.definitions;
                self.walk(&definitions[name], values, path);
            }
        }
        for choice in ["anyOf", "oneOf", "allOf"] {
            for schema in schema[choice].as_array().into_iter().flatten() {
                self.walk(schema, values, path);
            }
        }
        // Standard deviations are variances in other words, and have tests of their own.
        let properties = schema["properties"].as_object().into_iter().flatten();
        for (key, schema) in properties.filter(|(key, _)| !key.ends_with("deviation")) {
            let under: Vec<_> =
                values.iter().filter_map(|(value, names)| Some((value.as_table()?.get(key)?, *names))).collect();
            self.walk(schema, &under, &format!("{path}.{key}"));
        }
        if schema["additionalProperties"].is_object() {
            let tables = values.iter().filter_map(|(value, names)| Some((value.as_table()?, *names)));
            let under: Vec<_> =
                tables.flat_map(|(table, names)| table.values().map(move |value| (value, names))).collect();
            self.walk(&schema["additionalProperties"], &under, &format!("{path}.*"));
        }
        if schema["items"].is_object() {
            let lists = values.iter().filter_map(|(value, names)| Some((value.as_array()?, *names)));
            let under: Vec<_> = lists.flat_map(|(list, names)| list.iter().map(move |value| (value, names))).collect();
            self.walk(&schema["items"], &under, path);
        }
    }
}

/// Whether a value is or has the name of a parameter.
fn holds(value: &Toml, names: &[String]) -> bool {
    match value {
        Toml::String(text) => names.contains(text),
        Toml::Array(list) => list.iter().any(|value| holds(value, names)),
        Toml::Table(table) => table.values().any(|value| holds(value, names)),
        _ => false,
    }
}
