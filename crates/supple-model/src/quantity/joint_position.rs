use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Unfit, Vocabulary, pick};
use crate::channels::Channel;
use crate::physics::Point;

/// Positions of joints, or of motors of elastic joints, rad or m.
///
/// As a sensor in a task file:
///
/// ```toml
/// sensors = [{ kind = "joint_position", select = ["elbow"], side = "motor", variance = 1e-6 }]
/// ```
#[derive(Clone, Debug)]
pub struct JointPosition {
    /// Places of states.
    selected: Vec<usize>,
}

/// Positions or velocities of joints.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Names of the joints; default: all that move.
    select: Option<Vec<String>>,
    /// Which side of an elastic joint is meant.
    #[serde(default)]
    side: Side,
}

/// A side of an elastic joint.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The link that the joint moves.
    #[default]
    Link,
    /// The motor, seen through its gear.
    Motor,
}

impl File {
    /// Places of the states `PREFIX.NAME` of the selected joints.
    pub fn states(self, prefix: &str, vocabulary: &Vocabulary) -> Result<Vec<usize>, Unfit> {
        let joints = vocabulary.selected_joints(self.select)?;
        if self.side == Side::Link {
            return states(prefix, &joints, vocabulary);
        }
        let motor = |joint: &String| match vocabulary.motor_of(joint) {
            Some(element) => Ok(element.to_owned()),
            None => {
                let message = format!("joint `{joint}` has no separate motor: the joint is rigid");
                Err(Unfit::new("side", message))
            }
        };
        let motors: Vec<String> = joints.iter().map(motor).collect::<Result<_, _>>()?;
        states(prefix, &motors, vocabulary)
    }
}

/// Places of the states `PREFIX.NAME`.
pub(super) fn states(prefix: &str, names: &[String], vocabulary: &Vocabulary) -> Result<Vec<usize>, Unfit> {
    names.iter().map(|name| vocabulary.state("select", &format!("{prefix}.{name}"))).collect()
}

impl JointPosition {
    /// Places of the states that are measured.
    #[must_use]
    pub fn states(&self) -> &[usize] {
        &self.selected
    }

    /// The positions of joints.
    pub(super) fn of(joints: &[String], vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        Ok(Self { selected: states("q", joints, vocabulary)? })
    }
}

impl QuantityFile for JointPosition {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        Ok(Self { selected: file.states("q", vocabulary)? })
    }
}

impl Measurable for JointPosition {
    const NAME: &'static str = "joint_position";

    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        self.selected.iter().map(|&place| vocabulary.state_channel(place)).collect()
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, _: &Known<S>, out: &mut [S]) {
        pick(at.x, &self.selected, out);
    }

    fn needs_signals(&self) -> bool {
        false
    }
}
