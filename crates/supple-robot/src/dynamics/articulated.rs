//! Inertia of a body whose child bodies are free to move at their joints.

use supple_kernels::Scalar;

use super::Wrench;
use super::inertia::{Acceleration, Inertia, times};
use super::step::{Step, add_matrices, mirrored, outer};
use crate::pose::{add, cross, scale, sub};
use crate::tree::Motion;

/// Articulated inertia: the wrench required to give a body the acceleration `(angular, linear)`,
/// `torque = A angular + H linear` and `force = H' angular + L linear`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Articulated<S> {
    /// `A`, symmetric, kg m^2.
    angular: [[S; 3]; 3],
    /// `H`, kg m.
    coupling: [[S; 3]; 3],
    /// `L`, symmetric, kg.
    linear: [[S; 3]; 3],
}

/// `[a]x`, so that `[a]x b = a x b`.
fn crossing<S: Scalar>([x, y, z]: [S; 3]) -> [[S; 3]; 3] {
    let o = S::zero();
    [[o, -z, y], [z, o, -x], [-y, x, o]]
}

impl<S: Scalar> Articulated<S> {
    /// The articulated inertia of a single rigid body.
    pub fn rigid(inertia: &Inertia<S>) -> Self {
        let (m, o) = (inertia.mass, S::zero());
        let linear = [[m, o, o], [o, m, o], [o, o, m]];
        Self { angular: inertia.moments(), coupling: crossing(inertia.first), linear }
    }

    /// The sum of both inertias.
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            angular: add_matrices(self.angular, other.angular),
            coupling: add_matrices(self.coupling, other.coupling),
            linear: add_matrices(self.linear, other.linear),
        }
    }

    /// The wrench required for unit acceleration along the joint: the column of this inertia for the joint's motion.
    pub fn column(&self, motion: Motion) -> Wrench<S> {
        let column = |matrix: [[S; 3]; 3]| matrix.map(|row| row[2]);
        match motion {
            Motion::Turn => Wrench { torque: column(self.angular), force: self.coupling[2] },
            Motion::Slide => Wrench { torque: column(self.coupling), force: column(self.linear) },
        }
    }

    /// The inertia that remains when the joint is free: `I - u u' / d`, where `u` is the joint's column, `d` its entry along
    /// the joint plus the `armature`.
    ///
    /// Its component along the joint is `u armature / d`, which is a constant zero without armature.
    pub fn freed(&self, motion: Motion, u: &Wrench<S>, inverse: S, armature: S) -> Self {
        let (torque, force) = (scale(inverse, u.torque), scale(inverse, u.force));
        let less = |a: [[S; 3]; 3], b: [[S; 3]; 3]| [0, 1, 2].map(|row| sub(a[row], b[row]));
        let mut angular = less(self.angular, outer(torque, u.torque));
        let mut coupling = less(self.coupling, outer(torque, u.force));
        let mut linear = less(self.linear, outer(force, u.force));
        for i in 0..3 {
            match motion {
                Motion::Turn => (angular[i][2], coupling[2][i]) = (torque[i] * armature, force[i] * armature),
                Motion::Slide => (linear[i][2], coupling[i][2]) = (force[i] * armature, torque[i] * armature),
            }
        }
        Self { angular: mirrored(angular), coupling, linear: mirrored(linear) }
    }

    /// The wrench required for an acceleration.
    pub fn force(&self, acceleration: &Acceleration<S>) -> Wrench<S> {
        let (angular, linear) = (acceleration.angular, acceleration.linear);
        let [a, b, c] = self.coupling;
        let coupled = add(add(scale(angular[0], a), scale(angular[1], b)), scale(angular[2], c));
        Wrench {
            torque: add(times(self.angular, angular), times(self.coupling, linear)),
            force: add(coupled, times(self.linear, linear)),
        }
    }

    /// The same inertia in the frame of the parent body. With the rotated blocks and the origin `r`:
    ///
    /// ```text
    /// L_p = L        H_p = H + [r] L        A_p = A + [r] H' - H_p [r]
    /// ```
    pub fn inward(&self, step: &Step<S>) -> Self {
        let r = step.origin;
        let linear = step.inward_symmetric(self.linear);
        let turned = step.inward_matrix(self.coupling);
        // Column j of [r] L is r x (column j of L), which is row j of L.
        let lever = linear.map(|row| cross(r, row));
        let coupling = [0, 1, 2].map(|i| [0, 1, 2].map(|j| turned[i][j] + lever[j][i]));
        let mut angular = step.inward_symmetric(self.angular);
        for (i, row) in angular.iter_mut().enumerate() {
            // Row i of H_p [r] is (row i of H_p) x r, and column j of [r] H' is r x (row j of H).
            let moved = cross(coupling[i], r);
            for (j, entry) in row.iter_mut().enumerate().skip(i) {
                *entry = *entry + cross(r, turned[j])[i] - moved[j];
            }
        }
        Self { angular: mirrored(angular), coupling, linear }
    }
}
