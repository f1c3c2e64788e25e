//! How points of links move with the degrees of freedom.

use supple_kernels::Scalar;

use super::{Kinematics, Twist};
use crate::Tree;
use crate::pose::{cross, scale, sub};
use crate::tree::Motion;

/// The Jacobian of a frame whose origin is `point`, m in the axes of `link`: a 6 x `dofs` matrix that maps `v`
/// to the frame's angular velocity (rows 1 to 3) and the velocity of the point (4 to 6), both in the axes of the world.
///
/// Entries of degrees of freedom that do not move the link are constant zeros.
///
/// # Panics
/// If there is no such link, or `kinematics` belongs to another tree.
pub fn frame_jacobian<S: Scalar>(tree: &Tree, kinematics: &Kinematics<S>, link: usize, point: [S; 3]) -> [Vec<S>; 6] {
    point_jacobian(tree, kinematics, link, kinematics.poses()[link].apply(point))
}

/// The same for a `point` given in world coordinates, m, that moves with `link`.
///
/// # Panics
/// As [`frame_jacobian`].
pub fn point_jacobian<S: Scalar>(tree: &Tree, kinematics: &Kinematics<S>, link: usize, point: [S; 3]) -> [Vec<S>; 6] {
    let mut jacobian = [(); 6].map(|()| vec![S::zero(); tree.dofs()]);
    for index in tree.path(tree.body_of(link)) {
        let (body, pose) = (&tree.bodies()[index], &kinematics.moved[index].pose);
        let axis = scale(S::constant(body.ratio), pose.rotation.map(|row| row[2]));
        let (angular, linear) = match body.motion {
            Motion::Turn => (axis, cross(axis, sub(point, pose.position))),
            Motion::Slide => ([S::zero(); 3], axis),
        };
        for (row, entry) in jacobian.iter_mut().zip(angular.into_iter().chain(linear)) {
            row[body.dof] += entry;
        }
    }
    jacobian
}

/// The velocity of a frame whose origin is `point`, m in the axes of `link`, in the axes of the world.
///
/// # Panics
/// Where there is no such link.
pub fn frame_velocity<S: Scalar>(kinematics: &Kinematics<S>, link: usize, point: [S; 3]) -> Twist<S> {
    let (pose, twist) = (&kinematics.poses()[link], kinematics.velocity(link));
    Twist { angular: pose.rotate(twist.angular), linear: pose.rotate(twist.at(point)) }
}
