use supple_kernels::Matrices;

use crate::Dimensions;
use crate::system::{Points, Times};

/// States at steps 0 to N and controls at steps 0 to N - 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// N + 1 vectors of length n.
    pub states: Matrices,
    /// N vectors of length m.
    pub controls: Matrices,
}

impl Trajectory {
    /// Zeros over `steps` steps.
    pub fn zeros(dimensions: Dimensions, steps: usize) -> Self {
        Self {
            states: Matrices::vectors(steps + 1, dimensions.states),
            controls: Matrices::vectors(steps, dimensions.controls),
        }
    }

    /// How many steps it has.
    pub fn steps(&self) -> usize {
        self.controls.count()
    }

    /// All its points, end included, from step 0 on.
    pub fn points(&self) -> Points<'_> {
        Points {
            states: &self.states,
            controls: &self.controls,
            stages: self.steps(),
            has_end: true,
            times: Times::From(0),
        }
    }
}
