//! Springs, dampers and friction in joints.

use supple_kernels::Scalar;

use crate::{Numbers, Tree};

/// When the forces that resist motion act: at the state itself, or at the end of an implicit step.
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
/// `smoothing` is the velocity, rad/s or m/s, above which friction is nearly that of Coulomb; more than 0.
///
/// # Panics
/// Where `q` or `v` has not one entry by degree of freedom, or `numbers` are those of another robot.
pub fn passive_forces<S: Scalar>(tree: &Tree, numbers: &Numbers<S>, q: &[S], v: &[S], smoothing: S) -> Vec<S> {
    passive_forces_ahead(tree, numbers, (q, v), Resisted { rates: v, lead: S::zero() }, smoothing)
}

/// The same forces at other rates `r` than the velocities `v`, and with the positions a time `lead` ahead:
///
/// ```text
/// - stiffness (p + lead r - rest) - (damping + friction / sqrt(v^2 + smoothing^2)) r
/// ```
///
/// In an implicit step `v` is the [`sliding_rate`].
///
/// # Panics
/// As [`passive_forces`].
pub fn passive_forces_ahead<S: Scalar>(
    tree: &Tree,
    numbers: &Numbers<S>,
    (q, v): (&[S], &[S]),
    resisted: Resisted<S>,
    smoothing: S,
) -> Vec<S> {
    let lengths = (q.len(), v.len(), resisted.rates.len());
    assert_eq!(lengths, (tree.dofs(), tree.dofs(), tree.dofs()), "positions and velocities of other dofs");
    let mut forces = vec![S::zero(); tree.dofs()];
    for body in tree.bodies() {
        let joint = &numbers.joints[body.joint];
        let rate = resisted.rates[body.dof] * body.ratio;
        let position = q[body.dof] * body.ratio + body.offset + resisted.lead * rate;
        let resisting = joint.stiffness * (position - joint.rest)
            + joint.damping * rate
            + joint.friction * (rate / friction_speed(v[body.dof] * body.ratio, smoothing));
        forces[body.dof] -= resisting * body.ratio;
    }
    forces
}

/// By how much the forces of [`passive_forces_ahead`] fall for a unit of each rate, N m s/rad or N s/m: never negative.
///
/// # Panics
/// As [`passive_forces`].
pub fn passive_resistance<S: Scalar>(tree: &Tree, numbers: &Numbers<S>, v: &[S], lead: S, smoothing: S) -> Vec<S> {
    assert_eq!(v.len(), tree.dofs(), "velocities of other dofs");
    let mut resistance = friction_resistance(tree, numbers, v, smoothing);
    for body in tree.bodies() {
        let joint = &numbers.joints[body.joint];
        resistance[body.dof] += (joint.damping + lead * joint.stiffness) * (body.ratio * body.ratio);
    }
    resistance
}

/// The part of [`passive_resistance`] that is that of friction.
///
/// # Panics
/// As [`passive_forces`].
pub fn friction_resistance<S: Scalar>(tree: &Tree, numbers: &Numbers<S>, v: &[S], smoothing: S) -> Vec<S> {
    let mut resistance = vec![S::zero(); tree.dofs()];
    for body in tree.bodies() {
        let speed = friction_speed(v[body.dof] * body.ratio, smoothing);
        resistance[body.dof] += numbers.joints[body.joint].friction / speed * (body.ratio * body.ratio);
    }
    resistance
}

/// The friction of all joints on each degree of freedom at velocities far above the smoothing, N m or N.
///
/// # Panics
/// Where `numbers` are those of another robot.
pub fn dry_friction<S: Scalar>(tree: &Tree, numbers: &Numbers<S>) -> Vec<S> {
    let mut friction = vec![S::zero(); tree.dofs()];
    for body in tree.bodies() {
        friction[body.dof] += numbers.joints[body.joint].friction * body.ratio.abs();
    }
    friction
}

/// The rate to which friction slows a degree of freedom in a step, rad/s or m/s (theory, equation R.23): nearly
/// `rate - loss` in the direction of `rate`, and nearly 0 where `loss` is more.
///
/// `rate` is the rate at the end of the step without this friction, and `loss`, not negative, what it takes from it at most:
/// the step times the friction by the inertia. With `loss = 0` it is `rate`. `smoothing` is more than 0.
pub fn sliding_rate<S: Scalar>(rate: S, loss: S, smoothing: S) -> S {
    rate * sliding_share(friction_speed(rate, smoothing), loss, smoothing)
}

/// The share of a rate that friction leaves of it in a step: [`sliding_rate`] of what moves in several directions, whose
/// `speed` is the root of the squares of rate and `smoothing`.
pub fn sliding_share<S: Scalar>(speed: S, loss: S, smoothing: S) -> S {
    let above = speed - loss;
    let left = (above + friction_speed(above, smoothing + smoothing)) * 0.5;
    left / (left + loss)
}

/// `sqrt(v^2 + smoothing^2)`
fn friction_speed<S: Scalar>(v: S, smoothing: S) -> S {
    (v * v + smoothing * smoothing).sqrt()
}
