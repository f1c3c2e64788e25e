//! The interface to solvers: a model and its costs as plain functions of `f64` with all derivatives, over batches.
//!
//! [`Authored`] implements it for every [`Model`](crate::Model) by differentiation, and [`Sequence`] for arrays of
//! matrices. A system whose derivatives come from elsewhere implements [`System`] itself.

use supple_kernels::{Matrices, Scratch};
use supple_lqg::{Dimensions, KnotAdjoints};

use crate::contacts::{Contact, ContactState, WantedDepth, WantedForce};
use crate::cost::Target;
use crate::document::Unfit;
use crate::followed::FollowedNumber;
use crate::parameters::Parameters;
use crate::scene::Seen;
use crate::trajectory::Trajectory;
use crate::{Channels, Limit, Value};

mod arrays;
mod authored;
mod authored_constraints;
mod authored_substeps;
mod batch;
mod constraints;
mod convex;
mod excess_next;
mod hold;
mod kept;
mod next;
mod products;
mod programs;
mod roll_out;
mod second;
mod sequence;
mod substeps;
mod trace;

pub use crate::trajectory::{Points, Times};
pub use arrays::Arrays;
pub use authored::Authored;
pub use batch::Variation;
pub use constraints::add_excess;
pub use constraints::{Constraints, ExcessVariation, KeptEnd};
pub use convex::make_convex;
pub use hold::holding_controls;
pub use products::CurvatureProducts;
pub use roll_out::RollOut;
pub use sequence::Sequence;

/// Which second derivatives of the cost are taken.
///
/// Example: [`Sequence`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Curvature {
    /// Those of the norm alone: never indefinite, for use in iterations. For a cost without a norm, the full ones, made
    /// convex by [`make_convex`].
    GaussNewton,
    /// All of them.
    #[default]
    Exact,
}

/// Adjoints of knots, with the curvature of the cost in those knots.
#[derive(Clone, Copy, Debug)]
pub struct Adjoints<'a> {
    /// The adjoints.
    pub knots: &'a KnotAdjoints,
    /// Which second derivatives of the cost the knots have.
    pub curvature: Curvature,
}

/// A controlled system with costs and all derivatives that planning and design need.
///
/// `phi` holds all parameters, `t` is the step, from 0; matrices are those of [`Matrices`], `z = (x, u)`. Functions may
/// differ from step to step. Methods write every entry that can be non-zero and rely on the others being zero, so an
/// output must be used with one system only.
///
/// Functions of single points are used where points arrive one by one. Batches and roll-outs are separate methods, so
/// that a system can do better than looping over its points.
///
/// Example: the [front page](crate).
pub trait System: Send + Sync {
    /// Lengths of state, control and measurement.
    fn dimensions(&self) -> Dimensions;

    /// Checks what an author gave: costs that do not fit the model, or have numbers that no cost can have.
    ///
    /// # Errors
    /// What is wrong, below the table of a task.
    fn check(&self, _parameters: &Parameters) -> Result<(), Unfit> {
        Ok(())
    }

    /// Its time step; `None` if it is not known.
    fn time_step(&self) -> Option<&Value> {
        None
    }

    /// The number of parameters that it was made for: at most those of the problem.
    fn parameters(&self) -> usize {
        0
    }

    /// Names of the states.
    fn state_names(&self) -> Vec<String>;

    /// What the numbers of state, control and measurement are, for people.
    fn channels(&self) -> Channels {
        Channels::plain(self.state_names(), self.dimensions())
    }

    /// Limits of states and controls of the real robot.
    fn limits(&self) -> Vec<Limit> {
        Vec::new()
    }

    /// Its contacts; empty if it has none, or they are not known.
    fn contacts(&self) -> Vec<Contact> {
        Vec::new()
    }

    /// The contacts at a state, in the order of [`System::contacts`].
    fn contact_states(&self, _x: &[f64], _phi: &[f64]) -> Vec<ContactState> {
        Vec::new()
    }

    /// The contact forces that costs request.
    fn wanted_forces(&self, _phi: &[f64]) -> Vec<WantedForce> {
        Vec::new()
    }

    /// The depths of contacts, at their surface or inside, that costs request.
    fn wanted_depths(&self, _phi: &[f64]) -> Vec<WantedDepth> {
        Vec::new()
    }

    /// Its picture at a point; `None` if it cannot be drawn.
    fn picture(&self, _x: &[f64], _u: &[f64], _phi: &[f64]) -> Option<Seen> {
        None
    }

    /// The number of steps N; `None` if unlimited.
    fn steps(&self) -> Option<usize> {
        None
    }

    /// Which parameters any of the functions depend on.
    fn depends_on(&self, parameters: usize) -> Vec<bool>;

    /// `next = f(x, u)` at step t = 0..N-1.
    fn step(&self, t: usize, x: &[f64], u: &[f64], phi: &[f64], next: &mut [f64]);

    /// `next = f(x, u)`; returns the stage cost `l(x, u)`, both at step t = 0..N-1.
    fn advance(&self, t: usize, x: &[f64], u: &[f64], phi: &[f64], next: &mut [f64], scratch: &mut Scratch) -> f64 {
        self.step(t, x, u, phi, next);
        self.stage_cost(t, x, u, phi, scratch)
    }

    /// `y = g(x)` at step t = 0..N.
    fn observe(&self, t: usize, x: &[f64], phi: &[f64], y: &mut [f64]);

    /// The state that each measurement equals, if every measurement is simply a state; `None` if not, or if unknown.
    fn picks(&self) -> Option<&[usize]> {
        None
    }

    /// The stage cost `l(x, u)` at step t = 0..N-1.
    fn stage_cost(&self, t: usize, x: &[f64], u: &[f64], phi: &[f64], scratch: &mut Scratch) -> f64;

    /// The final cost `l_N(x)`.
    fn final_cost(&self, x: &[f64], phi: &[f64], scratch: &mut Scratch) -> f64;

    /// Names of the terms of the cost; empty if they are not available separately.
    fn cost_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// The terms of the cost at a stage, or at the end, in the order of [`System::cost_names`].
    fn cost_terms(&self, _x: &[f64], _u: &[f64], _phi: &[f64], _last: bool) -> Vec<f64> {
        Vec::new()
    }

    /// The numbers that costs weigh at `phi`, and what they should be; empty if they are not known.
    fn targets(&self, _phi: &[f64]) -> Vec<Target> {
        Vec::new()
    }

    /// Those numbers at a point, in the order of [`System::targets`].
    fn weighed(&self, _x: &[f64], _u: &[f64], _phi: &[f64]) -> Vec<f64> {
        Vec::new()
    }

    /// The numbers recorded along plans at `phi`: of quantities in costs, limits and curves.
    fn followed(&self, _phi: &[f64]) -> Vec<FollowedNumber> {
        Vec::new()
    }

    /// These numbers at a point, in the same order; those that depend on the control are meaningless at the end.
    fn follow(&self, _x: &[f64], _u: &[f64], _phi: &[f64]) -> Vec<f64> {
        Vec::new()
    }

    /// The numbers with limits among these, in their order, at every stage: vectors of as many. For systems with
    /// [sub-steps](System::substeps), the time step is one of `parts` equal parts of theirs.
    fn follow_limited(&self, _parts: usize, at: Points, phi: &[f64], out: &mut Matrices, _: &mut Scratch) {
        let limited: Vec<bool> = self.followed(phi).iter().map(FollowedNumber::is_limited).collect();
        for i in 0..at.stages {
            let all = self.follow(at.states.vector(i), at.controls.vector(i), phi);
            let found = all.into_iter().zip(&limited).filter(|(_, limited)| **limited);
            out.vector_mut(i).iter_mut().zip(found).for_each(|(to, (value, _))| *to = value);
        }
    }

    /// The limits that plans enforce; `None` if there are none.
    fn constraints(&self) -> Option<&dyn Constraints> {
        None
    }

    /// `f(x, u)` at every stage, vectors of length n.
    fn step_all(&self, at: Points, phi: &[f64], next: &mut Matrices, _: &mut Scratch) {
        for i in 0..at.stages {
            self.step(at.times.of(i), at.states.vector(i), at.controls.vector(i), phi, next.vector_mut(i));
        }
    }

    /// The state after the first of `parts` equal parts of a step, for systems with [sub-steps](System::substeps): each
    /// of its integration steps is so many times shorter. Other systems return NaN to signal that they have none.
    fn step_part(&self, _parts: usize, _: Points, _phi: &[f64], next: &mut Matrices, _: &mut Scratch) {
        next.as_mut_slice().fill(f64::NAN);
    }

    /// [`System::step_all`] in `parts` equal [parts](System::step_part).
    fn step_all_in(&self, parts: usize, at: Points, phi: &[f64], next: &mut Matrices, scratch: &mut Scratch) {
        self.step_part(parts, at, phi, next, scratch);
        let mut from = next.clone();
        for _ in 1..parts {
            from.copy_from(next);
            self.step_part(parts, Points { states: &from, ..at }, phi, next, scratch);
        }
    }

    /// `g(x)` at every state, vectors of length p.
    fn observe_all(&self, at: Points, phi: &[f64], y: &mut Matrices, _: &mut Scratch) {
        for i in 0..at.count() {
            self.observe(at.times.of(i), at.states.vector(i), phi, y.vector_mut(i));
        }
    }

    /// `l(x, u)` at every stage: as many numbers.
    fn stage_costs(&self, at: Points, phi: &[f64], out: &mut [f64], scratch: &mut Scratch) {
        for (i, out) in out.iter_mut().enumerate().take(at.stages) {
            *out = self.stage_cost(at.times.of(i), at.states.vector(i), at.controls.vector(i), phi, scratch);
        }
    }

    /// `l_N(x)` at states that are all ends: as many numbers.
    fn final_costs(&self, states: &Matrices, phi: &[f64], out: &mut [f64], scratch: &mut Scratch) {
        for (i, out) in out.iter_mut().enumerate() {
            *out = self.final_cost(states.vector(i), phi, scratch);
        }
    }

    /// Fills `out` with the noise-free trajectory from step 0 on under `law`; returns its cost.
    fn roll_out(&self, law: RollOut, phi: &[f64], out: &mut Trajectory, scratch: &mut Scratch) -> f64 {
        let cost = roll_out::step_by_step(law, out, |t, x, u, next| self.advance(t, x, u, phi, next, scratch));
        cost + self.final_cost(out.states.vector(out.steps()), phi, scratch)
    }

    /// `[A B] = [f_x f_u]` at every stage: n x (n + m).
    fn dynamics_jacobians(&self, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch);

    /// The Jacobians of [`System::step_all_in`].
    fn dynamics_jacobians_in(&self, _parts: usize, _: Points, _phi: &[f64], out: &mut Matrices, _: &mut Scratch) {
        out.as_mut_slice().fill(f64::NAN);
    }

    /// `[A B]` at one point at step t if the time step were `time_step`, s: one matrix, n x (n + m). `None` if this is not
    /// available.
    fn dynamics_jacobian_with(
        &self,
        _t: usize,
        _x: &[f64],
        _u: &[f64],
        _phi: &[f64],
        _time_step: f64,
    ) -> Option<Matrices> {
        None
    }

    /// Number of integration steps per time step, if tasks can choose it.
    fn substeps(&self) -> Option<usize> {
        None
    }

    /// The same system with wider and softer contacts, and friction that builds up over higher speeds, so that
    /// planning senses contacts at a distance. It has three additional parameters at the end: the length by which
    /// contacts are wider, m, the speed by which friction is, m/s or rad/s, and how many times longer its steps are, each
    /// of which costs as many times more. `None` if there are neither contacts nor friction.
    fn widened(&self) -> Option<&dyn System> {
        None
    }

    /// The same system with a cost that draws plans to those contacts of which costs want a force at `phi`, on the squared
    /// distance from touching, m^2, at every step. Its weight is an additional parameter at the end. `None` if there are no
    /// such contacts.
    fn drawn_to_contacts(&self, _phi: &[f64]) -> Option<Box<dyn System>> {
        None
    }

    /// Whether time steps several times as long give nearly the same motion.
    fn endures_longer_steps(&self) -> bool {
        false
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

    /// The second derivatives of the Lagrangian `l + lambda' f`, and the gradient of `l` alone: the exact
    /// [`System::cost_quadratics`] plus what [`System::add_dynamics_curvature`] adds.
    fn lagrangian_quadratics(
        &self,
        at: Points,
        phi: &[f64],
        costates: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        self.cost_quadratics(at, phi, Curvature::Exact, out, scratch);
        self.add_dynamics_curvature(at, phi, costates, out, scratch);
    }

    /// Whether [`System::add_dynamics_curvature`] takes as long as several linearisations.
    fn has_costly_curvature(&self) -> bool {
        false
    }

    /// Multiplies second derivatives of `lambda_{t+1}' f` with vectors; provided if computing all of them is costly.
    fn curvature_products<'a>(
        &'a self,
        _at: Points<'a>,
        _phi: &'a [f64],
        _costates: &'a Matrices,
        _scratch: &mut Scratch,
    ) -> Option<CurvatureProducts<'a>> {
        None
    }

    /// Whether [`System::contract`] supports Gauss-Newton curvature, which must then be smooth in point and parameters.
    fn has_smooth_gauss_newton(&self) -> bool {
        false
    }

    /// The gradient of `sum over points of <adjoint, knot>`, the adjoints held fixed: by `z`, added to the last column
    /// of `joint` ((n + m) x (n + m + 1)), and by the parameters, added to `parameters`.
    fn contract(
        &self,
        at: Points,
        phi: &[f64],
        adjoints: Adjoints,
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
