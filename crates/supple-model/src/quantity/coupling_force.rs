use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Unfit, Vocabulary, pick};
use crate::channels::Channel;
use crate::physics::Point;

/// Forces and torques in an element of compliance, N and N m: what a force/torque sensor in it measures.
///
/// As a sensor in a task file:
///
/// ```toml
/// sensors = [{ kind = "coupling_force", coupling = "gripper", select = ["force_z"], variance = 0.2 }]
/// ```
#[derive(Clone, Debug)]
pub struct CouplingForce {
    selected: Vec<usize>,
}

/// Forces or torques in an element of compliance, N and N m; or its deflections, m and rad.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the element of compliance.
    coupling: String,
    /// Which of its forces or deflections; default: all.
    select: Option<Vec<String>>,
}

impl File {
    /// Name of the element of compliance.
    pub fn coupling(&self) -> &str {
        &self.coupling
    }

    /// Places among the model's signals.
    pub fn places(self, vocabulary: &Vocabulary, deflections: bool) -> Result<Vec<usize>, Unfit> {
        vocabulary.coupling(&self.coupling, self.select, deflections)
    }
}

impl QuantityFile for CouplingForce {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        Ok(Self { selected: file.places(vocabulary, false)? })
    }
}

impl Measurable for CouplingForce {
    const NAME: &'static str = "coupling_force";

    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        self.selected.iter().map(|&place| vocabulary.coupling_channel(place)).collect()
    }

    fn evaluate<S: Scalar>(&self, _: &Point<S>, known: &Known<S>, out: &mut [S]) {
        pick(known.signals, &self.selected, out);
    }

    fn signal_of(&self, entry: usize) -> Option<usize> {
        self.selected.get(entry).copied()
    }
}
