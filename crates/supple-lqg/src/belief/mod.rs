//! Belief: the covariance of the state given the measurements, along a trajectory.

mod adjoint;
mod array;
mod batch;
mod guard;
mod kalman;
mod sequential;

pub use adjoint::solve_column;
pub use adjoint::{BeliefAdjoint, BeliefSeeds, reverse_kalman};
pub use batch::{Innovation, correct_each, predict_each};
pub use guard::mend;
pub use kalman::{Belief, kalman};
