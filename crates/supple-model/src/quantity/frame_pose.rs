use serde::Deserialize;
use supple_kernels::Scalar;
use supple_robot::Pose;

use super::{FramePoint, FrameTurn, Known, Measurable, QuantityFile, Unfit, Vocabulary};
use crate::Value;
use crate::channels::Channel;
use crate::physics::Point;

/// Position of a frame in the world, m, and its rotation from a reference orientation, rad, optionally times `lever`.
///
/// As a cost in a task file:
///
/// ```toml
/// costs = [{ kind = "frame_pose", frame = "tool", rpy = [0.0, 1.57, 0.0], target = [0.5, 0.0, 0.3], weight = 1.0 }]
/// ```
#[derive(Clone, Debug)]
pub struct FramePose {
    point: FramePoint,
    turn: FrameTurn,
    lever: Option<Value>,
}

/// Position of a frame in the world, m, and its turn from a reference orientation, rad.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the frame or link.
    frame: String,
    /// Roll, pitch and yaw of the orientation from which turns are measured, rad; choose it close to the frame's
    /// orientation.
    #[serde(default, alias = "rpy")]
    reference: [f64; 3],
    /// Lever that converts rotations into distances, m/rad; default: rotations in rad.
    lever: Option<Value>,
}

impl QuantityFile for FramePose {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        let first = vocabulary.frame("frame", &file.frame)?;
        let turn = FrameTurn::new(first, Pose::from_rpy([0.0; 3], file.reference).rotation);
        Ok(Self { point: FramePoint::of(first), turn, lever: file.lever })
    }
}

impl Measurable for FramePose {
    const NAME: &'static str = "frame_pose";

    fn len(&self) -> usize {
        6
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        let mut channels = self.point.channels(vocabulary);
        let turns = self.turn.channels(vocabulary).into_iter();
        channels.extend(turns.map(|turn| match &self.lever {
            None => turn,
            Some(_) => Channel::new(format!("{}, times its lever", turn.name), "m"),
        }));
        channels
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, known: &Known<S>, out: &mut [S]) {
        let (position, turns) = out.split_at_mut(3);
        self.point.evaluate(at, known, position);
        for (out, turn) in turns.iter_mut().zip(self.turn.turn(known.signals)) {
            *out = self.lever.as_ref().map_or(turn, |lever| at.value(lever) * turn);
        }
    }

    fn least_targets(&self) -> usize {
        3
    }

    fn needs_target(&self) -> bool {
        true
    }
}
