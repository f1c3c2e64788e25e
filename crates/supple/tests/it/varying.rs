//! Measurement noise whose variance depends on the state.

use crate::common;

use supple::check::check;
use supple::lqg::Noise;
use supple::pipeline::TaskState;
use supple::simulate::{Rollouts, World, Worlds, sampled_costs};
use supple::{EvaluateOptions, Matrices, Problem};

/// A point in the plane that is seen best at x1 = `center`; `seen` is the matrix C.
fn plane(seen: &str, varying: &str) -> Problem {
    let text = format!(
        r#"
        [model]
        kind = "linear"
        A = [[1.0, 0.1], [0.0, 0.9]]
        B = [["push", 0.0], [0.0, 1.0]]
        C = {seen}
        [parameters]
        push = {{ initial = 0.8, bounds = [0.1, 2.0] }}
        center = {{ initial = 5.0, bounds = [0.0, 10.0] }}
        coefficient = {{ initial = 0.5, bounds = [0.0, 2.0] }}
        base = {{ initial = 0.02, bounds = [1e-3, 1.0], scale = "log" }}
        spare = {{ initial = 1e-4, bounds = [1e-6, 1.0], scale = "log", role = "study" }}
        [[tasks]]
        name = "home"
        steps = 12
        time_step = 0.1
        initial_state = [2.0, 2.0]
        noise.initial = [2e-3, 1e-3]
        noise.process = ["spare", 1e-4]
        noise.measurement = ["base", 0.05]
        {varying}
        [[tasks.costs]]
        kind = "quadratic"
        Q = [[0.5, 0.1], [0.1, 0.4]]
        R = [[0.3, 0.0], [0.0, 0.2]]
        "#
    );
    supple_file::parse(&text, "task.toml").unwrap()
}

const DIAGONAL: &str = "[[1.0, 0.0], [0.0, 1.0]]";
const MIXED: &str = "[[1.0, 0.3], [-0.2, 1.0]]";
const LIGHT: &str = r#"
        [[tasks.noise.varying]]
        measurement = ["y*"]
        state = "x1"
        center = "center"
        coefficient = "coefficient"
        [[tasks.noise.varying]]
        measurement = ["y2"]
        state = "x2"
        center = 1.0
        coefficient = 0.3
"#;

fn planned(problem: &Problem, phi: &[f64]) -> TaskState {
    let task = &problem.tasks[0];
    let mut state = TaskState::new(task);
    state.evaluate(task, phi, &problem.planning, None).unwrap();
    state
}

/// Worst errors of all gradients of a problem, which must pass.
fn assert_gradients(problem: &Problem, phi: &[f64]) {
    let report = check(problem, phi).unwrap();
    let gradients = report.tasks[0].rows.iter().filter(|row| row.name.contains("gradient")).count();
    assert!(gradients >= 8, "frozen and total gradients are there: {gradients}");
    for row in &report.tasks[0].rows {
        assert!(row.passed, "{row:?}");
    }
}

/// Total gradients, in which the trajectory moves towards or away from where it is seen best, and frozen ones.
#[test]
fn gradients_agree_with_finite_differences() {
    for seen in [DIAGONAL, MIXED] {
        let problem = plane(seen, LIGHT);
        assert_gradients(&problem, &problem.parameters.initial());
    }
}

/// The same where dynamics and contact are not linear: the force is measured worse the further the first mass is out.
#[test]
fn gradients_agree_on_two_masses() {
    let text = std::fs::read_to_string(common::repository("tasks/two_mass.toml")).unwrap();
    let varying = "\n[[tasks.noise.varying]]\nmeasurement = [\"force*\", \"position of m1\"]\nstate = \"x1\"\n\
                   center = 0.4\ncoefficient = \"wall_variance\"\n\n[[tasks.costs]]\nkind = \"contact_force\"";
    let with = text.replacen("\n[[tasks.costs]]\nkind = \"contact_force\"", varying, 1);
    assert_ne!(text, with);
    let problem = supple_file::parse(&with, "task.toml").unwrap();
    let mut phi = problem.parameters.initial();
    phi[problem.parameters.index("wall_variance").unwrap()] = 0.02;
    assert_gradients(&problem, &phi);
}

/// A law with coefficient 0 is no law, to the last bit; and a sequence gives what the constant would.
#[test]
fn nothing_varies_with_coefficient_zero() {
    for seen in [DIAGONAL, MIXED] {
        let problem = plane(seen, LIGHT.replace("0.3", "0.0").as_str());
        let mut phi = problem.parameters.initial();
        phi[problem.parameters.index("coefficient").unwrap()] = 0.0;
        let varying = planned(&problem, &phi);
        let mut without = problem.clone();
        without.tasks[0].noise.varying.clear();
        let plain = planned(&without, &phi);
        assert!(plain.noise.measurement.is_constant() && !varying.noise.measurement.is_constant());
        assert_eq!(varying.information, plain.information);
        assert_eq!(varying.cost, plain.cost);
    }
}

/// Along a plan, `V_jj + coefficient (x_i - center)^2`, from the file's names to the evaluation's noise.
#[test]
fn variances_follow_the_plan() {
    let problem = plane(MIXED, LIGHT);
    let phi = problem.parameters.initial();
    let state = planned(&problem, &phi);
    for t in 0..=12 {
        let x = state.plan.trajectory.states.vector(t);
        let first = 0.02 + 0.5 * (x[0] - 5.0).powi(2);
        let second = 0.05 + 0.5 * (x[0] - 5.0).powi(2) + 0.3 * (x[1] - 1.0).powi(2);
        let v = &state.noise.measurement;
        let found = [v.get(t, 0, 0), v.get(t, 1, 1), v.get(t, 0, 1)];
        assert!((found[0] - first).abs() < 1e-12 && (found[1] - second).abs() < 1e-12 && found[2] == 0.0, "{t}");
    }
}

/// The adjoint by the states, against differences of the noise itself.
#[test]
fn adjoint_by_the_states() {
    let problem = plane(MIXED, LIGHT);
    let (phi, noise_model) = (problem.parameters.initial(), &problem.tasks[0].noise);
    let mut states = Matrices::vectors(13, 2);
    let mut adjoint = Noise::zeros(2, 2);
    noise_model.clear(&mut adjoint, 12);
    for t in 0..13 {
        states.vector_mut(t).copy_from_slice(&[0.3 * t as f64, 4.0 - t as f64]);
        for i in 0..2 {
            adjoint.measurement.set(t, i, i, 1.0 + (3 * t + i) as f64);
        }
    }
    let mut joint = Matrices::zeros(13, 4, 5);
    noise_model.add_state_gradient(&phi, &states, &adjoint, &mut joint);
    let weighted = |states: &Matrices| {
        let mut noise = Noise::zeros(2, 2);
        noise_model.resolve_along(&phi, states, &mut noise).unwrap();
        let v = &noise.measurement;
        (0..13).map(|t| (0..2).map(|i| adjoint.measurement.get(t, i, i) * v.get(t, i, i)).sum::<f64>()).sum::<f64>()
    };
    for (t, i) in (0..13).flat_map(|t| [(t, 0), (t, 1)]) {
        let moved = |by: f64| {
            let mut states = states.clone();
            states.vector_mut(t)[i] += by;
            weighted(&states)
        };
        let numeric = (moved(0.5) - moved(-0.5)) / 1.0;
        assert!((joint.get(t, i, 4) - numeric).abs() < 1e-9 * (1.0 + numeric.abs()), "{t} {i}");
        assert_eq!(joint.get(t, i + 2, 4), 0.0, "controls have no part in it");
    }
}

/// In closed loop the noise is that at the true states and the filter reckons with that at its estimates: the mean cost is
/// the predicted one, and far from what noise that does not vary would cost.
#[test]
fn closed_loop_costs_what_is_predicted() {
    let problem = plane(DIAGONAL, LIGHT);
    let phi = problem.parameters.initial();
    let options = EvaluateOptions { rollouts: 200_000, seed: 3, trajectories: true, ..Default::default() };
    let at = problem.evaluate(&phi, &options).unwrap();
    let sampled = at.tasks[0].monte_carlo.as_ref().unwrap();
    let off = sampled.difference / sampled.cost_standard_error;
    assert!(off.abs() < 4.0, "{off} standard errors off");

    let mut without = problem.clone();
    without.tasks[0].noise.varying.clear();
    let plain = without.evaluate(&phi, &EvaluateOptions::default()).unwrap();
    let apart = (at.tasks[0].cost.expected - plain.tasks[0].cost.expected) / sampled.cost_standard_error;
    assert!(apart > 10.0, "only {apart} standard errors apart: the test could not fail");

    // The filter's own deviations: near the plan's, and not those without what varies.
    let deviations =
        |state: &TaskState| -> Vec<f64> { (0..=12).map(|t| state.belief.corrected.get(t, 0, 0).sqrt()).collect() };
    let (planned_with, planned_without) = (deviations(&planned(&problem, &phi)), deviations(&planned(&without, &phi)));
    let run = &at.tasks[0].trajectory.as_ref().unwrap().sample;
    for t in 0..=12 {
        let found = run.deviations[t][0];
        assert!((found / planned_with[t] - 1.0).abs() < 0.02, "{t}: {found} {}", planned_with[t]);
        assert!((found / planned_without[t] - 1.0).abs() > 0.04, "{t}: {found} {}", planned_without[t]);
    }
}

/// A filter that believes in another law than the true one costs more than one that knows it.
#[test]
fn wrong_beliefs_about_the_law_cost_more() {
    let problem = plane(DIAGONAL, LIGHT);
    let (task, known) = (&problem.tasks[0], problem.parameters.initial());
    let coefficient = problem.parameters.index("coefficient").unwrap();
    let mut wrong = known.clone();
    wrong[coefficient] = 0.0;
    let state = planned(&problem, &known);
    let mean = |believed: &[f64], truth: &[f64]| {
        let world = |phi| World { phi, noise: &state.noise };
        // Values of the noise along the plan are not what roll-outs use: each world has its own parameters.
        let worlds = Worlds { believed: world(believed), truth: world(truth) };
        let costs = sampled_costs(task, &state.plan, worlds, Rollouts { count: 4000, seed: 5 }).unwrap();
        costs.iter().sum::<f64>() / costs.len() as f64
    };
    let (both, deceived, dark) = (mean(&known, &known), mean(&wrong, &known), mean(&wrong, &wrong));
    assert!(deceived > 1.01 * both, "{deceived} {both}");
    assert!(dark < both, "{dark} {both}");
}

/// What is wrong with a law is told by line and key.
#[test]
fn errors_name_line_and_key() {
    let message = |from: &str, to: &str| {
        let text = format!(
            "[model]\nkind = \"two_mass\"\nmass = [1, 1]\ndamping = [1, 1]\nstiffness = [1, 100]\ncontact_smoothing = 0.01\n\
             [parameters]\nk = {{ initial = 100, bounds = [-1, 200] }}\n\
             [[tasks]]\nname = \"a\"\nsteps = 3\ntime_step = 0.01\ninitial_state = [0, 0, 0, 0, \"k\"]\n\
             noise.initial = [1, 1, 1, 1, 1]\nnoise.process = [1, 1, 1, 1, 1]\nnoise.measurement = [1, 1]\n{}\n\
             [[tasks.costs]]\nkind = \"control\"\nweight = 1\n",
            "[[tasks.noise.varying]]\nmeasurement = [\"position of m1\"]\nstate = \"x1\"\ncenter = 5.0\n\
             coefficient = 0.5\n"
                .replace(from, to)
        );
        supple_file::parse(&text, "task.toml").map(|_| ()).unwrap_err().to_string()
    };
    let wrong = [
        (
            "position of m1",
            "position of m",
            "18:16",
            "measurement[0]: no measurement is `position of m`; measurements: ",
        ),
        ("position of m1", "speed*", "18:16", "measurement[0]: no measurement fits `speed*`"),
        ("[\"position of m1\"]", "[]", "18:15", "must name at least one measurement; found an empty list"),
        ("\"x1\"", "\"x3\"", "19:9", "state: no state is `x3`; states: `x1`, `v1`, `x2`, `v2`, `xw`"),
        ("0.5", "-0.5", "21:15", "coefficient: must be at least 0, as it adds to a variance; found -0.5"),
        (
            "0.5",
            "\"k\"",
            "21:15",
            "coefficient: must be at least 0, as it adds to a variance; its parameter can be as low as -1",
        ),
        ("center", "centre", "20:1", "unknown key `centre`"),
        ("coefficient = 0.5", "", "17:1", "coefficient: is missing"),
    ];
    for (from, to, place, what) in wrong {
        let found = message(from, to);
        assert!(
            found.contains(place) && found.contains(what) && found.contains("tasks[0].noise.varying[0]"),
            "{found}"
        );
    }
}
