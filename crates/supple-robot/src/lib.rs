//! Robots from files, and the dynamics of their rigid bodies.
//!
//! ```text
//! URDF, SDF or MJCF text -> Robot (links and joints as written) -> Tree (moving bodies) -> dynamics over any Scalar
//! ```
//!
//! A [`Robot`] is what a file says: a tree of links and joints with their numbers. A [`Tree`] is what moves: bodies with
//! one joint each, the links that are fixed to one another merged, and the coordinates `q` that they move with. The
//! algorithms on it are those of Featherstone, *Rigid Body Dynamics Algorithms* (2008).

mod load;
mod pose;
mod robot;

pub use load::{LoadOptions, load, parse};
pub use pose::Pose;
pub use robot::{Frame, Inertia, Joint, JointKind, Limits, Link, Mesh, Mimic, Robot};
