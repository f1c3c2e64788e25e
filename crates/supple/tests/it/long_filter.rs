//! The Kalman recursion over 100,000 steps of systems that are hard on rounding.

use crate::common::reference::{dense, random};
use nalgebra::DMatrix;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use supple::Dimensions;
use supple::lqg::Knots;
use supple::lqg::Noise;
use supple::lqg::{Belief, kalman};
use supple::lqg::{Information, information};
use supple::noise::{Covariance, NoiseModel};

const STEPS: usize = 100_000;

/// A covariance with every state in units of its own deviation, where it has any.
fn correlations(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    // Products of smaller variances are not normal numbers.
    let deviation = |i: usize| Some(covariance[(i, i)]).filter(|&variance| variance > 1e-250).map(f64::sqrt);
    DMatrix::from_fn(n, n, |i, j| match (deviation(i), deviation(j)) {
        (Some(left), Some(right)) => covariance[(i, j)] / left / right,
        _ => 0.0,
    })
}

/// A linear filter: `A` and `C` at every step, and variances.
struct Filter<'a> {
    a: &'a dyn Fn(usize) -> DMatrix<f64>,
    c: &'a dyn Fn(usize) -> DMatrix<f64>,
    x0: &'a [f64],
    w: &'a [f64],
    v: &'a [f64],
}

impl Filter<'_> {
    fn run(&self) -> (Belief, Information) {
        let (n, p) = (self.x0.len(), self.v.len());
        let mut knots = Knots::zeros(Dimensions { states: n, controls: 1, measurements: p }, STEPS);
        for t in 0..=STEPS {
            let (a, c) = ((self.a)(t), (self.c)(t));
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).filter(|_| t < STEPS) {
                knots.dynamics.set(t, i, j, a[(i, j)]);
            }
            for (i, j) in (0..p).flat_map(|i| (0..n).map(move |j| (i, j))) {
                knots.measurement.set(t, i, j, c[(i, j)]);
            }
        }
        let [initial, process, measurement] =
            [self.x0, self.w, self.v].map(|list| Covariance::diagonal(list.iter().copied()));
        let mut noise = Noise::zeros(n, p);
        NoiseModel { initial, process, measurement, varying: Vec::new() }.resolve(&[], &mut noise).unwrap();
        let mut belief = Belief::zeros(n, p, STEPS);
        kalman(&knots, &noise, &mut belief).unwrap();
        let mut found = Information::default();
        information(&belief, &noise, &mut found).unwrap();
        (belief, found)
    }

    /// Runs the filter; every covariance must be exactly symmetric, and semidefinite but for the last digits.
    fn check(&self) -> (Belief, Information) {
        let (belief, information) = self.run();
        for (name, covariances) in [("P", &belief.predicted), ("Sigma", &belief.corrected)] {
            for t in 0..=STEPS {
                let covariance = dense(covariances, t);
                assert_eq!(covariance, covariance.transpose(), "{name} at {t} is symmetric");
                let eigenvalues = covariance.symmetric_eigenvalues();
                let (least, greatest) = (eigenvalues.min(), eigenvalues.max());
                assert!(least >= -1e-14 * greatest, "{name} at {t} has eigenvalues {least:e} to {greatest:e}");
            }
        }
        for t in (0..=STEPS).step_by(10) {
            let least = correlations(&dense(&belief.corrected, t)).symmetric_eigenvalues().min();
            assert!(least >= -1e-13, "Sigma at {t}, every state by its own deviation, has the eigenvalue {least:e}");
        }
        for (t, &step) in information.per_step.iter().enumerate() {
            assert!(step >= 0.0 && step.is_finite(), "information at {t} is {step}");
        }
        (belief, information)
    }
}

/// A mass whose place and speed are uncertain, and a wall that never moves; the distance to it is measured.
fn mass_and_wall() -> (DMatrix<f64>, DMatrix<f64>) {
    let a = DMatrix::from_row_slice(3, 3, &[1.0, 0.01, 0.0, 0.0, 0.99, 0.0, 0.0, 0.0, 1.0]);
    let c = DMatrix::from_row_slice(2, 3, &[1.0, 0.0, 0.0, 1.0, 0.0, -1.0]);
    (a, c)
}

#[test]
fn constant_state_is_learned_like_one_over_the_number_of_measurements() {
    let (a, c) = mass_and_wall();
    let filter =
        Filter { a: &|_| a.clone(), c: &|_| c.clone(), x0: &[1e-2; 3], w: &[0.0, 1e-4, 0.0], v: &[1e-3, 1e-2] };
    let (belief, _) = filter.check();
    assert_eq!(belief.repairs, 0);
    let [half, last] = [STEPS / 2, STEPS].map(|t| belief.corrected.get(t, 2, 2));
    assert!((half / last - 2.0).abs() < 1e-2, "{half} and {last}");
}

#[test]
fn sensors_from_nearly_perfect_to_nearly_blind() {
    let (a, c) = mass_and_wall();
    for ratio in [1e-12, 1e-6, 1e6, 1e12] {
        let v = [ratio * 1e-2, ratio * 1e-2];
        let filter = Filter { a: &|_| a.clone(), c: &|_| c.clone(), x0: &[1e-2; 3], w: &[0.0, 1e-4, 0.0], v: &v };
        let (belief, information) = filter.check();
        assert_eq!(belief.repairs, 0, "at {ratio}");
        if ratio < 1.0 {
            assert!(information.per_step[0] > 0.9 * (1.0 / ratio).ln(), "{} at {ratio}", information.per_step[0]);
        }
    }
}

/// What a sensor leaves of the state that it measures is `P V/(P + V)`, to almost all digits even where that is tiny
/// against `P`: the Joseph form makes up for the cancellation.
#[test]
fn measured_state_keeps_its_digits() {
    let (a, c) = mass_and_wall();
    let c = c.rows(0, 1).into_owned();
    for v in [1e-6, 1e-10, 1e-14] {
        let filter = Filter { a: &|_| a.clone(), c: &|_| c.clone(), x0: &[1e-2; 3], w: &[1e-2, 1e-4, 0.0], v: &[v] };
        let (belief, _) = filter.check();
        for t in 0..=STEPS {
            let (p, sigma) = (belief.predicted.get(t, 0, 0), belief.corrected.get(t, 0, 0));
            let left = p * v / (p + v);
            assert!((sigma - left).abs() <= 1e-12 * left, "{sigma:e} instead of {left:e} at {t} with {v:e}");
        }
    }
}

#[test]
fn one_nearly_perfect_sensor_beside_a_nearly_blind_one() {
    let (a, c) = mass_and_wall();
    for v in [[1e-14, 1e10], [1e10, 1e-14]] {
        let filter = Filter { a: &|_| a.clone(), c: &|_| c.clone(), x0: &[1e-2; 3], w: &[0.0, 1e-4, 0.0], v: &v };
        let (belief, _) = filter.check();
        assert_eq!(belief.repairs, 0, "with {v:?}");
    }
}

/// Variances that die out underflow, and what rounding then leaves is mended; all else must not suffer.
#[test]
fn unstable_mode_beside_dying_and_constant_ones() {
    let a = DMatrix::from_row_slice(
        4,
        4,
        &[1.05, 0.3, 0.0, 0.1, 0.0, 0.9, 0.2, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 1.0],
    );
    let c = DMatrix::from_row_slice(2, 4, &[1.0, 0.5, -0.2, 0.0, 0.0, 0.0, 1.0, 1.0]);
    for (w, v) in [([0.0; 4], [1e-2, 1e-2]), ([0.0, 1e-6, 0.0, 0.0], [1e-10, 1.0]), ([0.0; 4], [1e-12, 1e6])] {
        let filter = Filter { a: &|_| a.clone(), c: &|_| c.clone(), x0: &[1.0, 1e-3, 1e3, 1e-2], w: &w, v: &v };
        let (_, information) = filter.check();
        let rate = information.per_step[STEPS];
        assert!(rate >= 1.05f64.ln() - 1e-9, "{rate}: at least the unstable mode's eigenvalue, with {w:?} and {v:?}");
    }
}

#[test]
fn states_of_very_different_size() {
    let scale = [1e6, 1.0, 1e-6, 1e-3];
    let plain = DMatrix::from_row_slice(
        4,
        4,
        &[0.9, 0.2, 0.1, 0.0, -0.2, 0.95, 0.0, 0.1, 0.0, 0.1, 1.02, 0.3, 0.0, 0.0, 0.0, 1.0],
    );
    let a = DMatrix::from_fn(4, 4, |i, j| plain[(i, j)] * scale[i] / scale[j]);
    let c = DMatrix::from_row_slice(2, 4, &[1.0 / scale[0], 0.0, 1.0 / scale[2], 0.0, 0.0, 1.0, 0.0, 1.0 / scale[3]]);
    let x0 = scale.map(|scale| scale * scale);
    let w = [0.0, 1e-4 * x0[1], 1e-8 * x0[2], 0.0];
    let (belief, _) = Filter { a: &|_| a.clone(), c: &|_| c.clone(), x0: &x0, w: &w, v: &[1e-8, 1e-1] }.check();
    assert_eq!(belief.repairs, 0);
}

#[test]
fn states_known_from_the_start_stay_known() {
    let (a, c) = mass_and_wall();
    let known = Filter { a: &|_| a.clone(), c: &|_| c.clone(), x0: &[0.0; 3], w: &[0.0; 3], v: &[1e-3, 1e-3] };
    let (belief, information) = known.check();
    assert!(belief.corrected.as_slice().iter().all(|&entry| entry == 0.0));
    assert_eq!((information.total, belief.repairs), (0.0, 0));
    let wall = Filter { x0: &[1e-2, 1e-2, 0.0], w: &[0.0, 1e-4, 0.0], ..known };
    let (belief, _) = wall.check();
    for t in 0..=STEPS {
        assert_eq!(belief.corrected.get(t, 2, 2), 0.0, "the wall at {t}");
    }
}

/// Undamped, without process noise, seen through a sensor that turns, doubles another and at times sees nothing.
#[test]
fn oscillator_seen_through_changing_and_redundant_sensors() {
    let (sin, cos) = 0.3f64.sin_cos();
    let a = DMatrix::from_row_slice(3, 3, &[cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0]);
    let c = |t: usize| {
        let rng = &mut ChaCha8Rng::seed_from_u64(t as u64);
        let row: Vec<f64> = (0..3).map(|_| if t.is_multiple_of(7) { 0.0 } else { random(rng) }).collect();
        let doubled: Vec<f64> = row.iter().map(|entry| entry * (1.0 + 1e-9)).collect();
        DMatrix::from_row_slice(2, 3, &[row, doubled].concat())
    };
    for v in [[1e-2, 1e-2], [1e-12, 1e-6]] {
        let filter = Filter { a: &|_| a.clone(), c: &c, x0: &[1.0, 1e-6, 1e4], w: &[0.0; 3], v: &v };
        let (belief, information) = filter.check();
        for t in (0..=STEPS).step_by(7) {
            assert_eq!(information.per_step[t], 0.0, "nothing is seen at {t}");
            assert_eq!(dense(&belief.corrected, t), dense(&belief.predicted, t));
        }
    }
}
