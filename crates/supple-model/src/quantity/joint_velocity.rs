use supple_kernels::Scalar;

use super::joint_position::{File, states};
use super::{Known, Measurable, QuantityFile, Unfit, Vocabulary, pick};
use crate::channels::Channel;
use crate::physics::Point;

/// Velocities of joints, or of motors of elastic joints, rad/s or m/s.
///
/// As a cost in a task file:
///
/// ```toml
/// costs = [{ kind = "joint_velocity", weight = 1e-3 }]
/// ```
#[derive(Clone, Debug)]
pub struct JointVelocity {
    /// Places of states.
    selected: Vec<usize>,
}

impl JointVelocity {
    /// The velocities of joints.
    pub(super) fn of(joints: &[String], vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        Ok(Self { selected: states("v", joints, vocabulary)? })
    }
}

impl QuantityFile for JointVelocity {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        Ok(Self { selected: file.states("v", vocabulary)? })
    }
}

impl Measurable for JointVelocity {
    const NAME: &'static str = "joint_velocity";

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
