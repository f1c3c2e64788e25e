//! Transforms between the frame of a body and that of its parent body.

use supple_kernels::Scalar;

use crate::pose::add;
use crate::tree::Motion;
use crate::{Body, Pose};

/// Pose of a body in its parent body: a constant pose, followed by the joint's motion along or about z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step<S> {
    /// Pose of the body in its parent body at joint position 0.
    fixed: Pose<S>,
    /// Sine and cosine of the joint's angle; of 0 for a prismatic joint.
    turn: (S, S),
    /// The body's origin in its parent body, m.
    pub origin: [S; 3],
}

impl<S: Scalar> Step<S> {
    /// The step for a joint with the pose `fixed` in the parent body, at `position`, rad or m.
    pub fn new(body: &Body, fixed: Pose<S>, position: S) -> Self {
        let position = position - body.reference;
        match body.motion {
            Motion::Turn => Self { fixed, turn: position.sin_cos(), origin: fixed.position },
            Motion::Slide => {
                let origin = fixed.apply([S::zero(), S::zero(), position]);
                Self { fixed, turn: (S::zero(), S::one()), origin }
            }
        }
    }

    /// Rotates a vector from the body's axes to those of its parent body.
    pub fn inward(&self, v: [S; 3]) -> [S; 3] {
        self.fixed.rotate(turned(self.turn, v))
    }

    /// Rotates a vector from the axes of the parent body to those of the body.
    pub fn outward(&self, v: [S; 3]) -> [S; 3] {
        unturned(self.turn, self.fixed.unrotate(v))
    }

    /// A symmetric matrix `A` in the body's axes, expressed in those of its parent body: `R A R'`.
    pub fn inward_symmetric(&self, matrix: [[S; 3]; 3]) -> [[S; 3]; 3] {
        rotated_symmetric(&self.fixed, turned_symmetric(self.turn, matrix))
    }

    /// A matrix `A` in the body's axes, expressed in those of its parent body: `R A R'`.
    pub fn inward_matrix(&self, matrix: [[S; 3]; 3]) -> [[S; 3]; 3] {
        let columns = transposed(matrix).map(|column| self.inward(column));
        transposed(columns).map(|row| self.inward(row))
    }

    /// The pose of the body, given that of the body that carries it.
    pub fn compose(&self, parent: &Pose<S>) -> Pose<S> {
        // The rows of R Z are Z' times the rows of R.
        let rotation = parent.compose(&self.fixed).rotation.map(|row| unturned(self.turn, row));
        Pose { rotation, position: parent.apply(self.origin) }
    }
}

/// `R A R'` of a symmetric `A`.
pub(crate) fn rotated_symmetric<S: Scalar>(pose: &Pose<S>, matrix: [[S; 3]; 3]) -> [[S; 3]; 3] {
    let columns = matrix.map(|column| pose.rotate(column));
    mirrored(transposed(columns).map(|row| pose.rotate(row)))
}

/// `Z v`, where `Z` turns about z.
fn turned<S: Scalar>((sin, cos): (S, S), [x, y, z]: [S; 3]) -> [S; 3] {
    [cos * x - sin * y, sin * x + cos * y, z]
}

/// `Z' v`, where `Z` turns about z.
fn unturned<S: Scalar>((sin, cos): (S, S), [x, y, z]: [S; 3]) -> [S; 3] {
    [cos * x + sin * y, cos * y - sin * x, z]
}

/// `Z A Z'` of a symmetric `A`, where `Z` turns about z.
fn turned_symmetric<S: Scalar>((sin, cos): (S, S), matrix: [[S; 3]; 3]) -> [[S; 3]; 3] {
    let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = matrix;
    let half = cos * xy;
    let change = sin * (xx - yy) + half + half;
    let [xz, yz, _] = turned((sin, cos), [xz, yz, zz]);
    let (xx, xy, yy) = (xx - sin * change, cos * change - xy, yy + sin * change);
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}

/// `A'`
fn transposed<S: Copy>([a, b, c]: [[S; 3]; 3]) -> [[S; 3]; 3] {
    [[a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]]]
}

/// The symmetric matrix with the given entries on and above the diagonal.
pub(crate) fn mirrored<S: Copy>([[xx, xy, xz], [_, yy, yz], [_, _, zz]]: [[S; 3]; 3]) -> [[S; 3]; 3] {
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}

/// `A + B`
pub(crate) fn add_matrices<S: Scalar>(a: [[S; 3]; 3], b: [[S; 3]; 3]) -> [[S; 3]; 3] {
    [0, 1, 2].map(|row| add(a[row], b[row]))
}

/// `a b'`
pub(crate) fn outer<S: Scalar>(a: [S; 3], b: [S; 3]) -> [[S; 3]; 3] {
    a.map(|entry| b.map(|other| entry * other))
}
