//! Compliance of robots: what an author of a new kind needs.
//!
//! A kind implements [`Compliance`], and [`ComplianceFile`] to be read from task files; it is added to
//! [`Kinds`](crate::Kinds) by [`with_coupling`](crate::Kinds::with_coupling).

pub use super::robot::{BesideJoint, Compliance, ComplianceFile, Drawn, Forces, Names, Own, Resistance, Rule};
pub use crate::quantity::Unfit;
pub use crate::scene::ConnectionKind;
pub use supple_robot::{Pose, Twist, Wrench, vector};
