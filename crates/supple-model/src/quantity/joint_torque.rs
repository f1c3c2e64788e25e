use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Unfit, Vocabulary, pick};
use crate::channels::Channel;
use crate::physics::Point;

/// Torques or forces through the springs of elastic joints, N m or N.
///
/// As a sensor in a task file:
///
/// ```toml
/// sensors = [{ kind = "joint_torque", select = ["elbow"], variance = 1e-2 }]
/// ```
#[derive(Clone, Debug)]
pub struct JointTorque {
    /// Places among the model's signals.
    selected: Vec<usize>,
}

/// Torques or forces through elastic joints, N m or N.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Names of the joints, each of which must be an elastic joint; default: all elastic joints.
    select: Option<Vec<String>>,
}

impl JointTorque {
    /// The torques through elastic joints.
    pub(super) fn of(joints: &[String], vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        let place = |joint: &String| {
            let Some(element) = vocabulary.motor_of(joint) else {
                let message = format!("the torque of joint `{joint}` cannot be measured: the joint is rigid");
                let help = "add compliance of kind \"elastic_joint\" to it".to_owned();
                return Err(Unfit { help: Some(help), ..Unfit::new("select", message) });
            };
            Ok(vocabulary.coupling(element, Some(vec!["torque".to_owned()]), false)?[0])
        };
        Ok(Self { selected: joints.iter().map(place).collect::<Result<_, _>>()? })
    }
}

impl QuantityFile for JointTorque {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        let elastic = || vocabulary.motors.iter().map(|(joint, _)| joint.clone()).collect();
        let select = file.select.unwrap_or_else(elastic);
        if select.is_empty() && vocabulary.motors.is_empty() {
            return Err(Unfit::new("kind", "the model has no elastic joints"));
        }
        Self::of(&vocabulary.selected_joints(Some(select))?, vocabulary)
    }
}

impl Measurable for JointTorque {
    const NAME: &'static str = "joint_torque";

    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        let channel = |&place: &usize| {
            let element = vocabulary.signal_name(place).strip_suffix(".torque").unwrap_or_default();
            let unit = vocabulary.torque_unit(element);
            let what = if unit == "N" { "force" } else { "torque" };
            Channel::new(format!("{what} of {element}"), unit)
        };
        self.selected.iter().map(channel).collect()
    }

    fn evaluate<S: Scalar>(&self, _: &Point<S>, known: &Known<S>, out: &mut [S]) {
        pick(known.signals, &self.selected, out);
    }
}
