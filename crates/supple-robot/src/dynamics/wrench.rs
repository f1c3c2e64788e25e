//! Forces with torques.

use supple_kernels::Scalar;

use super::step::Step;
use crate::pose::{add, cross, scale, sub};

/// A force and its torque.
///
/// Example: [`inverse_dynamics`](crate::inverse_dynamics).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench<S> {
    /// Torque about the origin of the frame, in its axes, N m.
    pub torque: [S; 3],
    /// Force in the axes of the frame, N.
    pub force: [S; 3],
}

/// A wrench on a link, about the link's origin in the link's axes.
///
/// Example: [`inverse_dynamics`](crate::inverse_dynamics).
#[derive(Clone, Copy, Debug)]
pub struct LinkWrench<S> {
    /// Index of the link.
    pub link: usize,
    /// The wrench.
    pub wrench: Wrench<S>,
}

impl<S: Scalar> Wrench<S> {
    /// Nothing.
    #[must_use]
    pub fn zero() -> Self {
        Self { torque: [S::zero(); 3], force: [S::zero(); 3] }
    }

    /// Both together.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self { torque: add(self.torque, other.torque), force: add(self.force, other.force) }
    }

    /// This minus the other.
    pub(crate) fn minus(&self, other: &Self) -> Self {
        Self { torque: sub(self.torque, other.torque), force: sub(self.force, other.force) }
    }

    /// This wrench multiplied by `factor`.
    pub(crate) fn scaled(&self, factor: S) -> Self {
        Self { torque: scale(factor, self.torque), force: scale(factor, self.force) }
    }

    /// The same wrench about the origin of the parent body, in its axes.
    pub(crate) fn inward(&self, step: &Step<S>) -> Self {
        let force = step.inward(self.force);
        Self { torque: add(step.inward(self.torque), cross(step.origin, force)), force }
    }
}
