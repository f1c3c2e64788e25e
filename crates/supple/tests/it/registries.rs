//! Walks every registry: each kind of model and cost has a problem here whose every derivative agrees with finite
//! differences. A new kind without one fails. What robots are made of is walked in `robot/registries.rs`.

use crate::robot::examples;
use std::collections::BTreeSet;

use supple::check::check;
use supple::{Kinds, Problem};
use supple_file::json_schema;

const PARAMETERS: &str = r#"
    [parameters.a]
    initial = 1.3
    bounds = [0.5, 2.0]
    [parameters.b]
    initial = 0.4
    bounds = [0.1, 3.0]
    scale = "log"
"#;

/// A problem with given model, costs and sizes of state and measurement.
fn problem(model: &str, costs: &str, (states, measurements): (usize, usize)) -> Problem {
    let row = |value: &str, len: usize| vec![value; len].join(", ");
    let text = format!(
        "{PARAMETERS}\n[model]\n{model}\n[[tasks]]\nname = \"task\"\nsteps = 12\ntime_step = 0.05\n\
         initial_state = [{}]\ninitial_control = [1.5]\n[tasks.noise]\ninitial = [{}]\nprocess = [{}]\n\
         measurement = [{}]\n{costs}",
        row("0.1", states),
        row("0.01", states),
        row("0.002", states),
        row("0.03", measurements),
    );
    supple_file::parse(&text, "test").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

const TWO_MASS: &str = "kind = \"two_mass\"\nmass = [\"a\", 0.4]\ndamping = [2.0, 1.0]\nstiffness = [20.0, 30.0]\n\
                        contact_smoothing = 0.05";
const LINEAR: &str = "kind = \"linear\"\nA = [[1.0, 0.1], [\"b\", 0.9]]\nB = [[0.0], [\"a\"]]\nC = [[1.0, 0.2]]";
const CONTROL: &str = "[[tasks.costs]]\nkind = \"control\"\nweight = 0.01\n";

/// Every kind of model, with costs that use both parameters.
fn models() -> Vec<(&'static str, Problem)> {
    let state = "[[tasks.costs]]\nkind = \"state\"\nselect = [\"x1\"]\ntarget = [\"b\"]\nweight = \"a\"\n";
    vec![
        ("two_mass", problem(TWO_MASS, &format!("{state}{CONTROL}"), (5, 2))),
        ("linear", problem(LINEAR, &format!("{state}{CONTROL}"), (2, 1))),
        ("robot", examples::of_compliance().remove(0).problem()),
    ]
}

/// Every kind of cost, with parameters in its numbers and both norms where it has them.
fn costs() -> Vec<(&'static str, Problem)> {
    let two_mass = |cost: &str| problem(TWO_MASS, &format!("[[tasks.costs]]\n{cost}\n{CONTROL}"), (5, 2));
    let linear = |cost: &str| problem(LINEAR, &format!("[[tasks.costs]]\n{cost}\n"), (2, 1));
    let absolute = "norm = { absolute = { smoothing = \"b\" } }";
    let mut list = vec![
        ("contact_force", two_mass("kind = \"contact_force\"\ntarget = 2.0\nsmoothing = \"b\"\nweight = 0.3")),
        (
            "contact_force",
            two_mass(&format!("kind = \"contact_force\"\ntarget = 2.0\nsmoothing = 0.5\nweight = \"a\"\n{absolute}")),
        ),
        ("penetration", two_mass("kind = \"penetration\"\ntarget = \"b\"\nweight = 0.3\nfinal_weight = \"a\"")),
        ("state", two_mass("kind = \"state\"\nselect = [\"v2\", \"x2\"]\ntarget = [0.1, \"b\"]\nweight = 2.0")),
        ("state", two_mass(&format!("kind = \"state\"\nselect = [\"v2\"]\nweight = 2.0\n{absolute}"))),
        ("control", linear("kind = \"control\"\nweight = 0.2\nnorm = { absolute = { smoothing = 0.3 } }")),
        (
            "quadratic",
            linear(
                "kind = \"quadratic\"\nQ = [[1.0, \"b\"], [\"b\", 2.0]]\nR = [[\"a\"]]\nfinal = [[3.0, 0.0], [0.0, 1.0]]",
            ),
        ),
    ];
    list.extend(of_robots());
    list
}

/// The kinds of cost that robots alone have.
fn of_robots() -> Vec<(&'static str, Problem)> {
    let any_model = ["contact_force", "control", "penetration", "quadratic", "state"];
    let kinds: Vec<&str> = Kinds::default().quantities().into_iter().chain(["quadratic"]).collect();
    let kind_of = |costs: &str| kinds.iter().copied().find(|kind| costs.split('"').nth(1) == Some(*kind));
    let all = examples::of_costs().into_iter();
    let with_kind = all.filter_map(|example| kind_of(&example.costs).map(|kind| (kind, example)));
    with_kind.filter(|(kind, _)| !any_model.contains(kind)).map(|(kind, example)| (kind, example.problem())).collect()
}

/// The kinds that the schema offers at a place.
fn offered(place: &serde_json::Value) -> BTreeSet<String> {
    let kinds = place["oneOf"].as_array().unwrap();
    kinds.iter().map(|kind| kind["properties"]["kind"]["const"].as_str().unwrap().to_owned()).collect()
}

fn assert_derivatives(problems: Vec<(&'static str, Problem)>, offered: BTreeSet<String>) {
    let covered: BTreeSet<String> = problems.iter().map(|(kind, _)| (*kind).to_owned()).collect();
    assert_eq!(covered, offered, "every kind has a problem here, and none is unknown");
    for (kind, problem) in problems {
        let report = check(&problem, &problem.parameters.initial()).unwrap();
        for row in &report.tasks[0].rows {
            assert!(
                row.passed,
                "{kind}, {}: error {:.1e} at {}: {} against {}",
                row.name, row.error, row.place, row.analytic, row.numeric
            );
        }
    }
}

#[test]
fn derivatives_of_every_kind_of_model() {
    assert_derivatives(models(), offered(&json_schema()["properties"]["model"]));
}

#[test]
fn derivatives_of_every_kind_of_cost() {
    let schema = json_schema();
    assert_derivatives(costs(), offered(&schema["$defs"]["TaskFile"]["properties"]["costs"]["items"]));
}

#[test]
fn derivatives_of_the_shipped_tasks() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|end| end != "toml") {
            continue;
        }
        let problem = supple_file::load(path).unwrap();
        let report = check(&problem, &problem.parameters.initial()).unwrap();
        assert!(report.passed, "{}: {:?}", problem.title, report.tasks[0].rows);
        count += 1;
    }
    assert!(count >= 2);
}
