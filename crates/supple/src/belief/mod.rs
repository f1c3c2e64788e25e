//! Belief: the covariance of the state given the measurements, along a trajectory, and the filter in the loop.

mod adjoint;
mod ekf;
mod filter;
mod guard;
pub(crate) use guard::mend;
mod kalman;
mod sequential;

pub(crate) use adjoint::solve_column;
pub use adjoint::{BeliefAdjoint, BeliefSeeds, reverse_kalman};
pub use ekf::{ExtendedKalman, FilterBatch};
pub use filter::Filter;
pub use kalman::{Belief, kalman};
