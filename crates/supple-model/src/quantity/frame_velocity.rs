use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Unfit, Vocabulary, pick};
use crate::channels::Channel;
use crate::physics::{FRAME_SIGNALS, Point};

/// Where velocities begin among the signals of a frame.
const FIRST: usize = 12;

/// Velocity of a frame's origin, m/s, and angular velocity of the frame, rad/s, in the axes of the world.
///
/// As a limit in a task file:
///
/// ```toml
/// limits = [{ kind = "frame_velocity", frame = "tool", select = ["vx", "vy"], lower = -0.25, upper = 0.25 }]
/// ```
#[derive(Clone, Debug)]
pub struct FrameVelocity {
    selected: Vec<usize>,
}

/// Velocity of a frame's origin, m/s, and angular velocity of the frame, rad/s, in the axes of the world.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the frame or link.
    frame: String,
    /// Which of `vx`, `vy`, `vz`, `wx`, `wy` and `wz`; default: all.
    select: Option<Vec<String>>,
}

impl QuantityFile for FrameVelocity {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        let first = vocabulary.frame("frame", &file.frame)? + FIRST;
        let names = &FRAME_SIGNALS[FIRST..];
        let Some(select) = file.select else { return Ok(Self { selected: (first..first + names.len()).collect() }) };
        if select.is_empty() {
            return Err(Unfit::new("select", "name at least one"));
        }
        let find = |name: &String| {
            let place = names.iter().position(|other| other == name).map(|place| first + place);
            place.ok_or_else(|| Unfit::unknown("select", &format!("unknown velocity component `{name}`"), name, names))
        };
        Ok(Self { selected: select.iter().map(find).collect::<Result<_, _>>()? })
    }
}

impl Measurable for FrameVelocity {
    const NAME: &'static str = "frame_velocity";

    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        let channel = |&place: &usize| {
            let signal = FRAME_SIGNALS[place % FRAME_SIGNALS.len()];
            let unit = if signal.starts_with('v') { "m/s" } else { "rad/s" };
            Channel::new(format!("{signal} of {}", vocabulary.frame_of(place)), unit)
        };
        self.selected.iter().map(channel).collect()
    }

    fn evaluate<S: Scalar>(&self, _: &Point<S>, known: &Known<S>, out: &mut [S]) {
        pick(known.signals, &self.selected, out);
    }
}
