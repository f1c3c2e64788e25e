//! docs/tasks.md names every key and kind of task files, none that does not exist, and the defaults of settings; the
//! files that it shows run, and their derivatives agree with finite differences.

use std::collections::BTreeSet;

use serde_json::Value;
use supple::check::check;
use supple_file::json_schema;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../");

fn page() -> String {
    std::fs::read_to_string(format!("{ROOT}docs/tasks.md")).unwrap()
}

/// What stands between back quotes.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// Every key, and every word that a key may have as its value: kinds and choices.
fn words(schema: &Value, found: &mut BTreeSet<String>) {
    match schema {
        Value::Object(table) => {
            for (key, value) in table {
                match (key.as_str(), value) {
                    ("properties", Value::Object(properties)) => {
                        found.extend(properties.keys().cloned());
                        properties.values().for_each(|value| words(value, found));
                    }
                    ("const", Value::String(word)) => {
                        found.insert(word.clone());
                    }
                    ("enum", Value::Array(choices)) => {
                        found.extend(choices.iter().filter_map(|choice| choice.as_str().map(str::to_owned)));
                    }
                    ("default" | "required", _) => {}
                    _ => words(value, found),
                }
            }
        }
        Value::Array(list) => list.iter().for_each(|value| words(value, found)),
        _ => {}
    }
}

fn schema_words() -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    words(&json_schema(), &mut found);
    found
}

#[test]
fn every_key_and_kind_is_named() {
    let page = page();
    let text: Vec<&str> = page.split("```").step_by(2).collect();
    let named: BTreeSet<&str> = text.iter().flat_map(|text| quoted(text)).map(|word| word.trim_matches('"')).collect();
    let words = schema_words();
    assert!(words.len() > 100, "the schema has keys: {words:?}");
    let missing: Vec<_> = words.iter().filter(|word| !named.contains(word.as_str())).collect();
    assert!(missing.is_empty(), "docs/tasks.md does not name {missing:?}");
}

/// The kinds that the schema offers at a place, each with its keys.
fn kinds(place: &Value) -> Vec<(String, Vec<String>)> {
    let keys = |kind: &Value| kind["properties"].as_object().unwrap().keys().cloned().collect();
    let tables = place["oneOf"].as_array().unwrap().iter();
    tables.map(|kind| (kind["properties"]["kind"]["const"].as_str().unwrap().to_owned(), keys(kind))).collect()
}

/// Costs of quantities alone.
fn without_quadratic(costs: &Value) -> Value {
    let mut costs = costs.clone();
    let tables = costs["oneOf"].as_array_mut().unwrap();
    tables.retain(|table| table["properties"]["kind"]["const"] != "quadratic");
    costs
}

#[test]
fn every_key_is_named_where_its_kind_is() {
    let (page, schema) = (page(), json_schema());
    let models = schema["properties"]["model"]["oneOf"].as_array().unwrap();
    let robot = models.iter().find(|model| model["properties"]["kind"]["const"] == "robot").unwrap();
    let places = [
        (&robot["properties"]["compliance"]["items"], "### Compliance", "### Sensors"),
        (&robot["properties"]["sensors"]["items"], "### Quantities", "### Sensors"),
        (
            &without_quadratic(&schema["$defs"]["TaskFile"]["properties"]["costs"]["items"]),
            "### Quantities",
            "### Sensors",
        ),
    ];
    let common =
        ["kind", "name", "variance", "deviation", "target", "weight", "final_weight", "norm", "frame", "reference"];
    let mut missing = Vec::new();
    for (place, from, to) in places {
        let section = page.split(from).nth(1).and_then(|rest| rest.split(to).next()).unwrap();
        for (kind, keys) in kinds(place) {
            // A row of a table, or a part that begins with the kind in bold letters.
            let row = section.lines().find(|line| line.starts_with(&format!("| `{kind}` |")));
            let part = section.split("\n**").find(|part| part.starts_with(&format!("`{kind}`**")));
            let said = row.or(part).unwrap_or_else(|| panic!("`{kind}` has no row and no part of its own"));
            let named: BTreeSet<&str> = quoted(said).collect();
            let not = |key: &&String| !named.contains(key.as_str()) && !common.contains(&key.as_str());
            // What is said to be the same is the same.
            let keys: Vec<_> = keys.iter().filter(not).filter(|_| !said.contains("| the same |")).collect();
            missing.extend(keys.into_iter().map(|key| format!("{kind}: {key}")));
        }
    }
    assert!(missing.is_empty(), "docs/tasks.md does not name {missing:?}");
}

/// The cells of the rows of tables, those of heads with what they are a head of.
fn rows(page: &str) -> impl Iterator<Item = Vec<&str>> {
    let rows = page.lines().filter(|line| line.starts_with("| "));
    rows.map(|line| line.trim_matches('|').split(" | ").map(str::trim).collect())
}

#[test]
fn no_key_is_made_up() {
    let words = schema_words();
    let page = page();
    let first = rows(&page).filter(|row| !row[0].starts_with("Key")).flat_map(|row| quoted(row[0]));
    let unknown: Vec<_> = first.filter(|key| !words.contains(*key)).collect();
    assert!(unknown.is_empty(), "docs/tasks.md names {unknown:?}, which are no keys");
}

#[test]
fn defaults_of_settings_are_those_of_the_code() {
    let planning = serde_json::to_value(supple::plan::PlanSettings::default()).unwrap();
    let design = serde_json::to_value(supple::design::DesignSettings::default()).unwrap();
    let page = page();
    let mut settings = None;
    let mut count = 0;
    for row in rows(&page) {
        if row[0].starts_with("Key") {
            settings = match row[0] {
                "Key of `planning`" => Some(&planning),
                "Key of `design`" => Some(&design),
                _ => None,
            };
        } else if let Some(settings) = settings {
            let (key, shown) = (row[0].trim_matches('`'), row[2].trim_matches('`'));
            let same = match &settings[key] {
                Value::Object(table) => table.iter().all(|(key, value)| {
                    let number = row[3].split_once(&format!("`{key}` (")).and_then(|(_, rest)| rest.split_once(')'));
                    number.and_then(|(number, _)| number.parse::<f64>().ok()) == value.as_f64()
                }),
                Value::Number(number) => shown.parse::<f64>().ok() == number.as_f64(),
                Value::Bool(choice) => shown == choice.to_string(),
                Value::Null => shown == "none",
                value => value.as_str() == Some(shown),
            };
            assert!(same, "{key} is {} and not {shown}", settings[key]);
            count += 1;
        }
    }
    assert_eq!(count, planning.as_object().unwrap().len() + design.as_object().unwrap().len());
}

/// The files of the page: blocks put together, each file beginning with a title.
fn files(page: &str) -> Vec<String> {
    let mut files: Vec<String> = Vec::new();
    for block in page.split("```toml\n").skip(1).filter_map(|rest| rest.split_once("```").map(|(block, _)| block)) {
        if block.starts_with("title") {
            files.push(String::new());
        }
        let file = files.last_mut().expect("the first block has a title");
        file.push_str(block);
        file.push('\n');
    }
    files
}

#[test]
fn the_examples_can_be_read_and_their_derivatives_agree() {
    let mut files = files(&page());
    assert_eq!(files.len(), 4);
    // The robot also with accelerations as unknowns of its steps.
    let whole = files[0].replace("substeps = 2", "substeps = 1");
    assert_ne!(whole, files[0]);
    files.push(whole);
    for file in files {
        let problem = supple_file::parse(&file, &format!("{ROOT}tasks/example.toml"));
        let problem = problem.unwrap_or_else(|error| panic!("{error}\n{file}"));
        let report = check(&problem, &problem.parameters.initial()).unwrap();
        assert!(report.passed, "{}: {:#?}", problem.title, report.tasks[0].rows);
    }
}
