use supple_kernels::Matrices;

use crate::Dimensions;

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

/// Adjoints of a number by the entries of the knots, at every point.
#[derive(Clone, Debug)]
pub struct KnotAdjoints {
    /// By `[A B]`, n x (n + m), stages.
    pub dynamics: Matrices,
    /// By `C`, p x n, stages and end.
    pub measurement: Matrices,
    /// By the second derivatives of the cost, symmetric, (n + m) x (n + m + 1) with an unused last column.
    pub cost: Matrices,
    /// Whether any adjoint by the cost's second derivatives may be non-zero.
    pub has_cost: bool,
}

impl KnotAdjoints {
    /// Zero adjoints for `stages` stages and an end.
    pub fn zeros(dimensions: Dimensions, stages: usize) -> Self {
        let (n, joint) = (dimensions.states, dimensions.joint());
        Self {
            dynamics: Matrices::zeros(stages, n, joint),
            measurement: Matrices::zeros(stages + 1, dimensions.measurements, n),
            cost: Matrices::zeros(stages + 1, joint, joint + 1),
            has_cost: false,
        }
    }
}

/// Variations of trajectory and costates, along which second derivatives are contracted.
#[derive(Clone, Copy, Debug)]
pub struct Variation<'a> {
    /// Of state and control together, vectors of length n + m, stages and end (where the control's part is 0).
    pub joint: &'a Matrices,
    /// Of the costates, vectors of length n; entry t belongs to the state at t.
    pub costates: &'a Matrices,
}
