use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Unfit, Vocabulary, pick};
use crate::channels::Channel;
use crate::physics::{EFFORT, Point};

/// Torques or forces that drives exert on what they drive during a step, N m or N. It depends on the control.
///
/// With implicit integration, position and velocity drives act as they do at the end of the step; with sub-steps, at the end of
/// the last one. Limits hold in the first sub-step too, where the effort is greatest after a change of the control.
///
/// As a limit in a task file:
///
/// ```toml
/// limits = [{ kind = "drive_effort", select = ["elbow"], lower = -40.0, upper = 40.0 }]
/// ```
#[derive(Clone, Debug)]
pub struct DriveEffort {
    /// Places among the model's drives.
    drives: Vec<usize>,
    /// Places among the model's signals.
    signals: Vec<usize>,
    /// Whether any of them acts at the end of a step.
    at_end: bool,
    /// Whether this is the effort in the first of several sub-steps.
    early: bool,
}

/// Torques or forces of drives, N m or N.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Names of joints with plain drives and of actuators; default: all.
    select: Option<Vec<String>>,
}

impl DriveEffort {
    /// The efforts of the drives with these names, or of all drives if `select` is `None`.
    pub(crate) fn of(select: Option<Vec<String>>, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        let (drives, signals) = vocabulary.selected_drives(select, EFFORT)?;
        let at_end = vocabulary.any_acts_at_end(&drives);
        Ok(Self { drives, signals, at_end, early: false })
    }

    /// The same in the first of several sub-steps; `None` if no drive acts at their ends.
    pub(crate) fn in_first_substep(&self) -> Option<Self> {
        (self.at_end && !self.early).then(|| Self { early: true, ..self.clone() })
    }
}

impl QuantityFile for DriveEffort {
    type File = File;
    const OF_CONTROL: bool = true;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        Self::of(file.select, vocabulary)
    }
}

impl Measurable for DriveEffort {
    const NAME: &'static str = "drive_effort";

    fn len(&self) -> usize {
        self.signals.len()
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        let channel = |&drive: &usize| {
            let Channel { name, unit } = &vocabulary.drives[drive].channel;
            let when = if self.early { " in the first sub-step" } else { "" };
            Channel::new(format!("effort of {name}{when}"), unit.clone())
        };
        self.drives.iter().map(channel).collect()
    }

    fn evaluate<S: Scalar>(&self, _: &Point<S>, known: &Known<S>, out: &mut [S]) {
        pick(if self.early { known.early } else { known.signals }, &self.signals, out);
    }

    fn depends_on_control(&self) -> bool {
        Self::OF_CONTROL
    }

    fn needs_signals_during(&self) -> bool {
        self.at_end && !self.early
    }

    fn needs_signals_early(&self) -> bool {
        self.early
    }
}
