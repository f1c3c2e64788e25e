//! What solvers call: a model and its costs as plain functions of `f64` with all derivatives, over batches of points.
//!
//! [`Authored`] gives all of it for every [`Model`](crate::Model) by differentiation. A system whose derivatives come
//! from elsewhere implements [`System`] itself.

use supple_kernels::{Matrices, Scratch};

use crate::scene::Seen;
use crate::{Channels, Dimensions, Limit};

mod authored;
mod convex;
mod programs;
mod trace;

pub use authored::Authored;
pub use convex::make_convex;

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
}

impl Points<'_> {
    /// How many states there are.
    pub fn count(&self) -> usize {
        self.stages + usize::from(self.has_end)
    }
}

/// Which second derivatives of the cost are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curvature {
    /// Those of the norm alone: never indefinite, for iterating. Where a cost has no norm, those of all of it, made
    /// convex by [`make_convex`].
    GaussNewton,
    /// All of them.
    Exact,
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

/// A controlled system with costs and all derivatives that planning and design need.
///
/// `phi` holds all parameters; matrices are those of [`Matrices`], `z = (x, u)`. Methods write every entry that can
/// be non-zero and rely on the others being zero, so each output belongs to one system for its life.
pub trait System: Send + Sync {
    /// Lengths of state, control and measurement.
    fn dimensions(&self) -> Dimensions;

    /// Names of the states.
    fn state_names(&self) -> Vec<String>;

    /// What the numbers of state, control and measurement are, for people.
    fn channels(&self) -> Channels {
        Channels::plain(self.state_names(), self.dimensions())
    }

    /// What states and controls must stay within for the real thing.
    fn limits(&self) -> Vec<Limit> {
        Vec::new()
    }

    /// What it looks like at a point; none where it cannot be drawn.
    fn picture(&self, _x: &[f64], _u: &[f64], _phi: &[f64]) -> Option<Seen> {
        None
    }

    /// Which parameters any of the functions depend on.
    fn depends_on(&self, parameters: usize) -> Vec<bool>;

    /// `next = f(x, u)`.
    fn step(&self, x: &[f64], u: &[f64], phi: &[f64], next: &mut [f64]);

    /// `next = f(x, u)`; returns the stage cost `l(x, u)`.
    fn advance(&self, x: &[f64], u: &[f64], phi: &[f64], next: &mut [f64], scratch: &mut Scratch) -> f64 {
        self.step(x, u, phi, next);
        self.stage_cost(x, u, phi, scratch)
    }

    /// `y = g(x)`.
    fn observe(&self, x: &[f64], phi: &[f64], y: &mut [f64]);

    /// Which state each measurement is, where every one is just a state; none where any is not, or that is not known.
    fn picks(&self) -> Option<&[usize]> {
        None
    }

    /// The stage cost `l(x, u)`.
    fn stage_cost(&self, x: &[f64], u: &[f64], phi: &[f64], scratch: &mut Scratch) -> f64;

    /// The final cost `l_N(x)`.
    fn final_cost(&self, x: &[f64], phi: &[f64], scratch: &mut Scratch) -> f64;

    /// `[A B] = [f_x f_u]` at every stage: n x (n + m).
    fn dynamics_jacobians(&self, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch);

    /// `[A B]` at one point, were the time step `time_step`, s: one matrix, n x (n + m). None where that is not known.
    fn dynamics_jacobian_with(&self, _x: &[f64], _u: &[f64], _phi: &[f64], _time_step: f64) -> Option<Matrices> {
        None
    }

    /// Into how many steps of integration a time step is divided, where tasks can choose that.
    fn substeps(&self) -> Option<usize> {
        None
    }

    /// `C = g_x` at every state: p x n.
    fn measurement_jacobians(&self, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch);

    /// `[l_zz | l_z]` at every point: (n + m) x (n + m + 1).
    fn cost_quadratics(&self, at: Points, phi: &[f64], curvature: Curvature, out: &mut Matrices, scratch: &mut Scratch);

    /// Adds the second derivatives of `lambda_{t+1}' f` by `z` to the square part of `out` at every stage.
    fn add_dynamics_curvature(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    );

    /// The gradient of `sum over points of <adjoint, knot>`, the adjoints held fixed: by `z`, added to the last column
    /// of `joint` ((n + m) x (n + m + 1)), and by the parameters, added to `parameters`.
    fn contract(
        &self,
        at: Points,
        phi: &[f64],
        adjoints: &KnotAdjoints,
        joint: &mut Matrices,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    );

    /// Adds to `parameters` the gradient by `phi` of the Lagrangian `sum l + lambda_{t+1}' f`, or with a variation
    /// `(dz, dlambda)` the derivative of that gradient along it.
    fn add_parameter_gradient(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        variation: Option<Variation>,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    );
}
