//! Dynamics of the bodies of a [`Tree`](crate::Tree) over any scalar.
//!
//! With the coordinates `q` of the degrees of freedom, their rates `v` and accelerations `a`,
//!
//! ```text
//! M(q) a + h(q, v) = tau + passive(q, v) + sum over external wrenches of J' wrench
//! ```
//!
//! where `M` is the mass matrix with the inertia of drives, `h` are the Coriolis and gravity forces, `tau` those of
//! the drives, and `passive` those of springs, dampers and friction in the joints. [`inverse_dynamics`] gives
//! `M a + h`, [`mass_matrix`] `M`, and [`forward_dynamics`] `a`. A joint that follows another moves with its degree of
//! freedom; all forces are those on the degrees of freedom.
//!
//! The algorithms are Featherstone's, *Rigid Body Dynamics Algorithms* (2008), in axes that move with the bodies, in
//! which inertias are constant. They differ from the book in one choice: accelerations are those of the bodies' origins
//! as points, not spatial accelerations, so no linear velocity enters the forces.
//!
//! No function branches on values. Many factors are the constants 0 or 1, and are meant for a scalar type that
//! simplifies them away. That is also why the rotation of a joint's frame is kept separate from the rotation by the
//! joint's angle, and why the axis of every joint is z.

mod articulated;
mod bodies;
mod external;
mod forward;
mod frames;
mod inertia;
mod inverse;
mod kinematics;
mod mass;
mod massless;
mod passive;
mod solve;
mod step;
mod wrench;

pub use forward::{articulated_bodies, forward_dynamics};
pub use frames::{frame_jacobian, frame_velocity, point_jacobian};
pub use inverse::{bias, inverse_dynamics};
pub use kinematics::{Kinematics, Twist};
pub use mass::mass_matrix;
pub use massless::{SingularMass, check_inertia, massless_joints};
pub use passive::{Resisted, passive_forces, passive_forces_ahead, passive_resistance};
pub use solve::solve;
pub use wrench::{LinkWrench, Wrench};
