//! Mistakes in problems that are built in Rust are refused in words, as those of task files are, before anything is computed.

use std::sync::atomic::AtomicBool;

use supple::check::check;
use supple::cost::{Absolute, Cost, Weights};
use supple::design::{Control, DesignSettings, DesignStatus, design};
use supple::noise::{Covariance, NoiseModel};
use supple::parameters::{Parameter, Parameters, Scale};
use supple::quantity::{ContactForce, Control as Controls, State};
use supple::system::Authored;
use supple::{EvaluateOptions, Matrices, Problem, Stop, Task, TwoMass};

const STEPS: usize = 20;
const TIME_STEP: f64 = 0.02;

fn parameters() -> Parameters {
    Parameters::new(vec![Parameter::new("k", 300.0, [50.0, 600.0])])
}

/// Two masses with these costs, whose system has this time step.
fn task(costs: Vec<Cost>, time_step: f64) -> Task {
    let model = TwoMass {
        mass: [0.8, 0.4].map(Into::into),
        damping: [60.0, 35.0].map(Into::into),
        stiffness: [300.0, 200.0].map(Into::into),
        contact_smoothing: 0.01.into(),
    };
    let noise = NoiseModel::new(
        Covariance::diagonal([1e-3, 1e-3, 1e-3, 1e-3, 3e-2]),
        Covariance::diagonal([1e-7, 5e-3, 1e-7, 1e-2, 0.0]),
        Covariance::diagonal([0.1, 1.0]),
    );
    let system = Authored::new(model, costs, time_step, 1);
    Task::new("press", system, noise, STEPS, TIME_STEP).starting_at([0.0, 0.0, 0.0, 0.0, 0.75])
}

fn costs() -> Vec<Cost> {
    vec![Cost::new(State::new([1, 3]), 0.1), Cost::new(Controls::all(1), 1e-4)]
}

fn problem(task: Task) -> Problem {
    Problem::new("Two masses", parameters(), vec![task])
}

fn refused(problem: &Problem, phi: &[f64]) -> String {
    let found = problem.evaluate(phi, &EvaluateOptions::default());
    found.err().map_or_else(|| "accepted".into(), |error| error.to_string())
}

#[test]
fn costs_that_do_not_fit_are_refused() {
    let row = |numbers: &[f64]| numbers.iter().map(|&number| number.into()).collect::<Vec<_>>();
    let states = || Cost::new(State::new([1, 3]), 0.1);
    let cases = [
        (
            states().with_weights(Weights::Each(row(&[1.0]))),
            "weight: must be 2 numbers, one for each entry of `state`; found 1",
        ),
        (
            states().with_weights(Weights::Matrix(vec![row(&[1.0])])),
            "weight: must be a matrix of 2 x 2 numbers; found 1 x 1",
        ),
        (
            states().with_weights(Weights::Matrix(vec![row(&[1.0, 4.0]), row(&[4.0, 1.0])])),
            "weight: must be positive semidefinite, so that no cost is negative; its leading 2 x 2 block is not",
        ),
        (
            states()
                .with_norm(Absolute { smoothing: 0.1.into() })
                .with_weights(Weights::Matrix(vec![row(&[1.0, 0.0]), row(&[0.0, 1.0])])),
            "weight: must be numbers: the norm `absolute` takes no matrix",
        ),
        (states().with_targets([1.0, 2.0, 3.0]), "target: must be 2 numbers, one for each entry of `state`; found 3"),
        (states().with_targets([f64::NAN]), "target: must be finite; found NaN"),
        (states().with_norm(Absolute { smoothing: (-0.1).into() }), "norm: its smoothing must be above 0; found -0.1"),
        (Cost::new(State::new([0]), -1.0), "weight: must be at least 0; found -1"),
        (Cost::new(State::new([0]), f64::NAN), "weight: must be finite; found NaN"),
        (Cost::new(State::new([9]), 1.0), "`state` reads number 10 of the model's states, of which there are 5"),
        (Cost::new(Controls::all(3), 1.0), "`control` reads number 3 of the model's controls, of which there are 1"),
        (
            Cost::new(ContactForce::new(7), 1.0),
            "`contact_force` reads number 8 of the model's signals, of which there are 2",
        ),
    ];
    assert_eq!(refused(&problem(task(costs(), TIME_STEP)), &[300.0]), "accepted");
    for (cost, told) in cases {
        let separator = if told.starts_with('`') { ": " } else { "." };
        let found = refused(&problem(task([costs(), vec![cost]].concat(), TIME_STEP)), &[300.0]);
        assert_eq!(found, format!("task `press`: costs[2]{separator}{told}"));
    }
}

#[test]
fn tasks_that_do_not_fit_their_system_are_refused() {
    let found = refused(&problem(task(costs(), 0.001)), &[300.0]);
    assert_eq!(found, "task `press`: time_step: must be that of the system, 0.001 s; found 0.02");
    let found = refused(&Problem::new("None", Parameters::default(), vec![task(costs(), TIME_STEP)]), &[]);
    assert_eq!(found, "task `press`: system: was made for 1 parameter; the problem has 0");
    assert_eq!(refused(&Problem::new("None", parameters(), Vec::new()), &[300.0]), "tasks: there must be at least one");
    for (controls, told) in [
        (Matrices::vectors(3, 1), "must be 20 vectors of length 1; found 3 of length 1"),
        (Matrices::vectors(STEPS, 4), "must be 20 vectors of length 1; found 20 of length 4"),
    ] {
        let knowing = task(costs(), TIME_STEP).knowing(controls.clone());
        assert_eq!(refused(&problem(knowing), &[300.0]), format!("task `press`: known_controls: {told}"));
        let options = EvaluateOptions { controls: Some(vec![controls]), ..EvaluateOptions::default() };
        let found = problem(task(costs(), TIME_STEP)).evaluate(&[300.0], &options).err().map(|error| error.to_string());
        assert_eq!(found, Some(format!("task `press`: the controls to start from {told}")));
    }
    let still = task(costs(), TIME_STEP).simulate(&[], None, Matrices::vectors(STEPS, 1));
    let told = still.err().map(|error| error.to_string());
    assert_eq!(told.as_deref(), Some("the list of parameters of task `press` has length 0, not 1"));
}

#[test]
fn parameters_and_settings_are_checked() {
    let good = || problem(task(costs(), TIME_STEP));
    assert_eq!(refused(&good(), &[f64::NAN]), "parameter `k` must be a finite number; found NaN");
    let told = check(&good(), &[]).err().map(|error| error.to_string());
    assert_eq!(told.as_deref(), Some("the list of parameters has length 0, not 1"));
    let k = || Parameter::new("k", 300.0, [50.0, 600.0]);
    for (list, told) in [
        (vec![k(), k()], "parameters[1].name: `k` is the name of another parameter too"),
        (vec![Parameter { bounds: [f64::NAN, 600.0], ..k() }], "parameters[0].bounds: must be two finite numbers"),
        (
            vec![Parameter { bounds: [0.0, 600.0], ..k() }.with_scale(Scale::Log)],
            "parameters[0].bounds: must be above 0 with scale = \"log\"; the lower one is 0",
        ),
    ] {
        let phi = vec![300.0; list.len()];
        assert_eq!(refused(&Problem { parameters: Parameters::new(list), ..good() }, &phi), told);
    }
    let mut planning = good();
    planning.planning.tolerance = f64::NAN;
    assert_eq!(refused(&planning, &[300.0]), "planning.tolerance: must be between 0 and 1; found NaN");
    for (settings, told) in [
        (DesignSettings { starts: 0, ..DesignSettings::default() }, "design.starts: must be at least 1; found 0"),
        (
            DesignSettings { tolerance: f64::NAN, ..DesignSettings::default() },
            "design.tolerance: must be between 0 and 1; found NaN",
        ),
        (
            DesignSettings { max_evaluations: 0, ..DesignSettings::default() },
            "design.max_evaluations: must be at least 1; found 0",
        ),
    ] {
        let found = design(&good(), &[300.0], &settings, Control::default()).err().map(|error| error.to_string());
        assert_eq!(found.as_deref(), Some(told));
    }
}

#[test]
fn stopped_searches_know_whether_they_meet_their_bounds() {
    let stop = AtomicBool::new(true);
    let control = || Control { stop: Stop::when(&stop), ..Control::default() };
    let settings = DesignSettings { starts: 1, ..DesignSettings::default() };
    for (bound, is_met) in [(1e-9, false), (1e9, true)] {
        let problem = problem(task(costs(), TIME_STEP).within_cost(bound));
        let found = design(&problem, &[300.0], &settings, control()).unwrap();
        assert_eq!((found.status, found.meets_bounds()), (DesignStatus::Stopped, is_met));
    }
}
