use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Unfit, Vocabulary};
use crate::channels::Channel;
use crate::physics::Point;

/// Accelerations of joints, rad/s^2 or m/s^2: by how much their velocities change over a time step. They depend on the
/// control; an accelerometer measures those of the last step.
///
/// As a cost in a task file:
///
/// ```toml
/// costs = [{ kind = "joint_acceleration", select = ["elbow"], weight = 1e-4 }]
/// ```
#[derive(Clone, Debug)]
pub struct JointAcceleration {
    /// Places of the velocities among the states.
    selected: Vec<usize>,
    /// Names of the joints, with units.
    channels: Vec<Channel>,
}

/// Accelerations of joints, rad/s^2 or m/s^2.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Names of the joints; default: all that move.
    select: Option<Vec<String>>,
}

impl QuantityFile for JointAcceleration {
    type File = File;
    const OF_CONTROL: bool = true;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        let joints = vocabulary.selected_joints(file.select)?;
        let mut selected = Vec::with_capacity(joints.len());
        let mut channels = Vec::with_capacity(joints.len());
        for joint in joints {
            let place = vocabulary.state("select", &format!("v.{joint}"))?;
            let unit = vocabulary.state_channel(place).unit;
            let unit = if unit.is_empty() { unit } else { format!("{unit}^2") };
            channels.push(Channel::new(format!("a.{joint}"), unit));
            selected.push(place);
        }
        Ok(Self { selected, channels })
    }
}

impl Measurable for JointAcceleration {
    const NAME: &'static str = "joint_acceleration";

    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, _: &Vocabulary) -> Vec<Channel> {
        self.channels.clone()
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, known: &Known<S>, out: &mut [S]) {
        for (out, &place) in out.iter_mut().zip(&self.selected) {
            *out = (known.next[place] - at.x[place]) / at.time_step;
        }
    }

    fn needs_signals(&self) -> bool {
        false
    }

    fn depends_on_control(&self) -> bool {
        Self::OF_CONTROL
    }

    fn needs_next(&self) -> bool {
        true
    }

    fn rate_of(&self, entry: usize) -> Option<usize> {
        self.selected.get(entry).copied()
    }
}
