//! Robots from files, and the dynamics of their rigid bodies.
//!
//! ```text
//! URDF, SDF or MJCF text -> Robot (links and joints as written) -> Tree (moving bodies) -> dynamics over any Scalar
//! ```
//!
//! A [`Robot`] is the tree of links and joints in a file. A [`Tree`] is its kinematic tree: bodies with one joint each,
//! rigidly connected links merged, and the coordinates `q`. The algorithms on it are those of Featherstone, *Rigid Body
//! Dynamics Algorithms* (2008).

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
    Kinematics, Resisted, SingularMass, Twist, Wrench, articulated_bodies, bias, check_inertia, dry_friction,
    forward_dynamics, frame_jacobian, frame_velocity, inverse_dynamics, mass_matrix, massless_joints, passive_forces,
    passive_forces_ahead, passive_resistance, point_jacobian, sliding_rate, sliding_share, solve,
};
pub use equipment::{Actuator, Key, Law, Measured, Omitted, Sensor, Wall, WallShape};
pub use insert::{Insert, InsertedAxis};
pub use inverse_kinematics::{PoseGoal, Reach, Reached, inverse_kinematics};
pub use load::{LoadOptions, load, parse};
pub use numbers::{JointNumbers, LinkNumbers, Numbers};
pub use pose::{Pose, turn};
pub use robot::{Frame, Inertia, Joint, JointKind, Limits, Link, Mesh, Mimic, Robot};
pub use tree::{Body, Motion, Tree};
pub use write::{Written, mjcf};

/// Vectors of three numbers over any scalar.
pub mod vector {
    pub use crate::pose::{add, cross, dot, scale, sub};
}

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;
