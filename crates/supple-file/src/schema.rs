use schemars::SchemaGenerator;
use serde_json::{Value as Json, json};
use supple::settings::{DesignSettings, PlanSettings};
use supple_model::cost;
use supple_model::document::{one_of, plain};
use supple_model::model::Kinds;

use crate::candidates::{self, CatalogueFile};
use crate::followed;
use crate::parameters::ParameterFile;
use crate::tasks::TaskFile;

/// The JSON schema of task files that name the kinds of the library.
///
/// ```
/// let schema = supple_file::json_schema();
/// assert_eq!(schema["title"], "supple task file");
/// assert_eq!(schema["required"][0], "model");
/// ```
#[must_use]
pub fn json_schema() -> Json {
    json_schema_of(&Kinds::default())
}

/// The JSON schema of task files that name these kinds.
///
/// ```
/// use supple_file::{json_schema, json_schema_of};
/// use supple_model::model::Kinds;
///
/// assert_eq!(json_schema_of(&Kinds::default()), json_schema());
/// ```
#[must_use]
pub fn json_schema_of(kinds: &Kinds) -> Json {
    let mut generator = SchemaGenerator::default();
    let models = one_of(kinds.model_schemas(&mut generator));
    let costs = one_of(plain(cost::schemas(&kinds.quantities, &kinds.norms, &mut generator)));
    let parameter = generator.subschema_for::<ParameterFile>();
    let planning = generator.subschema_for::<PlanSettings>();
    let design = generator.subschema_for::<DesignSettings>();
    let catalogue = catalogue(kinds, &mut generator);
    let _ = generator.subschema_for::<TaskFile>();
    let limits = one_of(plain(followed::schemas(&kinds.quantities, &mut generator, true)));
    let curves = one_of(plain(followed::schemas(&kinds.quantities, &mut generator, false)));
    let mut definitions = generator.take_definitions(true);
    if let Some(task) = definitions.get_mut("TaskFile") {
        task["properties"]["costs"] = json!({
            "description": "What it costs",
            "type": "array",
            "minItems": 1,
            "items": costs
        });
        for (key, items, what) in [
            ("limits", limits, "Limits of quantities, reported where plans exceed them"),
            ("curves", curves, "Quantities to show over time"),
        ] {
            task["properties"][key] = json!({ "description": what, "type": "array", "items": items });
        }
        if let Some(required) = task["required"].as_array_mut().filter(|list| !list.contains(&json!("costs"))) {
            required.push(json!("costs"));
        }
    }
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "supple task file",
        "type": "object",
        "additionalProperties": false,
        "required": ["model", "tasks"],
        "properties": {
            "title": { "type": "string", "description": "Human-readable title" },
            "model": models,
            "parameters": {
                "description": "Named numbers that designs and studies may change",
                "type": "object",
                "additionalProperties": parameter
            },
            "tasks": { "type": "array", "minItems": 1, "items": { "$ref": "#/$defs/TaskFile" } },
            "catalogue": catalogue,
            "planning": planning,
            "design": design
        },
        "$defs": definitions
    })
}

/// Of `[catalogue]`.
fn catalogue(kinds: &Kinds, generator: &mut SchemaGenerator) -> Json {
    let mut schema = <CatalogueFile as schemars::JsonSchema>::json_schema(generator).to_value();
    let mut sensors = one_of(plain(candidates::schemas(&kinds.quantities, generator)));
    for table in sensors["oneOf"].as_array_mut().into_iter().flatten() {
        table["properties"]["name"] = json!({ "type": "string", "minLength": 1, "description": "Unique name" });
        table["properties"]["price"] = json!({
            "type": "number", "minimum": 0, "default": 0, "description": "Its price, in the units of budgets"
        });
        if let Some(required) = table["required"].as_array_mut() {
            required.push(json!("name"));
        }
    }
    schema["properties"]["sensors"] = json!({
        "description": "The sensors: a list of tables, each with a `kind`, or the name of a file with one line for each",
        "anyOf": [{ "type": "string", "minLength": 1 }, { "type": "array", "minItems": 1, "items": sensors }]
    });
    schema["required"] = json!(["sensors"]);
    schema
}
