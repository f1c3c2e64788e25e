//! Memory of planning.

use std::time::Instant;

use supple_kernels::Matrices;
use supple_lqg::Dimensions;
use supple_model::Trajectory;

/// Memory that planning reuses.
///
/// Example: [`plan`](crate::plan::plan()).
#[derive(Clone, Debug)]
pub struct PlanWorkspace {
    pub(super) candidate: Trajectory,
    pub(super) hessian: Matrices,
    pub(super) guess: Matrices,
    /// When searches stop where they are; `None` if they take the time they need.
    pub(crate) deadline: Option<Instant>,
}

impl PlanWorkspace {
    /// Memory for `steps` steps.
    #[must_use]
    pub fn new(dimensions: Dimensions, steps: usize) -> Self {
        let joint = dimensions.joint();
        Self {
            candidate: Trajectory::zeros(dimensions, steps),
            hessian: Matrices::zeros(steps + 1, joint, joint + 1),
            guess: Matrices::vectors(steps, dimensions.controls),
            deadline: None,
        }
    }
}
