//! `supple check` sees what it is there for: an entry of a gradient that is wrong by a thousandth, on every shipped task;
//! and it raises no false alarms.

use crate::common;

use crate::common::{shipped, task_files};
use supple::Problem;
use supple::check::{ComparedGradient, VISIBLE, check, compare_gradients, plan_for_check};
use supple::pipeline::TaskState;
use supple::settings::CostCurvature;

/// The gradients of all tasks of a problem, compared.
fn compared(problem: &Problem) -> Vec<(String, ComparedGradient)> {
    let phi = problem.parameters.initial();
    let mut found = Vec::new();
    for task in &problem.tasks {
        let mut state = TaskState::new(task);
        plan_for_check(problem, task, &phi, &mut state).unwrap();
        let gradients = compare_gradients(problem, task, &phi, &mut state).unwrap().gradients;
        found.extend(gradients.into_iter().map(|gradient| (task.name.clone(), gradient)));
    }
    found
}

/// Every entry of every gradient, wrong by a thousandth of itself to either side, one at a time: each is caught, but for
/// those that the row names as too small beside rounding. Returns how many entries there are, and those that were not
/// caught.
fn not_caught(problem: &Problem) -> (usize, Vec<String>) {
    let (mut entries, mut missed) = (0, Vec::new());
    for (task, gradient) in compared(problem) {
        let right = gradient.row(&problem.parameters);
        assert!(right.passed, "{}, {task}: {right:?}", problem.title);
        for (index, parameter) in problem.parameters.iter().enumerate() {
            if gradient.analytic[index] == 0.0 {
                continue;
            }
            entries += 1;
            for share in [1.0 + 1.1 * VISIBLE, 1.0 - 1.1 * VISIBLE] {
                let mut wrong = gradient.clone();
                wrong.analytic[index] *= share;
                let row = wrong.row(&problem.parameters);
                if row.passed {
                    let place = format!("{task}, {}, {}", row.name, parameter.name);
                    assert!(row.unresolved.contains(&parameter.name), "{}: {place}: {row:?}", problem.title);
                    missed.push(place);
                } else {
                    assert_eq!(row.place, parameter.name, "{}: the wrong entry is named", problem.title);
                }
            }
        }
    }
    missed.dedup();
    (entries, missed)
}

#[test]
fn a_wrong_thousandth_of_any_entry_is_caught_on_every_shipped_task() {
    for file in task_files() {
        let (entries, missed) = not_caught(&shipped(&file));
        println!("{file}: {entries} entries; not caught: {missed:?}");
        assert!(missed.is_empty(), "{file}: of {entries} entries {missed:?}");
    }
}

/// An error of 510 % in the entry of `k2` was hidden by the entry of `wall_variance`, which is millions of times as large.
#[test]
fn a_small_entry_is_not_hidden_by_the_large_one_of_another_parameter() {
    let problem = shipped("two_mass.toml");
    let k2 = problem.parameters.index("k2").unwrap();
    for (name, factor) in [("total gradient, information", 6.1), ("total gradient, initial cost", 341.0)] {
        let (_, mut gradient) = compared(&problem).into_iter().find(|(_, gradient)| gradient.name == name).unwrap();
        gradient.analytic[k2] *= factor;
        let row = gradient.row(&problem.parameters);
        assert!(!row.passed && row.place == "k2", "{row:?}");
    }
}

/// Differences by steps that did not fit failed these with right gradients.
#[test]
fn two_masses_pass_at_any_number_of_steps() {
    let text = std::fs::read_to_string(common::repository("tasks/two_mass.toml")).unwrap();
    for steps in (1..=30).chain([60, 250]) {
        let text = text.replace("steps = 125", &format!("steps = {steps}"));
        assert!(text.contains(&format!("steps = {steps}\n")));
        let problem = supple_file::parse(&text, "task.toml").unwrap();
        let report = check(&problem, &problem.parameters.initial()).unwrap();
        let failed: Vec<_> = report.tasks[0].rows.iter().filter(|row| !row.passed).collect();
        assert!(report.passed, "{steps} steps: {failed:#?}");
    }
}

/// A pole that falls over grows by 1e16 in these steps, beside which the cart is rounding.
#[test]
fn growing_modes_hide_no_direction_that_is_observable() {
    let text = r#"
        [model]
        kind = "linear"
        A = [[1.0, 0.05, 0.0, 0.0], [0.0, 1.0, 0.1, 0.0], [0.0, 0.0, 1.0, 0.05], [0.0, 0.0, 0.5, 1.0]]
        B = [[0.0], [0.1], [0.0], [-0.1]]
        C = [[1.0, 0.0, 0.0, 0.0]]
        [[tasks]]
        name = "balance"
        steps = 250
        time_step = 0.05
        initial_state = [0.1, 0.0, 0.0, 0.0]
        noise = { initial = [1e-2, 1e-2, 1e-2, 1e-2], process = [0.0, 1e-4, 0.0, 1e-4], measurement = [1e-4] }
        costs = [{ kind = "quadratic", Q = [[1, 0, 0, 0], [0, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0]], R = [[0.1]] }]
    "#;
    let seen = |text: &str| {
        let problem = supple_file::parse(text, "task.toml").unwrap();
        let report = check(&problem, &[]).unwrap();
        let fact = report.tasks[0].facts.iter().find(|fact| fact.name.starts_with("observable directions")).unwrap();
        (fact.value, fact.note.clone())
    };
    assert_eq!(seen(text), (4.0, "all states are observable".to_owned()));
    // The angle alone does not tell where the cart is, nor how fast it is.
    let angle = text.replace("C = [[1.0, 0.0, 0.0, 0.0]]", "C = [[0.0, 0.0, 1.0, 0.0]]");
    assert_eq!(seen(&angle), (2.0, "of 4: 2 directions are unobservable".to_owned()));
}

/// A thousandth of the place of a wall, half a metre, was a long step beside a contact that is 2 mm soft.
#[test]
fn the_place_of_a_wall_that_is_2_mm_soft_is_no_false_alarm() {
    let path = common::repository("tasks/wiping_arm.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let edits = [
        ("point = [0.55, 0.0, 0.0]", "point = [\"wall\", 0.0, 0.0]"),
        ("smoothing = 5e-3", "smoothing = 2e-3"),
        ("[parameters.k]", "[parameters.wall]\ninitial = 0.55\nbounds = [0.5, 0.6]\nunit = \"m\"\n\n[parameters.k]"),
    ];
    let text = edits.iter().fold(text, |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    });
    let problem = supple_file::parse(&text, path.to_str().unwrap()).unwrap();
    let report = check(&problem, &problem.parameters.initial()).unwrap();
    for row in &report.tasks[0].rows {
        assert!(row.passed, "{row:?}");
    }
    let by_parameters = report.tasks[0].rows.iter().find(|row| row.name == "Lagrangian by parameters").unwrap();
    assert!(problem.parameters.iter().any(|parameter| parameter.name == by_parameters.place), "{by_parameters:?}");
}

/// A plan is a minimum of the cost itself, also where its control law is made of Gauss-Newton's curvature. The plan was
/// taken to move as if that were the curvature of the cost: gradients were off by up to 80 %, or refused.
#[test]
fn plans_move_by_the_exact_curvature_of_the_cost() {
    for file in ["elastic_elbow.toml", "wiping_arm.toml"] {
        let mut problem = shipped(file);
        problem.planning.curvature = CostCurvature::GaussNewton;
        let report = check(&problem, &problem.parameters.initial()).unwrap();
        let failed: Vec<_> = report.tasks[0].rows.iter().filter(|row| !row.passed).collect();
        assert!(report.passed, "{file}: {failed:#?}");
    }
}

/// Where every point beside the design ends without a plan, that is named, and nothing is said to agree.
#[test]
fn points_whose_plan_did_not_converge_are_named_and_not_differenced() {
    let mut problem = shipped("two_mass.toml");
    problem.planning.max_iterations = 1;
    let phi = problem.parameters.initial();
    let report = check(&problem, &phi).unwrap();
    assert!(!report.passed);
    let task = &report.tasks[0];
    assert!(task.left_out.iter().any(|why| why.starts_with("k1 = ") && why.contains("max_iterations")), "{task:?}");
    let total = task.rows.iter().find(|row| row.name == "total gradient, information").unwrap();
    assert!(!total.passed && total.not_compared.contains(&"k1".to_owned()), "{total:?}");
}
