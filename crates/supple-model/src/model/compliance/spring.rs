use serde::Deserialize;
use supple_kernels::Scalar;

use super::{BesideJoint, Compliance, ComplianceFile, Drawn, Forces, Names, Own, Resistance, Rule, Unfit};
use crate::Value;

/// A spring and damper in parallel with a joint: `tau = -stiffness (q - rest) - damping v`.
#[derive(Clone, Debug)]
pub struct Spring {
    dof: usize,
    stiffness: Value,
    rest: Value,
    damping: Value,
}

impl Spring {
    /// A spring and damper at a degree of freedom, with rest position 0.
    pub fn new(dof: usize, stiffness: Value, damping: Value) -> Self {
        Self { dof, stiffness, rest: Value::default(), damping }
    }
}

/// A spring and damper beside a joint.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the joint.
    joint: String,
    /// Stiffness, N m/rad or N/m; at least 0.
    stiffness: Value,
    /// Position at which it is at rest, rad or m.
    #[serde(default)]
    rest: Value,
    /// Damping, N m s/rad or N s/m; at least 0.
    #[serde(default)]
    damping: Value,
}

impl ComplianceFile for Spring {
    type File = File;

    fn build(file: File, names: &Names) -> Result<Self, Unfit> {
        let File { joint, stiffness, rest, damping } = file;
        Ok(Self { dof: names.joint("joint", &joint)?, stiffness, rest, damping })
    }
}

impl Compliance for Spring {
    const NAME: &'static str = "spring";

    fn signals(&self) -> Vec<&'static str> {
        vec!["torque"]
    }

    fn measure<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
        let rate = own.rates()[self.dof];
        let stretch = own.lead().mul_add(rate, own.positions()[self.dof]) - own.value(&self.rest);
        vec![-(own.value(&self.stiffness) * stretch + own.value(&self.damping) * rate)]
    }

    fn deflections(&self) -> Vec<&'static str> {
        vec!["deflection"]
    }

    fn deflect<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
        vec![own.positions()[self.dof] - own.value(&self.rest)]
    }

    fn apply<S: Scalar>(&self, own: &Own<S>, forces: &mut Forces<S>) {
        forces.on_position(self.dof, self.measure(own)[0]);
    }

    fn resistance<S: Scalar>(&self, own: &Own<S>) -> Vec<Resistance<S>> {
        vec![own.resistance(&self.stiffness, &self.damping, &[(self.dof, 1.0)])]
    }

    fn draw(&self, own: &Own<f64>) -> Drawn {
        Drawn::beside_joint(own, self.dof, self.measure(own)[0])
    }

    fn beside_joint(&self) -> Option<BesideJoint> {
        let Self { dof, stiffness, rest, damping } = self.clone();
        Some(BesideJoint { dof, stiffness, rest, damping })
    }

    fn rules(&self) -> Vec<Rule<'_>> {
        vec![Rule::at_least("stiffness", &self.stiffness, 0.0), Rule::at_least("damping", &self.damping, 0.0)]
    }
}
