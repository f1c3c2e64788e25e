//! The shipped two-mass tasks against an independent program (see `golden/README.md`).

use crate::common::{controls, numbers, shipped, starting_with};
use serde_json::Value as Json;
use supple::{EvaluateOptions, Evaluation, Problem};

fn points(task: &str) -> Vec<Json> {
    let golden: Json = serde_json::from_str(include_str!("../golden/two_mass.json")).unwrap();
    golden[task].as_array().unwrap().clone()
}

/// Every golden point with its evaluation, from the golden controls.
fn evaluated() -> Vec<(Json, Evaluation)> {
    let mut all = Vec::new();
    for name in ["two_mass_small", "two_mass"] {
        let problem = shipped(&format!("{name}.toml"));
        for point in points(name) {
            let options = EvaluateOptions {
                total_gradient: true,
                frozen_gradient: true,
                controls: Some(vec![controls(&numbers(&point["controls"]))]),
                trajectories: true,
                ..Default::default()
            };
            let at = problem.evaluate(&starting_with(&problem, &numbers(&point["phi"])), &options).unwrap();
            all.push((point, at));
        }
    }
    assert_eq!(all.len(), 5);
    all
}

fn assert_close(what: &str, found: f64, expected: f64, tolerance: f64) {
    let error = (found - expected).abs() / expected.abs();
    assert!(error <= tolerance, "{what}: {found} against {expected}, relative error {error:.1e}");
}

#[test]
fn values_agree_to_a_millionth() {
    for (point, at) in evaluated() {
        let task = &at.tasks[0];
        assert!(task.status.is_converged(), "{:?}", point["phi"]);
        let pairs = [
            ("nominal_cost", task.cost.parts.nominal),
            ("belief_cost", task.cost.parts.belief),
            ("process_cost", task.cost.parts.process),
            ("initial_cost", task.cost.parts.initial),
            ("expected_cost", task.cost.expected),
            ("directed_information_nat", task.information.total_nats),
            ("directed_information_paper_form_nat", task.information.paper_form_nats.unwrap()),
        ];
        for (key, found) in pairs {
            assert_close(key, found, point[key].as_f64().unwrap(), 1e-6);
        }
        let per_step = &task.information.per_step_nats;
        for (t, first) in numbers(&point["information_per_step_nat_first5"]).into_iter().enumerate() {
            assert_close("information per step", per_step[t], first, 1e-6);
        }
        for (t, last) in numbers(&point["information_per_step_nat_last3"]).into_iter().enumerate() {
            assert_close("information per step", per_step[per_step.len() - 3 + t], last, 1e-6);
        }
        let end = task.trajectory.as_ref().unwrap().states.last().unwrap().clone();
        for (found, expected) in end.into_iter().zip(numbers(&point["final_state"])) {
            assert!((found - expected).abs() <= 1e-6, "last state: {found} against {expected}");
        }
    }
}

/// Entries are compared relative to the largest entry of each gradient: the golden ones come from finite differences.
#[test]
fn total_gradients_agree_to_two_ten_thousandths() {
    for (point, at) in evaluated() {
        let total = at.tasks[0].gradient.as_ref().unwrap().total.as_ref().unwrap();
        assert!(total.valid);
        let golden = &point["total_gradient"];
        let pairs = [
            ("directed_information", &total.information_nats),
            ("nominal_cost", &total.nominal_cost),
            ("belief_cost", &total.belief_cost),
            ("process_cost", &total.process_cost),
            ("initial_cost", &total.initial_cost),
        ];
        for (key, found) in pairs {
            let expected = numbers(&golden[key]);
            let size = expected.iter().fold(0.0, |size: f64, g| size.max(g.abs()));
            for ((name, found), expected) in found.0.iter().zip(expected) {
                let error = (found - expected).abs() / size;
                assert!(error <= 2e-4, "{key} by {name} at {}: {found} against {expected}", point["phi"]);
            }
        }
    }
}

#[test]
fn frozen_gradients_agree_to_a_millionth() {
    for (point, at) in evaluated() {
        let frozen = at.tasks[0].gradient.as_ref().unwrap().frozen.as_ref().unwrap();
        let pairs = [("directed_information", &frozen.information_nats), ("belief_cost", &frozen.belief_cost)];
        for (key, found) in pairs {
            for ((_, found), expected) in found.0.iter().zip(numbers(&point["frozen_gradient"][key])) {
                assert_close(key, *found, expected, 1e-6);
            }
        }
    }
}

#[test]
fn own_first_guess_ends_as_low_or_lower() {
    for name in ["two_mass_small", "two_mass"] {
        let problem: Problem = shipped(&format!("{name}.toml"));
        for point in points(name) {
            let at = problem
                .evaluate(&starting_with(&problem, &numbers(&point["phi"])), &EvaluateOptions::default())
                .unwrap();
            let (found, golden) = (at.tasks[0].cost.parts.nominal, point["nominal_cost"].as_f64().unwrap());
            assert!(found <= golden * (1.0 + 1e-9), "{}: {found} against {golden}", point["phi"]);
        }
    }
}
