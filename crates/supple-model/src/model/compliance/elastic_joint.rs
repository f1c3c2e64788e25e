use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Compliance, ComplianceFile, Drawn, Forces, Names, Own, Resistance, Rule, Unfit};
use crate::{Point, Value};

/// A joint that its motor drives through a spring and damper (series elasticity). It adds the motor's position `s` and
/// velocity to the state; the drive of the joint acts on the motor:
///
/// ```text
/// tau = stiffness (s - q) + damping (s' - q')        motor_inertia s'' = drive - motor_damping s' - tau
/// ```
///
/// All quantities are on the joint side of the gear: the motor's inertia is its reflected inertia. The motor's reaction on
/// its supporting link is that of a joint with high reduction (Spong 1987).
#[derive(Clone, Debug)]
pub struct ElasticJoint {
    dof: usize,
    stiffness: Value,
    damping: Value,
    motor_inertia: Value,
    motor_damping: Value,
}

/// A spring and damper between a motor and its joint.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the joint.
    joint: String,
    /// Stiffness, N m/rad or N/m; at least 0.
    stiffness: Value,
    /// Damping of the spring, N m s/rad or N s/m; at least 0.
    #[serde(default)]
    damping: Value,
    /// Inertia of the motor, reflected to the joint, kg m^2 or kg; above 0.
    motor_inertia: Value,
    /// Damping of the motor, N m s/rad or N s/m; at least 0.
    #[serde(default)]
    motor_damping: Value,
}

impl ComplianceFile for ElasticJoint {
    type File = File;

    fn build(file: File, names: &Names) -> Result<Self, Unfit> {
        let File { joint, stiffness, damping, motor_inertia, motor_damping } = file;
        Ok(Self { dof: names.joint("joint", &joint)?, stiffness, damping, motor_inertia, motor_damping })
    }
}

impl Compliance for ElasticJoint {
    const NAME: &'static str = "elastic_joint";

    fn coordinates(&self) -> usize {
        1
    }

    fn inertias<S: Scalar>(&self, at: &Point<S>) -> Vec<S> {
        vec![at.value(&self.motor_inertia)]
    }

    fn signals(&self) -> Vec<&'static str> {
        vec!["torque"]
    }

    fn measure<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
        let rate = own.rates()[own.place()] - own.rates()[self.dof];
        let stretch = own.lead().mul_add(rate, own.positions()[own.place()] - own.positions()[self.dof]);
        vec![own.value(&self.stiffness) * stretch + own.value(&self.damping) * rate]
    }

    fn deflections(&self) -> Vec<&'static str> {
        vec!["deflection"]
    }

    fn deflect<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
        vec![own.positions()[own.place()] - own.positions()[self.dof]]
    }

    fn apply<S: Scalar>(&self, own: &Own<S>, forces: &mut Forces<S>) {
        let torque = self.measure(own)[0];
        let rate = own.rates()[own.place()];
        forces.on_position(self.dof, torque);
        forces.on_position(own.place(), -(torque + own.value(&self.motor_damping) * rate));
    }

    fn resistance<S: Scalar>(&self, own: &Own<S>) -> Vec<Resistance<S>> {
        let spring = own.resistance(&self.stiffness, &self.damping, &[(self.dof, -1.0), (own.place(), 1.0)]);
        vec![spring, own.resistance(&Value::default(), &self.motor_damping, &[(own.place(), 1.0)])]
    }

    fn draw(&self, own: &Own<f64>) -> Drawn {
        Drawn::beside_joint(own, self.dof, self.measure(own)[0])
    }

    fn motor_of(&self) -> Option<usize> {
        Some(self.dof)
    }

    fn rules(&self) -> Vec<Rule<'_>> {
        vec![
            Rule::at_least("stiffness", &self.stiffness, 0.0),
            Rule::at_least("damping", &self.damping, 0.0),
            Rule::above("motor_inertia", &self.motor_inertia, 0.0),
            Rule::at_least("motor_damping", &self.motor_damping, 0.0),
        ]
    }
}
