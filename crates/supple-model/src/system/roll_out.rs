use supple_lqg::{ControlBounds, Policy};

use crate::trajectory::Trajectory;

/// How the controls of a noise-free roll-out are chosen.
///
/// Example: [`Sequence`](crate::system::Sequence).
#[derive(Clone, Copy, Debug)]
pub enum RollOut<'a> {
    /// The controls already in the trajectory, starting from its first state.
    Controls,
    /// `u = ubar + step k + K (x - xbar)`, kept within bounds, from the first state of the reference.
    Law {
        /// `xbar` and `ubar`, of as many steps as the trajectory.
        reference: &'a Trajectory,
        /// `K` and `k`.
        policy: &'a Policy,
        /// Fraction of `k` that is added.
        step: f64,
        /// Bounds that the controls are moved into.
        bounds: Option<&'a ControlBounds>,
    },
}

impl RollOut<'_> {
    /// Writes the first state of `out`, unless it is already there.
    pub fn start(&self, out: &mut Trajectory) {
        if let Self::Law { reference, .. } = self {
            out.states.vector_mut(0).copy_from_slice(reference.states.vector(0));
        }
    }

    /// Writes the control at step `t`, length m, given the state `x`, length n; unchanged if it is already given.
    #[inline(always)]
    pub fn control(&self, t: usize, x: &[f64], u: &mut [f64]) {
        let Self::Law { reference, policy, step, bounds } = self else { return };
        policy.control(t, *step, x, [reference.states.vector(t), reference.controls.vector(t)], u);
        if let Some(bounds) = bounds {
            bounds.clamp(u);
        }
    }
}

/// A roll-out one step at a time: `advance` writes the next state, given step, state and control, and returns the
/// stage cost. Returns their sum. Does not allocate.
pub(super) fn step_by_step(
    law: RollOut,
    out: &mut Trajectory,
    mut advance: impl FnMut(usize, &[f64], &[f64], &mut [f64]) -> f64,
) -> f64 {
    let (steps, n) = (out.steps(), out.states.cols());
    law.start(out);
    let mut cost = 0.0;
    for t in 0..steps {
        let (x, next) = out.states.at_and_next_mut(t);
        let x = &x[..n];
        let u = out.controls.vector_mut(t);
        law.control(t, x, u);
        cost += advance(t, x, u, &mut next[..n]);
    }
    cost
}
