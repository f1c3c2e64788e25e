//! Springs, dampers and friction in joints.

use supple_kernels::Scalar;

use crate::{Numbers, Tree};

/// The rates and positions at which resisting forces are evaluated: of the current state, or at the end of an implicit step.
///
/// A spring with stiffness `k` and a damper with coefficient `b` on a coordinate at `p` give the force
/// `-k (p + lead r) - b r`, with the rate `r` of the coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Resisted<'a, S> {
    /// Rates of the degrees of freedom that the forces are linear in, rad/s or m/s: those of the state, or those at the
    /// end of the step.
    pub rates: &'a [S],
    /// How far ahead the positions are taken, s: 0, or the step.
    pub lead: S,
}

/// The forces of springs, dampers and friction in the joints on the degrees of freedom, N m or N. For a joint at
/// position `p` with velocity `v`,
///
/// ```text
/// - stiffness (p - rest) - damping v - friction v / sqrt(v^2 + smoothing^2)
/// ```
///
/// `smoothing` is the velocity, rad/s or m/s, above which friction is nearly Coulomb friction; it must exceed 0.
///
/// # Panics
/// If `q` or `v` does not have one entry per degree of freedom, or `numbers` belongs to another robot.
pub fn passive_forces<S: Scalar>(tree: &Tree, numbers: &Numbers<S>, q: &[S], v: &[S], smoothing: S) -> Vec<S> {
    passive_forces_ahead(tree, numbers, q, Resisted { rates: v, lead: S::zero() }, smoothing)
}

/// The same forces at rates `r` that may differ from the velocities, with positions extrapolated by the time `lead`:
///
/// ```text
/// - stiffness (p + lead r - rest) - damping r - friction r / sqrt(r^2 + smoothing^2)
/// ```
///
/// # Panics
/// As [`passive_forces`].
pub fn passive_forces_ahead<S: Scalar>(
    tree: &Tree,
    numbers: &Numbers<S>,
    q: &[S],
    resisted: Resisted<S>,
    smoothing: S,
) -> Vec<S> {
    let lengths = (q.len(), resisted.rates.len());
    assert_eq!(lengths, (tree.dofs(), tree.dofs()), "wrong number of positions or velocities");
    let mut forces = vec![S::zero(); tree.dofs()];
    for body in tree.bodies() {
        let joint = &numbers.joints[body.joint];
        let rate = resisted.rates[body.dof] * body.ratio;
        let position = q[body.dof] * body.ratio + body.offset + resisted.lead * rate;
        let resisting = joint.stiffness * (position - joint.rest)
            + joint.damping * rate
            + joint.friction * (rate / friction_speed(rate, smoothing));
        forces[body.dof] -= resisting * body.ratio;
    }
    forces
}

/// Decrease of the forces of [`passive_forces_ahead`] per unit of each rate, N m s/rad or N s/m: never negative.
///
/// # Panics
/// As [`passive_forces`].
pub fn passive_resistance<S: Scalar>(tree: &Tree, numbers: &Numbers<S>, resisted: Resisted<S>, smoothing: S) -> Vec<S> {
    assert_eq!(resisted.rates.len(), tree.dofs(), "wrong number of velocities");
    let mut resistance = vec![S::zero(); tree.dofs()];
    for body in tree.bodies() {
        let joint = &numbers.joints[body.joint];
        let inverse = friction_speed(resisted.rates[body.dof] * body.ratio, smoothing).recip();
        let share = smoothing * inverse;
        let friction = joint.friction * inverse * (share * share);
        resistance[body.dof] +=
            (joint.damping + resisted.lead * joint.stiffness + friction) * (body.ratio * body.ratio);
    }
    resistance
}

/// `sqrt(v^2 + smoothing^2)`
fn friction_speed<S: Scalar>(v: S, smoothing: S) -> S {
    (v * v + smoothing * smoothing).sqrt()
}
