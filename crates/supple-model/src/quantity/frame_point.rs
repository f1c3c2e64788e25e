use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Reach, Unfit, Vocabulary, pick};
use crate::channels::Channel;
use crate::physics::Point;

/// The origin of a frame in the world, m.
///
/// As a cost in a task file:
///
/// ```toml
/// costs = [{ kind = "frame_point", frame = "handle", axes = ["x", "y"], target = [0.5, 0.1], weight = 1.0 }]
/// ```
#[derive(Clone, Debug)]
pub struct FramePoint {
    /// Places of its selected coordinates among the model's signals.
    selected: Vec<usize>,
    axes: Vec<Axis>,
}

/// The origin of a frame in the world, m.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the frame or link.
    frame: String,
    /// Which coordinates of the world count; default: all.
    axes: Option<Vec<Axis>>,
}

/// A coordinate of the world.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Those that are given, or all; at least one.
    pub fn selected(given: Option<Vec<Self>>) -> Result<Vec<Self>, Unfit> {
        let axes = given.unwrap_or(Self::ALL.to_vec());
        if axes.is_empty() { Err(Unfit::new("axes", "name at least one")) } else { Ok(axes) }
    }
}

impl std::fmt::Display for Axis {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(["x", "y", "z"][*self as usize])
    }
}

impl FramePoint {
    /// All coordinates of a frame, given the place of its first signal.
    #[must_use]
    pub fn of(first: usize) -> Self {
        Self { selected: (first..first + 3).collect(), axes: Axis::ALL.to_vec() }
    }
}

impl QuantityFile for FramePoint {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        let first = vocabulary.frame("frame", &file.frame)?;
        let axes = Axis::selected(file.axes)?;
        Ok(Self { selected: axes.iter().map(|&axis| first + axis as usize).collect(), axes })
    }
}

impl Measurable for FramePoint {
    const NAME: &'static str = "frame_point";

    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        let frame = self.selected.first().map_or("", |&signal| vocabulary.frame_of(signal));
        self.axes.iter().map(|axis| Channel::new(format!("{axis} of {frame}"), "m")).collect()
    }

    fn reach(&self) -> Reach {
        Reach { signals: Reach::beyond(&self.selected), ..Reach::default() }
    }

    fn evaluate<S: Scalar>(&self, _: &Point<S>, known: &Known<S>, out: &mut [S]) {
        pick(known.signals, &self.selected, out);
    }

    fn needs_target(&self) -> bool {
        true
    }
}
