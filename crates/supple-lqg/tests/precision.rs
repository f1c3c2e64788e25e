//! Filters of sensors of very different precision against an independent program in 120 digits (`golden/README.md`).
#![allow(clippy::unwrap_used)]

use nalgebra::DMatrix;
use serde_json::Value as Json;
use supple_kernels::Level;
use supple_lqg::dense::{dense, store};
use supple_lqg::{
    Belief, BeliefAdjoint, BeliefSeeds, Dimensions, Error, Information, KnotAdjoints, Knots, Noise,
    control_information, information, kalman, reverse_kalman,
};

fn matrix(rows: &Json) -> DMatrix<f64> {
    let rows = rows.as_array().unwrap();
    let cols = rows[0].as_array().unwrap().len();
    DMatrix::from_fn(rows.len(), cols, |i, j| rows[i][j].as_f64().unwrap())
}

fn cases() -> Vec<Json> {
    let golden: Json = serde_json::from_str(include_str!("golden/filter.json")).unwrap();
    golden.as_array().unwrap().clone()
}

fn problem(case: &Json) -> (Knots, Noise) {
    let [a, c, w, v, x0] = ["A", "C", "W", "V", "X0"].map(|key| matrix(&case[key]));
    let (steps, (p, n)) = (case["steps"].as_u64().unwrap() as usize, c.shape());
    let mut knots = Knots::zeros(Dimensions { states: n, controls: 1, measurements: p }, steps);
    for t in 0..=steps {
        store(&mut knots.measurement, t, &c);
        if t < steps {
            store(&mut knots.dynamics, t, &a);
        }
    }
    let mut noise = Noise::zeros(n, p);
    store(&mut noise.initial, 0, &x0);
    store(&mut noise.process, 0, &w);
    store(&mut noise.measurement, 0, &v);
    // A single state each, with noise of its own.
    let of = |row: usize| (0..n).find(|&j| (0..n).all(|k| c[(row, k)] == f64::from(u8::from(j == k))));
    knots.picks = (0..p).map(of).collect();
    (knots, noise)
}

/// Nats below which nothing is told.
const NOTHING: f64 = 1e-6;

/// The largest error of the total, of the covariance in units of its deviations, and of the gradient beside its largest
/// entry.
fn errors(case: &Json) -> [f64; 3] {
    let (knots, noise) = problem(case);
    let Dimensions { states: n, measurements: p, .. } = knots.dimensions;
    let mut belief = Belief::zeros(n, p, knots.steps());
    let mut found = Information::default();
    kalman(&knots, &noise, &mut belief).unwrap_or_else(|error| panic!("{}: {error}", case["name"]));
    information(&belief, &noise, &mut found).unwrap();
    let total = case["total"].as_f64().unwrap();
    // Below that, nothing is told: what is left is rounding of numbers around 1.
    let scale = total.max(NOTHING);
    for (found, expected) in found.per_step.iter().zip(case["nats"].as_array().unwrap()) {
        assert!((found - expected.as_f64().unwrap()).abs() < 1e-6 * scale, "{}: {found} {expected}", case["name"]);
    }

    let (corrected, expected) = (dense(&belief.corrected, knots.steps()), matrix(&case["corrected"]));
    let unit = |i: usize, j: usize| (expected[(i, i)] * expected[(j, j)]).sqrt();
    let entries = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let covariance =
        entries.map(|(i, j)| (corrected[(i, j)] - expected[(i, j)]).abs() / unit(i, j)).fold(0.0, f64::max);

    let mut adjoints = KnotAdjoints::zeros(knots.dimensions, knots.steps());
    let mut by_noise = Noise::zeros(n, p);
    let seeds = BeliefSeeds { information: 1.0, ..BeliefSeeds::default() };
    let mut work = BeliefAdjoint::new(n, p);
    reverse_kalman(&knots, &noise, &belief, seeds, &mut work, &mut adjoints, &mut by_noise);
    let slope = |i: usize| by_noise.measurement.get(0, i, i) * noise.measurement.get(0, i, i);
    let expected = case["by_log_variance"].as_array().unwrap();
    let largest = expected.iter().map(|v| v.as_f64().unwrap().abs()).fold(NOTHING, f64::max);
    let gradient = (0..p).map(|i| (slope(i) - expected[i].as_f64().unwrap()).abs() / largest).fold(0.0, f64::max);
    [(found.total - total).abs() / scale, covariance, gradient]
}

#[test]
fn sensors_of_very_different_precision() {
    let cases = cases();
    assert!(cases.len() > 80);
    let mut wrong = Vec::new();
    let best = Level::current();
    for level in Level::ALL.into_iter().filter(|level| level.force()) {
        for case in &cases {
            let [total, covariance, gradient] = errors(case);
            if !(total < 1e-8 && covariance < 1e-6 && gradient < 1e-6) {
                wrong.push(format!("{level:?}, {}: {total:.1e} {covariance:.1e} {gradient:.1e}", case["name"]));
            }
        }
    }
    best.force();
    assert!(wrong.is_empty(), "total, covariance, gradient:\n{}", wrong.join("\n"));
}

#[test]
fn two_sensors_of_one_state_that_once_lost_their_digits() {
    // ln 1e10 nats, of which 23.0232 were found.
    let case = &cases()[0];
    let (knots, noise) = problem(case);
    let mut belief = Belief::zeros(1, 2, 0);
    kalman(&knots, &noise, &mut belief).unwrap();
    let mut found = Information::default();
    information(&belief, &noise, &mut found).unwrap();
    assert!((found.total - 1e10f64.ln()).abs() < 1e-6, "{}", found.total);
    // What reaches the controls asks for no covariance of the innovations either.
    let policy = supple_lqg::Policy::zeros(knots.dimensions, 0);
    assert_eq!(control_information(&knots, &policy, &belief, &noise), Ok(vec![]));
}

#[test]
fn a_noise_that_is_none_is_named() {
    let (knots, mut noise) = problem(&cases()[0]);
    noise.measurement.set(0, 1, 1, -1.0);
    let found = kalman(&knots, &noise, &mut Belief::zeros(1, 2, 0));
    assert_eq!(found, Err(Error::NotPositiveDefinite { what: "the measurement covariance", step: 0 }));
}
