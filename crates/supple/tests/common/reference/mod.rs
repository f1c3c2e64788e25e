//! What the tests share: tasks built by hand, plain matrices, and finite differences.
#![allow(dead_code, reason = "every test uses a part of it")]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test stops at the first thing that is wrong")]

use std::sync::Arc;

use nalgebra::DMatrix;
use proptest::test_runner::{Config, RngSeed};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;
use supple::noise::{Covariance, NoiseModel};
use supple::parameters::{Named, Parameter, Parameters};
use supple::pipeline::TaskState;
use supple::plan::PlanSettings;
use supple::system::System;
use supple::{Matrices, Task, Value};

pub mod differences;
pub mod finger;
pub mod ring;
pub mod time_varying;
pub mod written;

/// A task of `steps` steps from given values.
pub fn task(
    system: impl System + 'static,
    steps: usize,
    initial_state: Vec<Value>,
    initial_control: &[f64],
    noise: NoiseModel,
) -> Task {
    Task {
        name: "test".into(),
        steps,
        time_step: system.time_step().cloned().unwrap_or(Value::Number(1.0)),
        bound: None,
        information_weight: 1.0,
        initial_state,
        initial_control: vec![numbers(initial_control)],
        known_controls: None,
        control_bounds: None,
        noise,
        set: Named::default(),
        doubts: Vec::new(),
        doubtful_derivatives: Vec::new(),
        system: Arc::new(system),
    }
}

/// Plans a task from its own guess; the plan must converge.
pub fn evaluated(task: &Task, phi: &[f64]) -> TaskState {
    task.check(&parameters(phi)).unwrap();
    let mut state = TaskState::new(task);
    state.evaluate(task, phi, &PlanSettings::default(), None).unwrap();
    let plan = &state.plan;
    let ended = (plan.iterations, plan.stationarity, plan.objective, plan.steepest);
    assert!(plan.status.is_converged(), "{}: {ended:?}", plan.status);
    state
}

/// Parameters with these initial values.
pub fn parameters(phi: &[f64]) -> Parameters {
    let one = |(i, &value): (usize, &f64)| {
        Parameter::new(format!("p{i}"), value, [value - 0.5 * value.abs(), value + value.abs()])
    };
    Parameters::new(phi.iter().enumerate().map(one).collect())
}

pub fn numbers(list: &[f64]) -> Vec<Value> {
    list.iter().map(|&number| Value::Number(number)).collect()
}

pub fn full(covariance: &DMatrix<f64>) -> Covariance {
    Covariance::Full(
        covariance.row_iter().map(|row| row.iter().map(|&number| Value::Number(number)).collect()).collect(),
    )
}

/// Matrix `index`, without padding.
pub fn dense(matrices: &Matrices, index: usize) -> DMatrix<f64> {
    DMatrix::from_fn(matrices.rows(), matrices.cols(), |i, j| matrices.get(index, i, j))
}

/// A number between -1 and 1.
pub fn random(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 * 2f64.powi(-52) - 1.0
}

pub fn random_matrix(rng: &mut ChaCha8Rng, rows: usize, cols: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rows, cols, |_, _| random(rng))
}

/// A positive definite matrix with eigenvalues above `least`.
pub fn random_covariance(rng: &mut ChaCha8Rng, order: usize, least: f64) -> DMatrix<f64> {
    let factor = random_matrix(rng, order, order);
    &factor * factor.transpose() + DMatrix::identity(order, order) * least
}

/// Fills all entries, padding left out.
pub fn fill_random(rng: &mut ChaCha8Rng, matrices: &mut Matrices) {
    for t in 0..matrices.count() {
        for i in 0..matrices.rows() {
            for j in 0..matrices.cols() {
                matrices.set(t, i, j, random(rng));
            }
        }
    }
}

/// Largest difference of two lists, relative to the largest entry of the second.
pub fn relative_error(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().fold(f64::MIN_POSITIVE, |largest, value| largest.max(value.abs()));
    let error = found
        .iter()
        .zip(expected)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, |worst: f64, error| if error.is_nan() { f64::INFINITY } else { worst.max(error) });
    error / largest
}

#[track_caller]
pub fn assert_near(what: &str, found: f64, expected: f64, tolerance: f64) {
    let error = relative_error(&[found], &[expected]);
    assert!(error <= tolerance, "{what}: {found} instead of {expected}, off by {error:.1e}");
}

#[track_caller]
pub fn assert_matrix_near(what: &str, found: &DMatrix<f64>, expected: &DMatrix<f64>, tolerance: f64) {
    let error = relative_error(found.as_slice(), expected.as_slice());
    assert!(error <= tolerance, "{what}: {found} instead of {expected}, off by {error:.1e}");
}

/// The same random cases in every run, unless `PROPTEST_RNG_SEED` says otherwise.
pub fn cases(cases: u32) -> Config {
    let config = Config { failure_persistence: None, ..Config::with_cases(cases) };
    let rng_seed = match config.rng_seed {
        RngSeed::Random => RngSeed::Fixed(1),
        fixed => fixed,
    };
    Config { rng_seed, ..config }
}
