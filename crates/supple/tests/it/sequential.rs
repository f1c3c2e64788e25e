//! Measurements that are single states, taken one at a time, against the same taken together.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use supple::lqg::KnotAdjoints;
use supple::lqg::Knots;
use supple::lqg::Noise;
use supple::lqg::{Belief, BeliefAdjoint, BeliefSeeds, kalman, reverse_kalman};
use supple::lqg::{Information, information};
use supple::{Dimensions, Level, Matrices};

/// A system whose measurements pick states, one of them twice.
struct Setting {
    knots: Knots,
    noise: Noise,
    weights: Matrices,
}

fn setting(states: usize, picks: &[usize], steps: usize, variance: f64, seed: u64) -> Setting {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut random = || rng.next_u32() as f64 / f64::from(u32::MAX) - 0.5;
    let p = picks.len();
    let mut knots = Knots::zeros(Dimensions { states, controls: 1, measurements: p }, steps);
    for t in 0..=steps {
        for (i, &s) in picks.iter().enumerate() {
            knots.measurement.set(t, i, s, 1.0);
        }
        for i in (0..states).filter(|_| t < steps) {
            for j in 0..states {
                knots.dynamics.set(t, i, j, f64::from(u8::from(i == j)) + 0.3 * random());
            }
        }
    }
    let mut noise = Noise::zeros(states, p);
    let mut weights = Matrices::zeros(steps, states, states);
    for i in 0..states {
        noise.initial.set(0, i, i, 1.0 + random());
        // The last state is not driven by noise: W is singular.
        noise.process.set(0, i, i, if i + 1 < states { 0.1 * (1.0 + random()) } else { 0.0 });
        for t in 0..steps {
            weights.set(t, i, i, 1.0 + random());
        }
    }
    for i in 0..p {
        noise.measurement.set(0, i, i, variance * (1.0 + random()));
    }
    Setting { knots, noise, weights }
}

/// All numbers of a filter and of the way back.
fn numbers(Setting { knots, noise, weights }: &Setting) -> Vec<(&'static str, Vec<f64>)> {
    let Dimensions { states, measurements, .. } = knots.dimensions;
    let mut belief = Belief::zeros(states, measurements, knots.steps());
    kalman(knots, noise, &mut belief).unwrap();
    let mut found = Information::default();
    information(&belief, noise, &mut found).unwrap();
    let mut adjoints = KnotAdjoints::zeros(knots.dimensions, knots.steps());
    let mut back = Noise::zeros(states, measurements);
    let mut work = BeliefAdjoint::new(states, measurements);
    let seeds = BeliefSeeds { information: 0.7, weights: Some((weights, 1.3)), covariances: None };
    reverse_kalman(knots, noise, &belief, seeds, &mut work, &mut adjoints, &mut back);
    let diagonal = |m: &Matrices| (0..m.rows()).map(|i| m.get(0, i, i)).collect();
    vec![
        ("predicted covariance", belief.predicted.as_slice().to_vec()),
        ("corrected covariance", belief.corrected.as_slice().to_vec()),
        ("gain", belief.gain_transposed.as_slice().to_vec()),
        ("information", found.per_step.clone()),
        ("adjoint of the dynamics", adjoints.dynamics.as_slice().to_vec()),
        ("adjoint of W", back.process.as_slice().to_vec()),
        ("adjoint of X_0", back.initial.as_slice().to_vec()),
        ("adjoint of V", diagonal(&back.measurement)),
    ]
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    let scale = b.iter().fold(1e-300, |most: f64, v| most.max(v.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs() / scale).fold(0.0, f64::max)
}

#[test]
fn one_at_a_time_is_the_same_as_all_together() {
    let best = Level::current();
    for level in Level::ALL.into_iter().filter(|level| level.force()) {
        for (states, picks) in [(3, vec![1]), (5, vec![0, 3]), (9, vec![8, 0, 0, 4]), (16, (0..14).collect())] {
            for seed in 0..5 {
                let mut setting = setting(states, &picks, 20, 0.1, seed);
                let together = numbers(&setting);
                setting.knots.picks = Some(picks.clone());
                for ((name, one), (_, all)) in numbers(&setting).iter().zip(&together) {
                    let error = worst(one, all);
                    assert!(error < 1e-11, "{name} with {states} states, {level:?}: off by {error:.1e}");
                }
            }
        }
    }
    best.force();
}

/// With next to no noise every measured state is known as well as the sensor tells, to the last digits.
#[test]
fn nearly_perfect_sensors_keep_all_digits() {
    let picks = vec![0, 2, 3];
    let mut setting = setting(4, &picks, 50, 1e-14, 3);
    setting.knots.picks = Some(picks.clone());
    let mut belief = Belief::zeros(4, 3, 50);
    kalman(&setting.knots, &setting.noise, &mut belief).unwrap();
    for t in 0..=50 {
        for (i, &s) in picks.iter().enumerate() {
            let (before, v) = (belief.predicted.get(t, s, s), setting.noise.measurement.get(0, i, i));
            let (found, alone) = (belief.corrected.get(t, s, s), before * v / (before + v));
            // The other sensors tell of it as well, but hardly anything beside its own.
            assert!((found / alone - 1.0).abs() < 1e-10, "state {s} at {t}: {found:e} instead of {alone:e}");
        }
    }
    assert_eq!(belief.repairs, 0);
}
