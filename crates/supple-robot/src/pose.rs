// Loops over axes by index read like the formulas.
#![allow(clippy::needless_range_loop)]

use supple_kernels::Scalar;
use supple_kernels::math;

/// The pose of an inner frame in an outer frame: `p_outer = rotation p_inner + position`.
///
/// ```
/// use std::f64::consts::FRAC_PI_2;
///
/// use supple_robot::Pose;
///
/// // 1 m along x, and a quarter turn about z.
/// let pose = Pose::from_rpy([1.0, 0.0, 0.0], [0.0, 0.0, FRAC_PI_2]);
/// assert_eq!(pose.apply([1.0, 0.0, 0.0]), [1.0, 1.0, 0.0]);
/// assert_eq!(pose.inverse().apply([1.0, 1.0, 0.0]), [1.0, 0.0, 0.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<S = f64> {
    /// Rotation matrix, by rows.
    pub rotation: [[S; 3]; 3],
    /// Position of the inner frame's origin, m.
    pub position: [S; 3],
}

/// `a x b`
///
/// Example: the [module](crate::vector).
#[inline(always)]
pub fn cross<S: Scalar>(a: [S; 3], b: [S; 3]) -> [S; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a' b`
///
/// Example: the [module](crate::vector).
#[inline(always)]
pub fn dot<S: Scalar>(a: [S; 3], b: [S; 3]) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a + b`
///
/// Example: the [module](crate::vector).
#[inline(always)]
pub fn add<S: Scalar>(a: [S; 3], b: [S; 3]) -> [S; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a - b`
///
/// Example: the [module](crate::vector).
#[inline(always)]
pub fn sub<S: Scalar>(a: [S; 3], b: [S; 3]) -> [S; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `s a`
///
/// Example: the [module](crate::vector).
#[inline(always)]
pub fn scale<S: Scalar>(s: S, a: [S; 3]) -> [S; 3] {
    [s * a[0], s * a[1], s * a[2]]
}

/// A vector of constants over any scalar.
#[inline(always)]
pub(crate) fn constants<S: Scalar>(a: [f64; 3]) -> [S; 3] {
    [S::constant(a[0]), S::constant(a[1]), S::constant(a[2])]
}

impl<S: Scalar> Pose<S> {
    /// The pose of a frame that coincides with the outer frame.
    #[inline(always)]
    #[must_use]
    pub fn identity() -> Self {
        Pose::<f64>::IDENTITY.cast()
    }

    /// A pure translation.
    #[inline(always)]
    pub fn at(position: [S; 3]) -> Self {
        Self { position, ..Self::identity() }
    }

    /// Composes poses: `inner` is given in the inner frame of `self`; the result is in its outer frame.
    #[inline(always)]
    #[must_use]
    pub fn compose(&self, inner: &Self) -> Self {
        let mut rotation = [[S::zero(); 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                rotation[i][j] = self.rotation[i][0] * inner.rotation[0][j]
                    + self.rotation[i][1] * inner.rotation[1][j]
                    + self.rotation[i][2] * inner.rotation[2][j];
            }
        }
        Self { rotation, position: self.apply(inner.position) }
    }

    /// The inverse: the pose of the outer frame in the inner one.
    #[inline(always)]
    #[must_use]
    pub fn inverse(&self) -> Self {
        let mut inverse = Self { rotation: [[S::zero(); 3]; 3], position: [S::zero(); 3] };
        for i in 0..3 {
            for j in 0..3 {
                inverse.rotation[i][j] = self.rotation[j][i];
            }
        }
        let position = inverse.rotate(self.position);
        inverse.position = [-position[0], -position[1], -position[2]];
        inverse
    }

    /// A direction of the inner frame, in the outer one.
    #[inline(always)]
    pub fn rotate(&self, v: [S; 3]) -> [S; 3] {
        [dot(self.rotation[0], v), dot(self.rotation[1], v), dot(self.rotation[2], v)]
    }

    /// A direction of the outer frame, in the inner one.
    #[inline(always)]
    pub fn unrotate(&self, v: [S; 3]) -> [S; 3] {
        let r = &self.rotation;
        let mut out = [S::zero(); 3];
        for i in 0..3 {
            out[i] = r[0][i] * v[0] + r[1][i] * v[1] + r[2][i] * v[2];
        }
        out
    }

    /// A point of the inner frame, in the outer one.
    #[inline(always)]
    pub fn apply(&self, p: [S; 3]) -> [S; 3] {
        add(self.rotate(p), self.position)
    }
}

impl Pose {
    /// The pose of a frame that coincides with the outer frame.
    pub const IDENTITY: Self =
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], position: [0.0; 3] };

    /// The same pose over any scalar.
    #[inline(always)]
    #[must_use]
    pub fn cast<S: Scalar>(&self) -> Pose<S> {
        let [a, b, c] = self.rotation;
        Pose { rotation: [constants(a), constants(b), constants(c)], position: constants(self.position) }
    }

    /// The pose at `position`, rotated about the fixed axes x, y, z by roll, pitch and yaw in radians:
    /// `R = R_z(yaw) R_y(pitch) R_x(roll)`, as URDF and SDF define it.
    ///
    /// Rounding errors near 0 and 1, such as the cosine 6e-17 of a right angle, are removed.
    pub fn from_rpy(position: [f64; 3], rpy: [f64; 3]) -> Self {
        let [(sr, cr), (sp, cp), (sy, cy)] = rpy.map(math::sin_cos).map(|(sin, cos)| (clean(sin), clean(cos)));
        Self {
            rotation: [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ],
            position,
        }
    }

    /// Roll, pitch and yaw of its rotation, rad: those of [`Pose::from_rpy`], the pitch within a quarter turn.
    #[must_use]
    pub fn rpy(&self) -> [f64; 3] {
        let r = &self.rotation;
        let pitch = math::atan2(-r[2][0], (r[2][1] * r[2][1] + r[2][2] * r[2][2]).sqrt());
        [math::atan2(r[2][1], r[2][2]), pitch, math::atan2(r[1][0], r[0][0])]
    }

    /// At `position`, turned by the quaternion `w + xi + yj + zk` of any length; `None` where its length is 0 or not
    /// finite.
    #[must_use]
    pub fn from_quaternion(position: [f64; 3], [w, x, y, z]: [f64; 4]) -> Option<Self> {
        let norm = (w * w + x * x + y * y + z * z).sqrt();
        if !(norm > 0.0 && norm.is_finite()) {
            return None;
        }
        let [w, x, y, z] = [w / norm, x / norm, y / norm, z / norm];
        let rotation = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ];
        Some(Self { rotation: rotation.map(|row| row.map(clean)), position })
    }
}

/// Removes rounding errors near 0 and 1 from an entry of a rotation.
fn clean(entry: f64) -> f64 {
    let nearest = entry.round();
    if (entry - nearest).abs() < 1e-15 { nearest + 0.0 } else { entry }
}

/// How often the angle is halved before its sine is inverted by a series.
const HALVINGS: usize = 4;
/// Coefficients of `asin(x) / x` in powers of `x^2`. The sine of a sixteenth of half a turn is 0.098.
const ARCSINE: [f64; 9] = [
    1.0,
    1.0 / 6.0,
    3.0 / 40.0,
    15.0 / 336.0,
    105.0 / 3456.0,
    945.0 / 42240.0,
    10395.0 / 599_040.0,
    135_135.0 / 9_676_800.0,
    2_027_025.0 / 175_472_640.0,
];
/// `1 + trace` of rotations by half a turn but for this angle's square: closer to it, the vector is shortened.
const CLOSE_TO_HALF_A_TURN: f64 = 1e-12;

/// A rotation relative to a reference, in the axes of the reference: the rotation vector of `R_ref' R`, axis times angle, rad;
/// both by rows. It is smooth for angles below half a turn (theory, equation R.17).
///
/// ```
/// use supple_robot::{Pose, turn};
///
/// let turned = Pose::from_rpy([0.0; 3], [0.0, 0.0, 0.1]);
/// let [x, y, z] = turn(&turned.rotation, &Pose::IDENTITY.rotation);
/// assert!(x == 0.0 && y == 0.0 && (z - 0.1).abs() < 1e-15);
/// ```
pub fn turn<S: Scalar>(rotation: &[[S; 3]; 3], reference: &[[S; 3]; 3]) -> [S; 3] {
    let entry = |i: usize, j: usize| (0..3).fold(S::zero(), |sum, k| sum + reference[k][i] * rotation[k][j]);
    // Cosine and sine of half the angle, then of ever smaller shares of it; sines along the axis.
    let trace = entry(0, 0) + entry(1, 1) + entry(2, 2);
    let floor = S::constant(CLOSE_TO_HALF_A_TURN);
    let mut cosine = ((trace + 1.0 - floor).positive_part() + floor).sqrt() * 0.5;
    let scale = cosine.recip() * 0.25;
    let mut sines = [(2, 1), (0, 2), (1, 0)].map(|(i, j)| (entry(i, j) - entry(j, i)) * scale);
    for _ in 0..HALVINGS {
        cosine = ((cosine + 1.0) * 0.5).sqrt();
        let scale = cosine.recip() * 0.5;
        sines = sines.map(|sine| sine * scale);
    }
    let square = dot(sines, sines);
    let series = ARCSINE.iter().rev().fold(S::zero(), |sum, &c| sum * square + c);
    let whole = series * (2 << HALVINGS) as f64;
    sines.map(|sine| sine * whole)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// About an axis by an angle (Rodrigues).
    fn rotation(axis: [f64; 3], angle: f64) -> [[f64; 3]; 3] {
        let [x, y, z] = axis;
        let (sin, cos) = (math::sin(angle), math::cos(angle));
        let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        let own = |i: usize, j: usize| if i == j { cos } else { 0.0 };
        [0, 1, 2].map(|i| [0, 1, 2].map(|j| own(i, j) + sin * cross[i][j] + (1.0 - cos) * axis[i] * axis[j]))
    }

    #[test]
    fn turns_are_rotation_vectors() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 0.6, -0.8], [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0]];
        for axis in axes {
            for (angle, tolerance) in
                [(0.0, 0.0), (1e-9, 1e-16), (0.3, 1e-15), (1.6, 2e-15), (2.9, 2e-14), (3.1, 2e-12), (PI - 6e-4, 1e-8)]
            {
                let found = turn(&rotation(axis, angle), &Pose::IDENTITY.rotation);
                let error = found.iter().zip(axis).map(|(found, e)| (found - angle * e).abs()).fold(0.0, f64::max);
                assert!(error <= tolerance, "{axis:?} {angle}: {error:e}");
            }
            // Half a turn, and what rounding makes of it, is bounded.
            for angle in [PI, PI - 1e-6, PI + 1e-5] {
                let found = turn(&rotation(axis, angle), &Pose::IDENTITY.rotation);
                assert!(dot(found, found).sqrt() < 3.3, "{found:?}");
            }
            // Seen from a reference about the same axis.
            let found = turn(&rotation(axis, 2.5), &rotation(axis, -0.4));
            assert!((dot(found, axis) - 2.9).abs() < 1e-13);
        }
    }
}
