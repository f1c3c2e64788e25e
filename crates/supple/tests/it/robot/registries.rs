//! Walks all kinds of compliance, sensor and cost, and every number of a robot: each is in an example with a parameter
//! in its place, whose every derivative agrees with finite differences. A new kind or key without one fails.

use std::collections::BTreeSet;

use serde_json::Value as Json;
use supple::check::check;
use supple_file::json_schema;
use toml::Value as Toml;

use crate::robot::arm::Description;
use crate::robot::examples;
use crate::robot::fields::{model, offered, without_parameter};

/// The task files of all examples, parsed, with the names of their parameters.
fn files() -> Vec<(Toml, Vec<String>)> {
    let file = |description: Description| {
        let names = description.parameters.iter().map(|(name, _)| (*name).to_owned()).collect();
        (Toml::Table(toml::from_str(&description.text()).unwrap()), names)
    };
    examples::all().into_iter().map(file).collect()
}

/// Every kind that the schema offers is in an example, and so is a parameter in each of its numbers.
fn assert_covered(schema: &Json, place: &Json, tables: &[(&Toml, &[String])]) {
    let is = |table: &Toml, kind: &str| table["kind"].as_str() == Some(kind);
    let kinds: BTreeSet<_> = tables.iter().map(|(table, _)| table["kind"].as_str().unwrap()).collect();
    let offered = offered(place);
    assert_eq!(kinds, offered.iter().map(|(kind, _)| kind.as_str()).collect());
    for (kind, table) in &offered {
        let own: Vec<_> = tables.iter().filter(|(table, _)| is(table, kind)).copied().collect();
        let missing = without_parameter(schema, table, &own);
        assert!(missing.is_empty(), "{kind}: no example has a parameter in {missing:?}");
    }
}

/// The tables of a list in a table.
fn list<'a>(table: &'a Toml, key: &str) -> impl Iterator<Item = &'a Toml> {
    table.get(key).and_then(Toml::as_array).into_iter().flatten()
}

#[test]
fn every_kind_is_in_an_example_with_parameters_in_every_number() {
    let schema = json_schema();
    let mut robot = model(&schema, "robot");
    let files = files();
    let models: Vec<(&Toml, &[String])> =
        files.iter().map(|(file, names)| (&file["model"], names.as_slice())).collect();
    let tasks: Vec<(&Toml, &[String])> =
        files.iter().flat_map(|(file, names)| list(file, "tasks").map(move |task| (task, names.as_slice()))).collect();
    for (key, tables) in [("compliance", &models), ("sensors", &models)] {
        let own: Vec<_> =
            tables.iter().flat_map(|&(table, names)| list(table, key).map(move |table| (table, names))).collect();
        assert_covered(&schema, &robot["properties"][key]["items"], &own);
        robot["properties"].as_object_mut().unwrap().remove(key);
    }
    let mut task = schema["$defs"]["TaskFile"].clone();
    let costs: Vec<_> =
        tasks.iter().flat_map(|&(table, names)| list(table, "costs").map(move |table| (table, names))).collect();
    assert_covered(&schema, &task["properties"]["costs"]["items"], &costs);
    // Limits and curves are the same quantities; `quantities.rs` walks them.
    for key in ["costs", "limits", "curves"] {
        task["properties"].as_object_mut().unwrap().remove(key);
    }
    for (table, own) in [(robot, &models), (task, &tasks)] {
        let missing = without_parameter(&schema, &table, own);
        assert!(missing.is_empty(), "no example has a parameter in {missing:?}");
    }
}

/// The walk itself: a key that no example has is found.
#[test]
fn a_number_without_a_parameter_is_found() {
    let schema = json_schema();
    let robot = model(&schema, "robot");
    let springs = offered(&robot["properties"]["compliance"]["items"]);
    let spring = &springs.iter().find(|(kind, _)| kind == "spring").unwrap().1;
    let table: Toml = Toml::Table(toml::from_str("stiffness = \"k\"\nrest = \"other\"\ndamping = 1.0").unwrap());
    let names = ["k".to_owned()];
    assert_eq!(without_parameter(&schema, spring, &[(&table, &names)]), [".damping", ".rest"]);
}

/// Every derivative of every task agrees with finite differences.
fn assert_derivatives(list: Vec<Description>) {
    for description in list {
        let problem = description.problem();
        let report = check(&problem, &problem.parameters.initial()).unwrap();
        let task = &report.tasks[0];
        assert!(task.status.is_converged(), "{}\n{}", task.status, description.text());
        for row in &task.rows {
            assert!(
                row.passed,
                "{}: error {:.1e} at {}: {} against {}\n{}",
                row.name,
                row.error,
                row.place,
                row.analytic,
                row.numeric,
                description.text()
            );
        }
    }
}

#[test]
fn derivatives_of_every_kind_of_compliance() {
    assert_derivatives(examples::of_compliance());
}

#[test]
fn derivatives_of_every_kind_of_sensor() {
    assert_derivatives(examples::of_sensors());
}

#[test]
fn derivatives_by_every_number() {
    assert_derivatives(examples::of_numbers());
}

#[test]
fn derivatives_with_substeps() {
    assert_derivatives(examples::of_substeps());
}

#[test]
fn derivatives_of_every_kind_of_cost() {
    assert_derivatives(examples::of_costs());
}
