use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Unfit, Vocabulary, pick};
use crate::channels::Channel;
use crate::physics::{POWER, Point};

/// Mechanical power of drives, W: the torque or force of each times the velocity of what it drives. It depends on the
/// control.
///
/// As a curve in a task file:
///
/// ```toml
/// curves = [{ kind = "power", select = ["elbow"] }]
/// ```
#[derive(Clone, Debug)]
pub struct Power {
    /// Places among the model's signals.
    selected: Vec<usize>,
    /// Whether any of the drives acts at the end of a step.
    at_end: bool,
}

/// Mechanical power of drives, W.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Names of joints with plain drives and of actuators; default: all.
    select: Option<Vec<String>>,
}

impl QuantityFile for Power {
    type File = File;
    const OF_CONTROL: bool = true;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        let (drives, selected) = vocabulary.selected_drives(file.select, POWER)?;
        Ok(Self { selected, at_end: vocabulary.any_acts_at_end(&drives) })
    }
}

impl Measurable for Power {
    const NAME: &'static str = "power";

    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        let name = |&place: &usize| vocabulary.signal_name(place).strip_prefix(POWER).unwrap_or_default();
        self.selected.iter().map(|place| Channel::new(format!("power of {}", name(place)), "W")).collect()
    }

    fn evaluate<S: Scalar>(&self, _: &Point<S>, known: &Known<S>, out: &mut [S]) {
        pick(known.signals, &self.selected, out);
    }

    fn depends_on_control(&self) -> bool {
        Self::OF_CONTROL
    }

    fn needs_signals_during(&self) -> bool {
        self.at_end
    }
}
