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
///
/// ```
/// use supple_robot::{Kinematics, LoadOptions, Numbers, Tree, frame_jacobian, frame_velocity, point_jacobian};
/// # let text = r#"<robot name="pendulum"><link name="world"/>
/// #     <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
/// #     <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
/// #         <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
/// // The pendulum of the front page.
/// let robot = supple_robot::parse(text, "pendulum.urdf", &LoadOptions::default())?;
/// let (tree, numbers) = (Tree::new(&robot), Numbers::<f64>::of(&robot, [0.0, 0.0, -9.81]));
/// let kinematics = Kinematics::of(&tree, &numbers, &[0.0], &[2.0]);
///
/// // The tip of the rod, 1 m below the hinge, moves along -x as the hinge turns about y.
/// let (rod, tip) = (1, [0.0, 0.0, -1.0]);
/// let jacobian = frame_jacobian(&tree, &kinematics, rod, tip);
/// assert!((jacobian[1][0] - 1.0).abs() < 1e-12 && (jacobian[3][0] + 1.0).abs() < 1e-12);
/// let velocity = frame_velocity(&kinematics, rod, tip);
/// assert!((velocity.linear[0] + 2.0).abs() < 1e-12);
///
/// // The same point in world coordinates.
/// let point = kinematics.poses()[rod].apply(tip);
/// assert_eq!(point_jacobian(&tree, &kinematics, rod, point), jacobian);
/// # Ok::<(), supple_text::FileError>(())
/// ```
pub fn frame_jacobian<S: Scalar>(tree: &Tree, kinematics: &Kinematics<S>, link: usize, point: [S; 3]) -> [Vec<S>; 6] {
    point_jacobian(tree, kinematics, link, kinematics.poses()[link].apply(point))
}

/// The same for a `point` given in world coordinates, m, that moves with `link`.
///
/// # Panics
/// As [`frame_jacobian`].
///
/// Example: [`frame_jacobian`].
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
///
/// Example: [`frame_jacobian`].
pub fn frame_velocity<S: Scalar>(kinematics: &Kinematics<S>, link: usize, point: [S; 3]) -> Twist<S> {
    let (pose, twist) = (&kinematics.poses()[link], kinematics.velocity(link));
    Twist { angular: pose.rotate(twist.angular), linear: pose.rotate(twist.at(point)) }
}
