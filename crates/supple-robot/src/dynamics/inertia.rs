//! Inertia represented by mass, first and second moments, in which all operations are linear.

use supple_kernels::Scalar;

use super::step::{Step, add_matrices, mirrored, outer, rotated_symmetric};
use super::wrench::Wrench;
use crate::pose::{add, cross, scale};
use crate::{LinkNumbers, Pose};

/// The inertia of a body in its own frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inertia<S> {
    /// Mass, kg.
    pub mass: S,
    /// First moment of mass, `sum m r`, kg m.
    pub first: [S; 3],
    /// Second moment of mass, `J = sum m r r'`, kg m^2: symmetric. Moments of inertia are `trace(J) I - J`.
    pub second: [[S; 3]; 3],
}

/// Acceleration field of a body: its point `p` accelerates by `linear + gradient p`, in the body's axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Acceleration<S> {
    /// Acceleration of the body's origin, m/s^2.
    pub linear: [S; 3],
    /// Angular acceleration, rad/s^2.
    pub angular: [S; 3],
    /// `[angular]x + [w]x [w]x` with the angular velocity `w`, 1/s^2.
    pub gradient: [[S; 3]; 3],
}

impl<S: Scalar> Acceleration<S> {
    /// The acceleration field of a body with angular velocity `w`.
    pub fn new(linear: [S; 3], angular: [S; 3], w: [S; 3]) -> Self {
        let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = outer(w, w);
        let [x, y, z] = angular;
        let gradient = [[-(yy + zz), xy - z, xz + y], [xy + z, -(xx + zz), yz - x], [xz - y, yz + x, -(xx + yy)]];
        Self { linear, angular, gradient }
    }

    /// The acceleration of the body's point `p`.
    pub fn at(&self, p: [S; 3]) -> [S; 3] {
        add(self.linear, times(self.gradient, p))
    }
}

impl<S: Scalar> Inertia<S> {
    /// No inertia.
    pub fn zero() -> Self {
        Self { mass: S::zero(), first: [S::zero(); 3], second: [[S::zero(); 3]; 3] }
    }

    /// The inertia of a link at `pose`: `J = R (trace(I_c) / 2 - I_c) R' + m c c'` with its centre `c`.
    pub fn of(link: &LinkNumbers<S>, pose: &Pose<S>) -> Self {
        let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = link.moment;
        let half = (xx + yy + zz) * 0.5;
        let central = [[half - xx, -xy, -xz], [-xy, half - yy, -yz], [-xz, -yz, half - zz]];
        let center = pose.apply(link.center);
        let first = scale(link.mass, center);
        let second = add_matrices(rotated_symmetric(pose, central), outer(first, center));
        Self { mass: link.mass, first, second: mirrored(second) }
    }

    /// The sum of both inertias.
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            mass: self.mass + other.mass,
            first: add(self.first, other.first),
            second: add_matrices(self.second, other.second),
        }
    }

    /// The same inertia in the frame of the parent body: with `g = R first` and the origin `r`,
    /// `R J R' + g r' + r g' + m r r'`.
    pub fn inward(&self, step: &Step<S>) -> Self {
        let (turned, r) = (step.inward(self.first), step.origin);
        let moved = scale(self.mass, r);
        let cross = outer(turned, r);
        let mut second = add_matrices(step.inward_symmetric(self.second), outer(add(turned, moved), r));
        for i in 0..3 {
            for j in i..3 {
                second[i][j] += cross[j][i];
            }
        }
        Self { mass: self.mass, first: add(turned, moved), second: mirrored(second) }
    }

    /// The wrench required for this acceleration: the force, and the torque about the origin.
    ///
    /// ```text
    /// force = sum m (a + W r) = m a + W first        torque = sum m r x (a + W r) = first x a + axial(W J)
    /// ```
    pub fn force(&self, motion: &Acceleration<S>) -> Wrench<S> {
        let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = self.second;
        let w = motion.gradient;
        let axial = [
            w[2][1] * yy - w[1][2] * zz + (w[2][2] - w[1][1]) * yz + (w[2][0] * xy - w[1][0] * xz),
            w[0][2] * zz - w[2][0] * xx + (w[0][0] - w[2][2]) * xz + (w[0][1] * yz - w[2][1] * xy),
            w[1][0] * xx - w[0][1] * yy + (w[1][1] - w[0][0]) * xy + (w[1][2] * xz - w[0][2] * yz),
        ];
        Wrench {
            torque: add(axial, cross(self.first, motion.linear)),
            force: add(scale(self.mass, motion.linear), times(w, self.first)),
        }
    }

    /// Moments of inertia about the origin.
    pub fn moments(&self) -> [[S; 3]; 3] {
        let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = self.second;
        [[yy + zz, -xy, -xz], [-xy, xx + zz, -yz], [-xz, -yz, xx + yy]]
    }
}

/// `A v`
pub(crate) fn times<S: Scalar>(matrix: [[S; 3]; 3], v: [S; 3]) -> [S; 3] {
    matrix.map(|row| crate::pose::dot(row, v))
}
