//! What sets of sensors are worth: many of few states, and of large plants while a stop is requested.
#![allow(clippy::unwrap_used)]

#[path = "common/random_problem.rs"]
#[allow(dead_code, reason = "it has problems of more kinds")]
mod random_problem;

use random_problem::Problem;
use supple_kernels::halt;
use supple_lqg::sensors::{Candidate, Goal, Limits, Plant, Selection, Worth};
use supple_lqg::{Belief, Information, Matrices, information, kalman};

/// Every measurement of a random problem as a candidate, with estimation errors that cost their squares.
fn selection((n, m, p): (usize, usize, usize), steps: usize) -> (Problem, Selection) {
    let mut problem = Problem::random((n, m, p), steps, 11);
    // Independent sensors.
    for v in &mut problem.v {
        *v = nalgebra::DMatrix::from_diagonal(&v.diagonal());
    }
    let mut value = Matrices::zeros(steps, n, n);
    (0..steps).for_each(|t| (0..n).for_each(|i| value.set(t, i, i, 2.0)));
    let candidates = (0..p).map(|row| Candidate { name: format!("y{row}"), price: 1.0, rows: vec![row] }).collect();
    let (knots, noise) = (problem.knots(), problem.noise());
    let plant = Plant { knots: &knots, noise: &noise, value: &value, fixed: 0.0, weight: 1.0 };
    let selection = Selection::new(candidates, &[plant]).unwrap();
    (problem, selection)
}

/// More measurements than states are taken in as their triangular factor.
#[test]
fn many_sensors_of_few_states_tell_what_the_filter_says() {
    let (problem, selection) = selection((3, 1, 11), 6);
    let (knots, noise) = (problem.knots(), problem.noise());
    let (mut belief, mut told) = (Belief::zeros(3, 11, 6), Information::default());
    kalman(&knots, &noise, &mut belief).unwrap();
    information(&belief, &noise, &mut told).unwrap();
    let errors: f64 =
        (0..6).flat_map(|t| (0..3).map(move |i| (t, i))).map(|(t, i)| belief.corrected.get(t, i, i)).sum();
    let found = selection.worth(&[true; 11]);
    assert!((found.cost / errors - 1.0).abs() < 1e-10, "{found:?}, not {errors}");
    assert!((found.information / told.total - 1.0).abs() < 1e-10, "{found:?}, not {}", told.total);
}

/// Whoever searches decides when to end: a stop must not make a set seem the best.
#[test]
fn a_stop_changes_no_worth() {
    let (_, selection) = selection((40, 2, 5), 4);
    let worth = |set: &[bool]| -> Worth { selection.worth(set) };
    let before = [[false; 5], [true; 5]].map(|set| worth(&set));
    halt::request(true);
    let after = [[false; 5], [true; 5]].map(|set| worth(&set));
    let best = selection.branch_and_bound(Goal::MostInformation, Limits::default(), 100, &mut || false).unwrap();
    halt::request(false);
    assert_eq!(before, after);
    assert!(best.chosen.worth.information.is_finite() && best.chosen.worth.information <= best.bound);
}
