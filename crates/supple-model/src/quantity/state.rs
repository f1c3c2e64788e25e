use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Reach, Unfit, Vocabulary, pick};
use crate::channels::Channel;
use crate::physics::Point;

/// States, in their units.
///
/// Example: [`Cost`](crate::cost::Cost).
#[derive(Clone, Debug)]
pub struct State {
    selected: Vec<usize>,
}

/// States, in their units.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Names of the states.
    select: Vec<String>,
}

impl State {
    /// The states at these places.
    pub fn new(selected: impl Into<Vec<usize>>) -> Self {
        Self { selected: selected.into() }
    }
}

impl QuantityFile for State {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        if file.select.is_empty() {
            return Err(Unfit::new("select", "name at least one"));
        }
        let selected = file.select.iter().map(|name| vocabulary.state("select", name));
        Ok(Self { selected: selected.collect::<Result<_, _>>()? })
    }
}

impl Measurable for State {
    const NAME: &'static str = "state";

    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        self.selected.iter().map(|&place| vocabulary.state_channel(place)).collect()
    }

    fn reach(&self) -> Reach {
        Reach { states: Reach::beyond(&self.selected), ..Reach::default() }
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, _: &Known<S>, out: &mut [S]) {
        pick(at.x, &self.selected, out);
    }

    fn needs_signals(&self) -> bool {
        false
    }
}
