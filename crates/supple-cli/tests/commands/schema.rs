use serde_json::Value;

use crate::common::{Folder, LINEAR, TWO_MASS, edited, repository};

/// What in a value is not as a schema says. Knows the keywords that the published schema uses, and no others.
fn violations(schema: &Value, value: &Value, root: &Value, path: &str) -> Vec<String> {
    let Some(keywords) = schema.as_object() else { return Vec::new() };
    let each = |schema: &Value, value: &Value, at: String| violations(schema, value, root, &at);
    let fits = |schema: &&Value| violations(schema, value, root, path).is_empty();
    let wrong = |what: String| vec![format!("{path}: {what}")];
    let broken = |holds: bool, what: String| if holds { Vec::new() } else { wrong(what) };
    let list = value.as_array().map(Vec::as_slice).unwrap_or_default();
    let empty = serde_json::Map::new();
    let table = value.as_object().unwrap_or(&empty);
    let check = |(keyword, argument): (&String, &Value)| match keyword.as_str() {
        "$schema" | "$defs" | "title" | "description" | "default" | "format" => Vec::new(),
        "$ref" => each(root.pointer(&argument.as_str().unwrap()[1..]).unwrap(), value, path.to_owned()),
        "anyOf" => broken(argument.as_array().unwrap().iter().any(|schema| fits(&schema)), "fits none".into()),
        "oneOf" => {
            let count = argument.as_array().unwrap().iter().filter(fits).count();
            broken(count == 1, format!("fits {count} and not one"))
        }
        "enum" => broken(argument.as_array().unwrap().contains(value), format!("is none of {argument}")),
        "const" => broken(value == argument, format!("is not {argument}")),
        "type" => {
            let name = match value {
                Value::Number(number) if number.is_f64() => &["number"][..],
                Value::Number(_) => &["number", "integer"],
                Value::String(_) => &["string"],
                Value::Bool(_) => &["boolean"],
                Value::Array(_) => &["array"],
                Value::Object(_) => &["object"],
                Value::Null => &["null"],
            };
            let fits = |argument: &Value| name.contains(&argument.as_str().unwrap());
            broken(
                argument.as_array().map_or_else(|| fits(argument), |list| list.iter().any(fits)),
                format!("is no {argument}"),
            )
        }
        "minimum" => broken(value.as_f64().is_none_or(|number| number >= argument.as_f64().unwrap()), "too low".into()),
        "maximum" => {
            broken(value.as_f64().is_none_or(|number| number <= argument.as_f64().unwrap()), "too high".into())
        }
        "minLength" => {
            broken(value.as_str().is_none_or(|text| text.len() as u64 >= argument.as_u64().unwrap()), "short".into())
        }
        "minItems" => broken(!value.is_array() || list.len() as u64 >= argument.as_u64().unwrap(), "too few".into()),
        "maxItems" => broken(!value.is_array() || list.len() as u64 <= argument.as_u64().unwrap(), "too many".into()),
        "items" => {
            list.iter().enumerate().flat_map(|(i, value)| each(argument, value, format!("{path}[{i}]"))).collect()
        }
        "required" => {
            let missing = |key: &&Value| value.is_object() && !table.contains_key(key.as_str().unwrap());
            argument
                .as_array()
                .unwrap()
                .iter()
                .filter(missing)
                .flat_map(|key| wrong(format!("{key} is missing")))
                .collect()
        }
        "properties" => {
            let known =
                table.iter().filter_map(|(key, value)| Some((argument.get(key)?, value, format!("{path}.{key}"))));
            known.flat_map(|(schema, value, at)| each(schema, value, at)).collect()
        }
        "additionalProperties" => {
            let unknown = table.iter().filter(|(key, _)| schema["properties"].get(key).is_none());
            let one = |(key, value): (&String, &Value)| match argument {
                Value::Bool(false) => wrong(format!("{key} is unknown")),
                schema => each(schema, value, format!("{path}.{key}")),
            };
            unknown.flat_map(one).collect()
        }
        other => panic!("the keyword `{other}` of the schema is not known here"),
    };
    keywords.iter().flat_map(check).collect()
}

#[test]
fn the_schema_accepts_good_files_and_refuses_bad_ones() {
    let schema = Folder::new().run(&["schema"]).json(0);
    let violations = |text: &str| violations(&schema, &toml::from_str(text).unwrap(), &schema, "");
    let shipped = std::fs::read_dir(repository("tasks")).unwrap().map(|entry| entry.unwrap().path());
    let mut shipped: Vec<_> = shipped.filter(|path| path.extension().is_some_and(|end| end == "toml")).collect();
    shipped.push(repository("crates/supple-cli/templates/new.toml"));
    assert!(shipped.len() >= 3);
    for path in shipped {
        assert_eq!(violations(&std::fs::read_to_string(&path).unwrap()), [""; 0], "{}", path.display());
    }
    assert_eq!(violations(LINEAR), [""; 0]);
    let settings = "planning = { plan = \"sampled\", sampled = { iterations = 5, averaging = 0.5 }, newton = false }\n\
                    design = { method = \"barrier\", gradient = \"frozen\", starts = 3, seed = 1 }\n";
    assert_eq!(violations(&format!("{settings}{TWO_MASS}")), [""; 0]);
    let edits = [
        (TWO_MASS, "title =", "tittle ="),
        (TWO_MASS, "steps = 125", "steps = 0"),
        (TWO_MASS, "steps = 125", "steps = 1_000_001"),
        (TWO_MASS, "steps = 125", "steps = 12.5"),
        (TWO_MASS, "mass = [0.2, 0.11]", "mass = [0.2, 0.11, 0.3]"),
        (TWO_MASS, "mass = [0.2, 0.11]", ""),
        (TWO_MASS, "kind = \"two_mass\"", "kind = \"three_mass\""),
        (TWO_MASS, "scale = \"log\"", "scale = \"logarithmic\""),
        (TWO_MASS, "initial = 60.0", "initial = \"k2\""),
        (TWO_MASS, "time_step = 0.02", "time_step = \"\""),
        (TWO_MASS, "target = 3.0", "targets = 3.0"),
        (TWO_MASS, "measurement = [5e-3, 5e-2]", "measurement = [5e-3, [5e-2]]"),
        (LINEAR, "norm = \"quadratic\"", "norm = \"absolute\""),
        (LINEAR, "R = [[\"gain\"]]", "R = [\"gain\"]"),
    ];
    for (text, from, to) in edits {
        let bad = edited(text, from, to);
        assert!(!violations(&bad).is_empty(), "the schema accepts {to}");
        Folder::with_task(bad).run(&["evaluate", "task.toml"]).error();
    }
}
