use serde::Deserialize;
use supple_kernels::Scalar;

use super::frame_point::Axis;
use super::{Known, Measurable, QuantityFile, Unfit, Vocabulary, pick};
use crate::channels::Channel;
use crate::physics::{CENTER_OF_MASS, Point};

/// The centre of mass of all links in the world, m.
///
/// As a cost in a task file:
///
/// ```toml
/// costs = [{ kind = "center_of_mass", axes = ["x"], target = 0.1, weight = 1.0 }]
/// ```
#[derive(Clone, Debug)]
pub struct CenterOfMass {
    /// Places of its selected coordinates among the model's signals.
    selected: Vec<usize>,
    axes: Vec<Axis>,
}

/// The centre of mass of all links in the world, m.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// World coordinates to use; default: all.
    axes: Option<Vec<Axis>>,
}

impl QuantityFile for CenterOfMass {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        let axes = Axis::selected(file.axes)?;
        let names: Vec<String> = axes.iter().map(|&axis| CENTER_OF_MASS[axis as usize].to_owned()).collect();
        let none = |_| Unfit::new("kind", "the model has no bodies whose masses are known");
        Ok(Self { selected: vocabulary.signals_of(&names).map_err(none)?, axes })
    }
}

impl Measurable for CenterOfMass {
    const NAME: &'static str = "center_of_mass";

    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, _: &Vocabulary) -> Vec<Channel> {
        self.axes.iter().map(|axis| Channel::new(format!("{axis} of the centre of mass"), "m")).collect()
    }

    fn evaluate<S: Scalar>(&self, _: &Point<S>, known: &Known<S>, out: &mut [S]) {
        pick(known.signals, &self.selected, out);
    }

    fn needs_target(&self) -> bool {
        true
    }
}
