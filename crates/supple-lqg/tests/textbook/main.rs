//! What the sweeps find against the same formulas as textbooks write them, in dense matrices, and against joint
//! covariances of whole trajectories.
#![allow(clippy::unwrap_used)]

#[path = "../common/random_problem.rs"]
mod random_problem;

mod control_information;
mod filter;
mod knots;
mod limits;
mod mending;
mod riccati;

use random_problem::Problem;
use supple_lqg::dense::Dense;
use supple_lqg::{Belief, Dimensions, kalman};

const SHAPES: [(usize, usize, usize); 6] = [(1, 1, 1), (3, 2, 2), (5, 1, 4), (8, 3, 3), (9, 2, 6), (17, 3, 9)];

fn assert_close(what: &str, found: &Dense, expected: &Dense, within: f64) {
    assert_eq!(found.shape(), expected.shape(), "{what}");
    let worst = (found - expected).amax();
    assert!(worst <= within * expected.amax().max(1e-300), "{what}: off by {worst:e}: {found} {expected}");
}

fn log_determinant(a: &Dense) -> f64 {
    2.0 * a.clone().cholesky().unwrap().l().diagonal().map(f64::ln).sum()
}

fn believed(problem: &Problem) -> Belief {
    let Dimensions { states: n, measurements: p, .. } = problem.dimensions;
    let mut belief = Belief::zeros(n, p, problem.steps());
    kalman(&problem.knots(), &problem.noise(), &mut belief).unwrap();
    belief
}
