//! Belief: the covariance of the state given the measurements, along a trajectory.

mod adjoint;
mod array;
mod batch;
mod correction;
mod innovation;
mod kalman;
mod predict;
mod sequential;
mod state;
mod together;

pub use adjoint::{BeliefAdjoint, BeliefSeeds, reverse_kalman};
pub use batch::{SampleNoise, correct_each, predict_each};
pub(crate) use correction::Correction;
pub use innovation::{Innovation, InnovationCovariance};
pub use kalman::kalman;
pub(crate) use kalman::kalman_to_the_end;
pub use state::Belief;
pub use supple_kernels::rows::solve_column;
