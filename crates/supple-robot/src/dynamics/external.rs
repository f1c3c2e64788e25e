//! Forces on links from outside.

use supple_kernels::Scalar;

use super::Kinematics;
use super::step::Step;
use crate::Tree;
use crate::pose::{add, cross, scale, sub};

/// A force and its torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench<S> {
    /// Torque about the origin of the frame, in its axes, N m.
    pub torque: [S; 3],
    /// Force in the axes of the frame, N.
    pub force: [S; 3],
}

impl<S: Scalar> Wrench<S> {
    /// Nothing.
    pub fn zero() -> Self {
        Self { torque: [S::zero(); 3], force: [S::zero(); 3] }
    }

    /// Both together.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self { torque: add(self.torque, other.torque), force: add(self.force, other.force) }
    }

    /// This less the other.
    pub(crate) fn minus(&self, other: &Self) -> Self {
        Self { torque: sub(self.torque, other.torque), force: sub(self.force, other.force) }
    }

    /// The wrench, `factor` times.
    pub(crate) fn scaled(&self, factor: S) -> Self {
        Self { torque: scale(factor, self.torque), force: scale(factor, self.force) }
    }

    /// The same about the origin and in the axes of the body that carries it.
    pub(crate) fn inward(&self, step: &Step<S>) -> Self {
        let force = step.inward(self.force);
        Self { torque: add(step.inward(self.torque), cross(step.origin, force)), force }
    }
}

/// What acts on each body from outside, about the body's origin in the body's axes. What acts on links of the world is
/// without effect.
pub(crate) fn on_bodies<S: Scalar>(
    tree: &Tree,
    kinematics: &Kinematics<S>,
    external: &[(usize, Wrench<S>)],
) -> Vec<Wrench<S>> {
    let mut sums = vec![Wrench::zero(); tree.bodies().len()];
    for (link, wrench) in external {
        if let Some(body) = tree.body_of(*link) {
            let place = &kinematics.bodies.links[*link];
            let force = place.rotate(wrench.force);
            let torque = add(place.rotate(wrench.torque), cross(place.position, force));
            sums[body] = sums[body].plus(&Wrench { torque, force });
        }
    }
    sums
}
