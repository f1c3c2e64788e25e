use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Reach, Unfit, Vocabulary, pick};
use crate::channels::{Channel, Drive};
use crate::physics::{EFFORT, POWER, Point};

/// Signals of the model: what it computes beside its states.
///
/// Example: the [module](crate::quantity).
#[derive(Clone, Debug)]
pub struct Signal {
    selected: Vec<usize>,
    depends_on_control: bool,
    /// Whether any is of a drive that acts at the end of a step.
    at_end: bool,
}

/// Signals of the model.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Names of the signals.
    select: Vec<String>,
}

impl Signal {
    /// The signals at these places.
    pub fn new(selected: impl Into<Vec<usize>>) -> Self {
        Self { selected: selected.into(), depends_on_control: false, at_end: false }
    }
}

impl QuantityFile for Signal {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        if file.select.is_empty() {
            return Err(Unfit::new("select", "name at least one"));
        }
        let selected = vocabulary.signals_of(&file.select)?;
        let drive = |name: &String| {
            let drive = name.strip_prefix(POWER).or_else(|| name.strip_prefix(EFFORT))?;
            vocabulary.drives.iter().find(|other| other.channel.name == drive)
        };
        let drives: Vec<&Drive> = file.select.iter().filter_map(drive).collect();
        let at_end = drives.iter().any(|drive| drive.acts_at_end);
        Ok(Self { selected, depends_on_control: !drives.is_empty(), at_end })
    }
}

impl Measurable for Signal {
    const NAME: &'static str = "signal";

    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        self.selected.iter().map(|&place| Channel::new(vocabulary.signal_name(place), "")).collect()
    }

    fn reach(&self) -> Reach {
        Reach { signals: Reach::beyond(&self.selected), ..Reach::default() }
    }

    fn evaluate<S: Scalar>(&self, _: &Point<S>, known: &Known<S>, out: &mut [S]) {
        pick(known.signals, &self.selected, out);
    }

    fn depends_on_control(&self) -> bool {
        self.depends_on_control
    }

    fn needs_signals_during(&self) -> bool {
        self.at_end
    }

    fn signal_of(&self, entry: usize) -> Option<usize> {
        self.selected.get(entry).copied()
    }
}
