//! Compliance of robots: everything needed to write a new kind.
//!
//! A kind implements [`Compliance`], and [`ComplianceFile`] to be read from task files; it is added to
//! [`Kinds`](crate::Kinds) by [`with_coupling`](crate::Kinds::with_coupling).
//!
//! # A spring at one joint
//!
//! ```
//! use supple_model::document::NoKeys;
//! use supple_model::model::coupling::{
//!     BesideJoint, Compliance, ComplianceFile, Drawn, Forces, Names, Own, Resistance, Rule, Unfit,
//! };
//! use supple_model::{Kinds, Scalar, Value};
//!
//! /// 15 N m/rad at the joint `elbow`, which is its degree of freedom `dof`.
//! #[derive(Debug)]
//! struct ElbowSpring { dof: usize, stiffness: Value }
//!
//! impl ComplianceFile for ElbowSpring {
//!     type File = NoKeys;
//!     fn build(_: NoKeys, names: &Names) -> Result<Self, Unfit> {
//!         Ok(Self { dof: names.joint("kind", "elbow")?, stiffness: 15.0.into() })
//!     }
//! }
//!
//! impl Compliance for ElbowSpring {
//!     const NAME: &'static str = "elbow_spring";
//!     fn signals(&self) -> Vec<&'static str> {
//!         vec!["torque"]
//!     }
//!     fn measure<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
//!         let stretch = own.positions()[self.dof] + own.lead() * own.rates()[self.dof];
//!         vec![-(own.value(&self.stiffness) * stretch)]
//!     }
//!     fn apply<S: Scalar>(&self, own: &Own<S>, forces: &mut Forces<S>) {
//!         forces.on_position(self.dof, self.measure(own)[0]);
//!     }
//!     fn resistance<S: Scalar>(&self, own: &Own<S>) -> Vec<Resistance<S>> {
//!         vec![own.resistance(&self.stiffness, &0.0.into(), &[(self.dof, 1.0)])]
//!     }
//!     fn draw(&self, own: &Own<f64>) -> Drawn {
//!         Drawn::beside_joint(own, self.dof, self.measure(own)[0])
//!     }
//!     fn beside_joint(&self) -> Option<BesideJoint> {
//!         let stiffness = self.stiffness.clone();
//!         Some(BesideJoint { dof: self.dof, stiffness, rest: 0.0.into(), damping: 0.0.into() })
//!     }
//!     fn rules(&self) -> Vec<Rule<'_>> {
//!         vec![Rule::at_least("kind", &self.stiffness, 0.0)]
//!     }
//! }
//!
//! let kinds = Kinds::default().with_coupling::<ElbowSpring>();
//! ```

pub use super::bodies::{Forces, Own};
pub use super::compliance::{
    BesideJoint, Compliance, ComplianceFile, Drawn, DryFriction, Names, Push, Resistance, Rule,
};
pub use crate::quantity::Unfit;
pub use crate::scene::ConnectionKind;
pub use supple_robot::{Pose, Twist, Wrench, vector};
