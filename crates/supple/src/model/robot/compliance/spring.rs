use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Compliance, ComplianceFile, Drawn, Names, Resistance, Unfit};
use crate::Value;
use crate::model::robot::situation::{Forces, Own};

/// A spring and damper beside a joint: `tau = -stiffness (q - rest) - damping v`.
#[derive(Clone, Debug)]
pub(crate) struct Spring {
    dof: usize,
    stiffness: Value,
    rest: Value,
    damping: Value,
}

impl Spring {
    /// Beside a degree of freedom, at rest at 0.
    pub fn new(dof: usize, stiffness: Value, damping: Value) -> Self {
        Self { dof, stiffness, rest: Value::default(), damping }
    }

    /// Its degree of freedom, and stiffness, rest position and damping.
    pub fn numbers(&self) -> (usize, [Value; 3]) {
        (self.dof, [self.stiffness, self.rest, self.damping])
    }
}

/// A spring and damper beside a joint.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
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
    fn signals(&self) -> Vec<&'static str> {
        vec!["torque"]
    }

    fn measure<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
        let (now, at) = (own.now, own.now.at);
        let rate = now.rates()[self.dof];
        let stretch = now.lead().mul_add(rate, now.q()[self.dof]) - at.value(self.rest);
        vec![-(at.value(self.stiffness) * stretch + at.value(self.damping) * rate)]
    }

    fn deflections(&self) -> Vec<&'static str> {
        vec!["deflection"]
    }

    fn deflect<S: Scalar>(&self, own: &Own<S>) -> Vec<S> {
        vec![own.now.q()[self.dof] - own.now.at.value(self.rest)]
    }

    fn apply<S: Scalar>(&self, own: &Own<S>, forces: &mut Forces<S>) {
        forces.generalised[self.dof] += self.measure(own)[0];
    }

    fn resistance<S: Scalar>(&self, own: &Own<S>) -> Vec<Resistance<S>> {
        vec![own.resistance(self.stiffness, self.damping, &[(self.dof, 1.0)])]
    }

    fn draw(&self, own: &Own<f64>) -> Drawn {
        Drawn::beside_joint(own, self.dof, self.measure(own)[0])
    }

    fn rules(&self) -> Vec<(&'static str, Value, f64, bool)> {
        vec![("stiffness", self.stiffness, 0.0, false), ("damping", self.damping, 0.0, false)]
    }
}
