use supple_kernels::Matrices;

use supple_lqg::Dimensions;

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

/// A batch of points: `stages` pairs of state and control, and one state more where the batch has an end.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// States, vectors of length n.
    pub states: &'a Matrices,
    /// Controls, vectors of length m.
    pub controls: &'a Matrices,
    /// How many points have a control.
    pub stages: usize,
    /// Whether state number `stages` is the end of a trajectory, with the final cost.
    pub has_end: bool,
    /// Which step each point is at.
    pub times: Times,
}

impl Points<'_> {
    /// How many states there are.
    pub fn count(&self) -> usize {
        self.stages + usize::from(self.has_end)
    }
}

/// Which steps the points of a batch are at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Times {
    /// Point i is at this step plus i: a part of a trajectory.
    From(usize),
    /// All points are at this step: samples that run in step with one another.
    At(usize),
}

impl Times {
    /// The step that point `i` is at.
    pub fn of(self, i: usize) -> usize {
        match self {
            Self::From(first) => first + i,
            Self::At(step) => step,
        }
    }
}
