//! Models written down as tapes, against the same models in Rust; costs taken apart; tapes that are wrong.

use crate::common::reference;

use crate::common::reference::written::{Written, recorded, tape};
use crate::common::reference::{cases, evaluated, fill_random, finger, numbers, relative_error, task};
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use supple::cost::Cost;
use supple::gradient::Functional;
use supple::lqg::KnotAdjoints;
use supple::noise::{Covariance, NoiseModel};
use supple::plan::PlanSettings;
use supple::quantity::{ContactForce, Control, State};
use supple::system::{Adjoints, Authored, Curvature, System, Variation};
use supple::{
    Instruction, Matrices, Model, ParameterHandle, Point, Recorded, Scalar, Scratch, Tape, TapeError, TapeParts,
    Trajectory, TwoMass, Value,
};

/// Every function and derivative of a system at random points.
pub fn everything(system: &dyn System, phi: &[f64], seed: u64) -> Vec<(&'static str, Vec<f64>)> {
    let (size, stages) = (system.dimensions(), 11);
    let (n, joint) = (size.states, size.joint());
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut points = Trajectory::zeros(size, stages);
    let mut costates = Matrices::vectors(stages + 1, n);
    let mut variation = (Matrices::vectors(stages + 1, joint), Matrices::vectors(stages + 1, n));
    let mut adjoints = KnotAdjoints::zeros(size, stages);
    adjoints.has_cost = true;
    for matrices in [
        &mut points.states,
        &mut points.controls,
        &mut costates,
        &mut variation.0,
        &mut variation.1,
        &mut adjoints.dynamics,
        &mut adjoints.measurement,
    ] {
        fill_random(&mut rng, matrices);
    }
    for t in 0..=stages {
        (0..joint).for_each(|i| adjoints.cost.set(t, i, i, 0.3 + i as f64));
    }
    variation.0.vector_mut(stages)[n..].fill(0.0);
    let (at, scratch) = (points.points(), &mut Scratch::new());
    let mut found = Vec::new();
    let (mut next, mut y) = (vec![0.0; n], vec![0.0; size.measurements]);
    let (x, u) = (points.states.vector(0), points.controls.vector(0));
    let cost = system.advance(0, x, u, phi, &mut next, scratch);
    system.observe(0, x, phi, &mut y);
    found.push(("values", [next, y, vec![cost, system.final_cost(x, phi, scratch)]].concat()));
    let mut dynamics = Matrices::zeros(stages, n, joint);
    system.dynamics_jacobians(at, phi, &mut dynamics, scratch);
    found.push(("[A B]", dynamics.as_slice().to_vec()));
    let mut measurement = Matrices::zeros(stages + 1, size.measurements, n);
    system.measurement_jacobians(at, phi, &mut measurement, scratch);
    found.push(("C", measurement.as_slice().to_vec()));
    let mut quadratics = Matrices::zeros(stages + 1, joint, joint + 1);
    for (name, curvature) in [("Gauss-Newton", Curvature::GaussNewton), ("exact", Curvature::Exact)] {
        system.cost_quadratics(at, phi, curvature, &mut quadratics, scratch);
        found.push((name, quadratics.as_slice().to_vec()));
    }
    system.add_dynamics_curvature(at, phi, &costates, &mut quadratics, scratch);
    found.push(("dynamics' curvature", quadratics.as_slice().to_vec()));
    let mut lagrangian = Matrices::zeros(stages + 1, joint, joint + 1);
    system.lagrangian_quadratics(at, phi, &costates, &mut lagrangian, scratch);
    found.push(("Lagrangian", lagrangian.as_slice().to_vec()));
    let mut gradient = vec![0.0; phi.len()];
    for (name, curvature) in [("Gauss-Newton contraction", Curvature::GaussNewton), ("contraction", Curvature::Exact)] {
        let adjoints = Adjoints { knots: &adjoints, curvature };
        system.contract(at, phi, adjoints, &mut quadratics, &mut gradient, scratch);
        found.push((name, [quadratics.as_slice(), &gradient].concat()));
    }
    let along = Variation { joint: &variation.0, costates: &variation.1 };
    for variation in [None, Some(along)] {
        system.add_parameter_gradient(at, phi, &costates, variation, &mut gradient, scratch);
        found.push(("parameters", gradient.clone()));
    }
    found
}

proptest! {
    #![proptest_config(cases(16))]

    /// The same operations in the same order are the same graph, but for what is fused.
    #[test]
    fn written_down_a_model_has_the_same_derivatives(phi in finger::design(), seed in any::<u64>()) {
        let costs = finger::costs();
        let model = recorded(&finger::Finger, &costs, phi.len());
        let time_step = ParameterHandle::at(finger::parameter::TIME_STEP);
        let written = Authored::new(model, Vec::new(), time_step, phi.len());
        prop_assert_eq!(written.depends_on(phi.len()), finger::system().depends_on(phi.len()));
        let pairs = everything(&written, &phi, seed).into_iter().zip(everything(&finger::system(), &phi, seed));
        for ((what, found), (_, expected)) in pairs {
            let error = relative_error(&found, &expected);
            prop_assert!(error < 1e-12, "{} is off by {:.1e}", what, error);
        }
    }
}

const DESIGN: [f64; 2] = [500.0, 500.0];

fn two_mass() -> TwoMass {
    TwoMass {
        mass: [0.8, 0.4].map(Value::Number),
        damping: [60.0, 35.0].map(Value::Number),
        stiffness: [0, 1].map(|index| ParameterHandle::at(index).into()),
        contact_smoothing: Value::Number(0.01),
    }
}

fn two_mass_costs() -> Vec<Cost> {
    vec![
        Cost::new(ContactForce::new(0).with_smoothing(Value::Number(0.1)), 0.05).with_targets([10.0]),
        Cost::new(State::new([1, 3]), 0.1),
        Cost::new(Control::all(1), 1e-4),
    ]
}

/// The numbers of `tasks/two_mass.toml`.
fn press(system: impl System + 'static) -> supple::Task {
    let noise = NoiseModel {
        initial: Covariance::diagonal([1e-3, 1e-3, 1e-3, 1e-3, 1e-4]),
        process: Covariance::diagonal([1e-7, 5e-3, 1e-7, 1e-2, 0.0]),
        measurement: Covariance::diagonal([1e-3, 1e-2]),
        varying: Vec::new(),
    };
    task(system, 125, numbers(&[0.0, 0.0, 0.0, 0.0, 0.75]), &[57.0], noise)
}

#[test]
fn two_mass_written_down_gives_what_two_mass_gives() {
    let dt = 0.02;
    let model = recorded(&two_mass(), &two_mass_costs(), 2);
    let text = serde_json::to_string(&model).unwrap();
    let model: Recorded = serde_json::from_str(&text).unwrap();
    assert!([false, true].iter().all(|&last| model.own_cost(last).unwrap().convex), "sums of squares");
    let built_in = press(Authored::new(two_mass(), two_mass_costs(), dt, 2));
    let written = press(Authored::new(model, Vec::new(), dt, 2));
    let [mut expected, mut found] = [&built_in, &written].map(|task| evaluated(task, &DESIGN));
    assert_eq!(found.plan.iterations, expected.plan.iterations);
    let pairs = [
        ("cost", found.cost.nominal, expected.cost.nominal),
        ("belief cost", found.cost.belief, expected.cost.belief),
        ("information", found.information.total, expected.information.total),
    ];
    for (what, found, expected) in pairs {
        reference::assert_near(what, found, expected, 1e-10);
    }
    let mut gradients = [Vec::new(), Vec::new()];
    found.total_gradient(&written, &DESIGN, Functional::INFORMATION, &mut gradients[0]).unwrap();
    expected.total_gradient(&built_in, &DESIGN, Functional::INFORMATION, &mut gradients[1]).unwrap();
    let error = relative_error(&gradients[0], &gradients[1]);
    assert!(error < 1e-8, "the total gradient of the information is off by {error:.1e}");
}

/// A double integrator with a cost.
fn cart(cost: impl Fn(&Point<Written>) -> Written) -> Recorded {
    let sizes = (2, 1, 1);
    let file = serde_json::json!({
        "channels": {
            "states": [{ "name": "place", "unit": "m" }, { "name": "speed" }],
            "controls": [{ "name": "force" }],
            "measurements": [{ "name": "y" }],
        },
        "parameters": 1,
        "step": tape(sizes, |at| vec![at.x[0] + at.time_step * at.x[1], at.x[1] + at.time_step * at.u[0]]),
        "observe": tape(sizes, |at| vec![at.x[0]]),
        "cost": tape(sizes, |at| vec![cost(at)]),
        "final_cost": null,
    });
    serde_json::from_value(file).unwrap()
}

/// Both curvatures of a cost at (0.7, -0.4), 0.3 with the parameter 2: `[xx, xv, xu, vv, vu, uu]`.
fn curvatures(model: Recorded) -> [[f64; 6]; 2] {
    let system = Authored::new(model, Vec::new(), Value::Number(0.1), 1);
    let mut points = Trajectory::zeros(system.dimensions(), 1);
    points.states.vector_mut(0).copy_from_slice(&[0.7, -0.4]);
    points.controls.vector_mut(0)[0] = 0.3;
    let mut out = Matrices::zeros(2, 3, 4);
    [Curvature::GaussNewton, Curvature::Exact].map(|curvature| {
        system.cost_quadratics(points.points(), &[2.0], curvature, &mut out, &mut Scratch::new());
        [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|(i, j)| out.get(0, i, j))
    })
}

fn assert_curvature(found: [f64; 6], expected: [f64; 6]) {
    let error = relative_error(&found, &expected);
    assert!(error < 1e-12, "{found:?} instead of {expected:?}");
}

#[test]
fn squares_have_gauss_newton_curvature() {
    // 3 sin(x)^2 + u^2, the weight inside: 3 cos^2 x instead of 3 cos 2x.
    let cost = |at: &Point<Written>| {
        let sin = at.x[0].sin();
        (sin * 3.0) * sin + at.u[0] * at.u[0]
    };
    let model = cart(cost);
    assert!(model.own_cost(false).unwrap().convex);
    let [gauss_newton, exact] = curvatures(model);
    assert_curvature(gauss_newton, [6.0 * 0.7f64.cos().powi(2), 0.0, 0.0, 0.0, 0.0, 2.0]);
    assert_curvature(exact, [6.0 * 1.4f64.cos(), 0.0, 0.0, 0.0, 0.0, 2.0]);
}

#[test]
fn smoothed_lengths_have_gauss_newton_curvature() {
    // sqrt(r^2 + v^2 + s^2) - s with r = sin x - 1.
    let cost = |at: &Point<Written>| {
        let (r, v, s) = (at.x[0].sin() - 1.0, at.x[1], Written::constant(0.5));
        (r * r + v * v + s * s).sqrt() - s
    };
    let model = cart(cost);
    assert!(model.own_cost(false).unwrap().convex);
    let (r, slope, v) = (0.7f64.sin() - 1.0, 0.7f64.cos(), -0.4);
    let d = (r * r + v * v + 0.25_f64).sqrt();
    let third = d.powi(3);
    let expected =
        [(d * d - r * r) / third * slope * slope, -r * v / third * slope, 0.0, (d * d - v * v) / third, 0.0, 0.0];
    assert_curvature(curvatures(model)[0], expected);
}

#[test]
fn quadratic_forms_are_recognised_with_and_without_parameters() {
    // r' Q r with r = (sin x, v) and off-diagonal weights; the parameter's sign is not known.
    let cost = |at: &Point<Written>| {
        let (r, v, weight) = (at.x[0].sin(), at.x[1], at.phi[0]);
        r * (r * weight + v * 0.5) + v * (r * 0.5 + v * 3.0)
    };
    let model = cart(cost);
    assert!(!model.own_cost(false).unwrap().convex);
    let slope = 0.7f64.cos();
    assert_curvature(curvatures(model)[0], [4.0 * slope * slope, slope, 0.0, 6.0, 0.0, 0.0]);
}

#[test]
fn other_costs_are_made_convex_where_they_are_not() {
    // u^2 keeps its curvature beside the saddle x v, of which (x + v)^2 / 4 is left.
    let model = cart(|at| at.u[0] * at.u[0] + at.x[0] * at.x[1]);
    assert!(!model.own_cost(false).unwrap().convex);
    let [gauss_newton, exact] = curvatures(model);
    assert_curvature(gauss_newton, [0.5, 0.5, 0.0, 0.5, 0.0, 2.0]);
    assert_curvature(exact, [0.0, 1.0, 0.0, 0.0, 0.0, 2.0]);
    // And where it is convex it stays what it is: exp(x) twice, once in a square.
    let [found, _] = curvatures(cart(|at| at.x[0].exp() + at.x[0].exp().square() * 0.5));
    let power = 0.7f64.exp();
    assert_curvature(found, [power + power * power, 0.0, 0.0, 0.0, 0.0, 0.0]);
}

#[test]
fn constant_and_linear_costs_have_no_curvature() {
    assert_eq!(curvatures(cart(|at| at.phi[0].exp())), [[0.0; 6]; 2]);
    let [found, exact] = curvatures(cart(|at| at.x[0] * at.phi[0] - at.u[0]));
    assert_eq!((found, exact), ([0.0; 6], [0.0; 6]));
}

/// A cost without a norm plans, too, and its gradients are those of the task planned anew.
#[test]
fn plans_with_a_cost_that_is_no_sum_of_squares() {
    let lobes = |at: &Point<Written>| {
        let (x, v, u) = (at.x[0], at.x[1], at.u[0]);
        Written::one() * 2.0 - (x * at.phi[0]).cos() * 2.0 + v * v * 0.1 + u * u * 0.01 + u * v * 0.02
    };
    let system = Authored::new(cart(lobes), Vec::new(), Value::Number(0.1), 1);
    let noise = NoiseModel {
        initial: Covariance::diagonal([1e-3, 1e-3]),
        process: Covariance::diagonal([1e-5, 1e-4]),
        measurement: Covariance::diagonal([1e-3]),
        varying: Vec::new(),
    };
    // The first guess stays where the cost is concave.
    let task = task(system, 60, numbers(&[1.2, 0.0]), &[0.0], noise);
    let mut state = evaluated(&task, &[2.0]);
    let end = state.plan.trajectory.states.vector(60)[0];
    assert!((2.0 * end).cos() > 0.999, "{end} is in none of the lobes");
    assert!(state.plan.iterations < PlanSettings::default().max_iterations / 4, "{}", state.plan.iterations);
    for (name, error) in reference::differences::total_gradient_errors(&task, &mut state, &[2.0], &[2.0]) {
        assert!(error < 1e-6, "{name}: off by {error:.1e}");
    }
}

#[test]
fn tapes_that_are_wrong_say_what_is() {
    let parts = TapeParts { states: 1, constants: vec![2.0], outputs: vec![3], ..TapeParts::default() };
    let with = |instruction| Tape::new(TapeParts { instructions: vec![instruction], ..parts.clone() });
    assert!(with(Instruction::Mul(0, 2)).is_ok());
    assert_eq!(
        with(Instruction::Mul(0, 3)).unwrap_err(),
        TapeError::Forward { instruction: 0, value: 3, available: 3 }
    );
    assert_eq!(Tape::new(parts.clone()).unwrap_err(), TapeError::Output { output: 0, value: 3, available: 3 });
    let infinite = TapeParts { constants: vec![f64::INFINITY], ..parts.clone() };
    assert!(Tape::new(infinite).unwrap_err().to_string().contains("must be finite"));
    let long = TapeParts { states: usize::MAX, controls: usize::MAX, ..parts };
    assert!(matches!(Tape::new(long), Err(TapeError::TooLong { .. })));
}

#[test]
fn models_that_do_not_fit_say_what_does_not() {
    let good = serde_json::to_value(cart(|at| at.x[0] * at.x[0])).unwrap();
    let cases = [
        ("observe", serde_json::json!(tape((2, 1, 1), |at| vec![at.u[0]])), "must not depend on the controls"),
        ("final_cost", serde_json::json!(tape((2, 1, 1), |at| vec![at.u[0]])), "reads control 1"),
        ("step", serde_json::json!(tape((2, 1, 1), |at| vec![at.x[0]])), "has 1 outputs, not 2"),
        ("cost", serde_json::json!(tape((2, 1, 0), |at| vec![at.x[0]])), "has 0 parameters, not 1"),
        ("cost", serde_json::json!(tape((3, 1, 1), |at| vec![at.x[0]])), "has 3 states, not 2"),
        ("step", serde_json::json!({ "instructions": [{ "erf": 0 }] }), "unknown variant `erf`"),
    ];
    for (key, value, message) in cases {
        let mut file = good.clone();
        file[key] = value;
        let error = serde_json::from_value::<Recorded>(file).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
}
