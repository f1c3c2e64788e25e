//! The tables of docs/paper.md are what the code gives.

use crate::common::same_text;

#[allow(dead_code)]
#[path = "../../examples/02_door_stiffness.rs"]
mod example;

use crate::common::{repository, shipped, starting_with};
use same_text::assert_same_text;
use supple::design::{Control, DesignSettings, DesignStatus, design};
use supple::{EvaluateOptions, Problem};

fn page() -> String {
    std::fs::read_to_string(repository("docs/paper.md")).unwrap()
}

/// Asserts that the rows are in the page, as they are or with other last digits.
fn assert_rows(rows: &[String]) {
    assert_rows_below("# The paper's claims, checked", rows);
}

/// The same of the part of the page below a heading.
fn assert_rows_below(heading: &str, rows: &[String]) {
    let page = page();
    let (_, page) = page.split_once(&format!("{heading}\n")).unwrap();
    let key = rows[0].split('|').nth(1).unwrap();
    let begin = page.lines().position(|line| line.split('|').nth(1) == Some(key));
    let begin = begin.unwrap_or_else(|| panic!("docs/paper.md lacks\n{}", rows.join("\n")));
    let shown: Vec<_> = page.lines().skip(begin).take(rows.len()).collect();
    assert_same_text(&shown.join("\n"), &rows.join("\n"));
}

#[test]
fn the_sweep_is_what_the_example_prints() {
    let mut printed = Vec::new();
    example::run(repository("tasks/iiwa_door.toml").to_str().unwrap(), &mut printed).unwrap();
    let page = page();
    let shown = page.split("```text\n").nth(1).unwrap().split("```").next().unwrap();
    assert_same_text(shown, &String::from_utf8(printed).unwrap());
}

#[test]
fn single_designs_are_as_shown() {
    let door = shipped("iiwa_door.toml");
    let row = |phi: [f64; 3]| {
        let found = door.evaluate(&phi, &EvaluateOptions::default()).unwrap();
        let tasks = found.tasks.iter().map(|task| {
            assert!(task.status.is_converged());
            format!("{:.1} | {:.2}", task.information.total_bits, task.cost.expected)
        });
        let [a, b, c] = phi.map(|k| format!("{k:e}"));
        format!("| {a}, {b}, {c} | {} |", tasks.collect::<Vec<_>>().join(" | "))
    };
    let designs = [[1e6; 3], [9.8e5, 9.3e5, 7.9e5], [1e3, 1e6, 1e6], [1e6, 1e3, 1e6], [1e6, 1e6, 1e3], [1e3, 1e3, 1e6]];
    assert_rows(&designs.map(row));
}

/// Both directed informations, and how fast the seventh joint would have to turn.
#[test]
fn what_the_numbers_are_of_is_as_shown() {
    let door = shipped("iiwa_door.toml");
    let row = |phi: [f64; 3]| {
        let found = door.evaluate(&phi, &EvaluateOptions::default()).unwrap();
        let tasks = found.tasks.iter().map(|task| {
            let of_joint = |name: &str| name.starts_with("velocity") && name.contains("iiwa_joint_7");
            let violated = task.limits_violated.iter().filter(|limit| of_joint(&limit.name));
            let fastest = violated.inspect(|limit| assert_eq!(limit.limit.abs(), 10.0)).map(|limit| limit.worst.abs());
            let control = task.information.used.as_ref().unwrap().total_bits;
            let fastest = fastest.fold(0.0, f64::max);
            format!("{:.1} | {control:.1} | {fastest:.0}", task.information.total_bits)
        });
        let [a, b, c] = phi.map(|k| format!("{k:e}"));
        format!("| {a}, {b}, {c} | {} |", tasks.collect::<Vec<_>>().join(" | "))
    };
    assert_rows_below("### Which quantities the numbers refer to", &[[1e6; 3], [1e4; 3], [1e3, 1e3, 1.1e3]].map(row));
    let bits = [735.0, 839.0].map(|nats: f64| format!("{:.0}", nats / std::f64::consts::LN_2));
    assert!(page().contains(&format!("in nats, {} and {} bits", bits[0], bits[1])));
}

#[test]
fn two_mass_designs_are_as_shown() {
    let masses = shipped("two_mass.toml");
    let row = |(k1, k2): (f64, f64)| {
        let found = masses.evaluate(&starting_with(&masses, &[k1, k2]), &EvaluateOptions::default()).unwrap();
        format!("| {k1}, {k2} | {:.1} | {:.1} |", found.objective.information_bits, found.tasks[0].cost.expected)
    };
    assert_rows(&[(500.0, 500.0), (600.0, 600.0), (500.0, 100.0), (50.0, 500.0), (123.0, 240.0)].map(row));
}

/// The door's file with both tasks, or with one.
fn door(only: Option<&str>) -> Problem {
    let mut problem = shipped("iiwa_door.toml");
    problem.tasks.retain(|task| only.is_none_or(|name| task.name == name));
    problem
}

#[test]
fn designs_are_as_shown() {
    let rows = [("`open`", Some("open")), ("`close`", Some("close")), ("both", None)].map(|(name, only)| {
        let problem = door(only);
        let start = problem.parameters.initial();
        let control = Control::default();
        let settings = DesignSettings { starts: 1, ..problem.design.clone() };
        let found = design(&problem, &start, &settings, control).unwrap();
        assert_eq!(found.status, DesignStatus::Converged, "{name}");
        let best = &found.starts[found.best];
        let before = problem.evaluate(&start, &EvaluateOptions::default()).unwrap();
        let (from, to) = (before.objective.information_bits, best.information / std::f64::consts::LN_2);
        let costs = before.tasks.iter().zip(&best.costs);
        let costs: Vec<_> = costs.map(|(task, to)| format!("{:.2} to {to:.2}", task.cost.expected)).collect();
        let k: Vec<_> = best.to.iter().map(|k| format!("{k:.1e}")).collect();
        let change = 100.0 * (to / from - 1.0);
        format!("| {name} | {} | {from:.1} to {to:.1} | {change:.1} % | {} |", k.join(", "), costs.join(", "))
    });
    assert_rows(&rows);
}
