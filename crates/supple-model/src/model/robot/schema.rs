use schemars::SchemaGenerator;
use serde_json::{Value as Json, json};

use crate::document::{one_of, plain};
use crate::model::Kinds;
use crate::quantity::sensor_schemas;

/// Adds the lists of compliance and sensors to the schema of a robot's table.
pub(super) fn complete(schema: &mut Json, generator: &mut SchemaGenerator, kinds: &Kinds) {
    let mut elements = one_of(plain(kinds.couplings.schemas(generator)));
    if let Some(tables) = elements["oneOf"].as_array_mut() {
        for table in tables {
            let name = json!({ "type": "string", "minLength": 1, "description": "Unique name" });
            table["properties"]["name"] = name;
            if let Some(required) = table["required"].as_array_mut() {
                required.push(json!("name"));
            }
        }
    }
    let sensors = one_of(plain(sensor_schemas(&kinds.quantities, generator)));
    schema["properties"]["compliance"] =
        json!({ "description": "Springs, dampers and contacts", "type": "array", "items": elements });
    schema["properties"]["sensors"] = json!({
        "description": "Sensors; required unless the task has a catalogue of sensors",
        "type": "array", "minItems": 1, "items": sensors
    });
}
