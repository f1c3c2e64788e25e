//! Forces from accelerations: the recursive Newton-Euler algorithm.

use supple_kernels::Scalar;

use super::external::on_bodies;
use super::inertia::Acceleration;
use super::kinematics::Moved;
use super::{Kinematics, Wrench, passive_forces};
use crate::tree::Motion;
use crate::{Numbers, Tree};

/// The generalised forces `M a + h - sum J' wrench` on the degrees of freedom required for accelerations `a`, rad/s^2 or
/// m/s^2, including inertia, Coriolis forces, gravity and external wrenches on links: N m or N. Springs, dampers and
/// friction in joints are left out; see [`passive_forces`].
///
/// `external` lists links with the external wrenches on them, about the link's origin in the link's axes.
///
/// # Panics
/// If `a` does not have one entry per degree of freedom, or `kinematics` belongs to another tree.
pub fn inverse_dynamics<S: Scalar>(
    tree: &Tree,
    numbers: &Numbers<S>,
    kinematics: &Kinematics<S>,
    a: &[S],
    external: &[(usize, Wrench<S>)],
) -> Vec<S> {
    assert_eq!(a.len(), tree.dofs(), "wrong number of accelerations");
    let moved = &kinematics.moved;
    let world = Moved::world(numbers.gravity);
    let mut accelerations: Vec<Acceleration<S>> = Vec::with_capacity(moved.len());
    for (body, moved) in tree.bodies().iter().zip(moved) {
        let parent = body.parent.map_or(world, |parent| accelerations[parent]);
        accelerations.push(moved.accelerated(body.motion, &parent, a[body.dof] * body.ratio));
    }
    let inertias = kinematics.bodies.inertias.iter().zip(&accelerations);
    let needed = inertias.map(|(inertia, acceleration)| inertia.force(acceleration));
    let outside = on_bodies(tree, kinematics, external);
    let mut forces: Vec<_> = needed.zip(&outside).map(|(needed, outside)| needed.minus(outside)).collect();
    let mut generalized = vec![S::zero(); tree.dofs()];
    for (index, body) in tree.bodies().iter().enumerate().rev() {
        let force = forces[index];
        let drive = numbers.joints[body.joint].armature * (a[body.dof] * body.ratio);
        generalized[body.dof] += (along(body.motion, &force) + drive) * body.ratio;
        if let Some(parent) = body.parent {
            forces[parent] = forces[parent].plus(&force.inward(&moved[index].step));
        }
    }
    generalized
}

/// The generalised forces `h - passive` required for zero accelerations: Coriolis forces and gravity, minus
/// [`passive_forces`] at `q`, `v` and `smoothing`. With it, `M a + bias = tau`.
///
/// # Panics
/// As [`inverse_dynamics`].
pub fn bias<S: Scalar>(
    tree: &Tree,
    numbers: &Numbers<S>,
    kinematics: &Kinematics<S>,
    q: &[S],
    v: &[S],
    smoothing: S,
) -> Vec<S> {
    let needed = inverse_dynamics(tree, numbers, kinematics, &vec![S::zero(); tree.dofs()], &[]);
    let passive = passive_forces(tree, numbers, q, v, smoothing);
    needed.into_iter().zip(passive).map(|(needed, passive)| needed - passive).collect()
}

/// The component of a wrench on a body along its joint, which the joint does not transmit.
pub(crate) fn along<S: Scalar>(motion: Motion, wrench: &Wrench<S>) -> S {
    match motion {
        Motion::Turn => wrench.torque[2],
        Motion::Slide => wrench.force[2],
    }
}
