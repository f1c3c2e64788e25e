//! Compliance of robots: everything needed to write a new kind.
//!
//! A kind implements [`Compliance`], and [`ComplianceFile`] to be read from task files; it is added to
//! [`Kinds`](crate::Kinds) by [`with_coupling`](crate::Kinds::with_coupling).

pub use super::bodies::{Forces, Own};
pub use super::compliance::{BesideJoint, Compliance, ComplianceFile, Drawn, DryFriction, Names, Resistance, Rule};
pub use crate::quantity::Unfit;
pub use crate::scene::ConnectionKind;
pub use supple_robot::{Pose, Twist, Wrench, vector};
