use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Context, Measure, SensorFile, Variance};
use crate::Channel;
use crate::model::robot::Robot;
use crate::model::robot::compliance::{Compliance, Unfit};
use crate::model::robot::situation::Situation;

/// Torques or forces through the springs of elastic joints, N m or N.
#[derive(Clone, Debug)]
pub(crate) struct JointTorque {
    /// Numbers of the elements of compliance.
    selected: Vec<usize>,
}

/// Torques through elastic joints.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Names of the joints, each of which must be an elastic joint.
    select: Vec<String>,
    /// Variance of the noise, one for all or one each, (N m)^2 or N^2; above 0.
    variance: Variance,
}

impl JointTorque {
    /// The torque through an elastic joint.
    pub fn of(joint: &str, context: &Context) -> Result<Self, Unfit> {
        Ok(Self { selected: vec![element(joint, context)?] })
    }
}

/// The element of compliance that makes a joint elastic.
fn element(joint: &str, context: &Context) -> Result<usize, Unfit> {
    let dof = context.names.joint("select", joint)?;
    context.compliance.iter().position(|element| element.kind.is_motor_of(dof)).ok_or_else(|| {
        let message = format!("the torque of joint `{joint}` cannot be measured: it is no elastic joint");
        let help = "add compliance of kind \"elastic_joint\" to it".to_owned();
        ("select", message, Some(help))
    })
}

impl SensorFile for JointTorque {
    type File = File;

    fn build(file: File, context: &Context) -> Result<(Self, Variance), Unfit> {
        if file.select.is_empty() {
            return Err(("select", "name at least one joint".into(), None));
        }
        let selected = file.select.iter().map(|joint| element(joint, context)).collect::<Result<_, _>>()?;
        Ok((Self { selected }, file.variance))
    }
}

impl Measure for JointTorque {
    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, robot: &Robot) -> Vec<Channel> {
        let channel = |&element: &usize| Channel::new(format!("torque of {}", robot.compliance[element].name), "N m");
        self.selected.iter().map(channel).collect()
    }

    fn measure<S: Scalar>(&self, now: &Situation<S>, out: &mut [S]) {
        for (out, &element) in out.iter_mut().zip(&self.selected) {
            let element = &now.robot.compliance[element];
            *out = element.kind.measure(&now.seen_by(element))[0];
        }
    }
}
