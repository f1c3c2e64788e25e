//! Robots from URDF, SDF and MJCF files, and the dynamics of their rigid bodies over any
//! [`Scalar`](supple_kernels::Scalar), so that masses and lengths can be parameters and derivatives are exact. Errors name
//! the file, line and element, and ignored parts are listed.
//!
//! ```text
//! URDF, SDF or MJCF text -> Robot (links and joints as written) -> Tree (moving bodies) -> dynamics over any Scalar
//! ```
//!
//! The crate builds on `supple-kernels` and `supple-text` and is independent of control; `supple-model` makes a model of a
//! robot, its drives and its compliance. The algorithms are those of Featherstone, *Rigid Body Dynamics Algorithms* (2008).
//!
//! | what | main items |
//! |---|---|
//! | a robot as its file describes it; MJCF of it | [`load`], [`parse`], [`Robot`], [`mjcf`] |
//! | its moving bodies with one joint each, and the coordinates `q`, rad or m | [`Tree`] |
//! | masses, inertias and joint properties, in SI units, over any scalar | [`Numbers`] |
//! | poses and velocities of links at `q` and `v`; Jacobians of frames | [`Kinematics`], [`frame_jacobian`] |
//! | forces from accelerations, and accelerations from forces | [`inverse_dynamics`], [`bias`], [`forward_dynamics`], [`mass_matrix`] |
//! | springs, dampers and friction in joints | [`passive_forces`] |
//! | the configuration in which a frame reaches a pose | [`inverse_kinematics`](inverse_kinematics()) |
//!
//! # Gravity torques
//!
//! ```
//! use supple_robot::{Kinematics, LoadOptions, Numbers, Tree, bias};
//!
//! // A rod that hangs from a hinge about the y axis: 2 kg, with its centre of mass 0.5 m below.
//! let text = r#"<robot name="pendulum"><link name="world"/>
//!     <joint name="hinge" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/></joint>
//!     <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
//!         <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
//! let robot = supple_robot::parse(text, "pendulum.urdf", &LoadOptions::default())?;
//! let (tree, numbers) = (Tree::new(&robot), Numbers::<f64>::of(&robot, [0.0, 0.0, -9.81]));
//! assert_eq!(tree.joints(), ["hinge"]);
//!
//! // The torque, N m, that holds it at rest at q = 0.3 rad: m g l sin(q).
//! let (q, v) = ([0.3], [0.0]);
//! let torques = bias(&tree, &numbers, &Kinematics::of(&tree, &numbers, &q, &v), &q, &v, 0.01);
//! assert!((torques[0] - 2.0 * 9.81 * 0.5 * 0.3_f64.sin()).abs() < 1e-12);
//! # Ok::<(), supple_text::FileError>(())
//! ```

mod dynamics;
mod equipment;
mod insert;
mod inverse_kinematics;
mod load;
mod lock;
mod numbers;
mod pose;
mod robot;
mod tree;
mod write;

pub use dynamics::{
    Kinematics, LinkWrench, Resisted, SingularMass, Twist, Wrench, articulated_bodies, bias, check_inertia,
    forward_dynamics, frame_jacobian, frame_velocity, inverse_dynamics, mass_matrix, massless_joints, passive_forces,
    passive_forces_ahead, passive_resistance, point_jacobian, solve,
};
pub use equipment::{Actuator, Key, Law, Measured, Omitted, Sensor, Wall, WallShape};
pub use insert::{Insert, InsertedAxis};
pub use inverse_kinematics::{PoseGoal, Reach, Reached, inverse_kinematics};
pub use load::{LoadOptions, load, parse};
pub use lock::LockedJoint;
pub use numbers::{JointNumbers, LinkNumbers, Numbers};
pub use pose::{Pose, turn};
pub use robot::{Frame, Inertia, Joint, JointKind, Limits, Link, Mesh, Mimic, Narrowed, Primitive, Robot, Solid};
pub use tree::{Body, Motion, Tree};
pub use write::{Written, mjcf};

/// Vectors of three numbers over any scalar.
///
/// ```
/// use supple_robot::vector::{add, cross, dot, scale, sub};
///
/// let (x, y) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
/// assert_eq!(cross(x, y), [0.0, 0.0, 1.0]);
/// assert_eq!(dot(x, add(scale(2.0, x), y)), 2.0);
/// assert_eq!(sub(x, y), [1.0, -1.0, 0.0]);
/// ```
pub mod vector {
    pub use crate::pose::{add, cross, dot, scale, sub};
}

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;
