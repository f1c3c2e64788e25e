use serde::Deserialize;
use supple_kernels::Scalar;
use supple_robot::{Pose, turn};

use super::{Known, Measurable, QuantityFile, Reach, Unfit, Vocabulary};
use crate::channels::Channel;
use crate::physics::Point;

/// Rotation of a frame from a reference orientation in the world: the rotation vector of `R_reference' R`, axis times angle,
/// rad.
///
/// As a sensor in a task file:
///
/// ```toml
/// sensors = [{ kind = "frame_turn", frame = "tool", reference = [0.0, 1.57, 0.0], variance = 1e-4 }]
/// ```
#[derive(Clone, Debug)]
pub struct FrameTurn {
    /// Place of the frame's x among the model's signals; y, z and the rotation matrix by rows follow.
    first: usize,
    /// A rotation matrix by rows.
    reference: [[f64; 3]; 3],
}

/// Turn of a frame from a reference orientation in the world, rad.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the frame or link.
    frame: String,
    /// Roll, pitch and yaw of the orientation from which turns are measured, rad; less than half a turn from the frame's.
    #[serde(default, alias = "rpy")]
    reference: [f64; 3],
}

impl FrameTurn {
    /// The turn of a frame, given the place of its first signal, from an orientation, a rotation matrix by rows.
    #[must_use]
    pub fn new(first: usize, reference: [[f64; 3]; 3]) -> Self {
        Self { first, reference }
    }

    /// The turn, given the model's signals.
    pub(super) fn turn<S: Scalar>(&self, signals: &[S]) -> [S; 3] {
        let own = &signals[self.first + 3..self.first + 12];
        let rotation = [0, 1, 2].map(|i| [own[3 * i], own[1 + 3 * i], own[2 + 3 * i]]);
        turn(&rotation, &self.reference.map(|row| row.map(S::constant)))
    }
}

impl QuantityFile for FrameTurn {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        Ok(Self::new(vocabulary.frame("frame", &file.frame)?, Pose::from_rpy([0.0; 3], file.reference).rotation))
    }
}

impl Measurable for FrameTurn {
    const NAME: &'static str = "frame_turn";

    fn len(&self) -> usize {
        3
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        let name = vocabulary.frame_of(self.first);
        ["x", "y", "z"].map(|axis| Channel::new(format!("turn of {name} about {axis}"), "rad")).to_vec()
    }

    fn reach(&self) -> Reach {
        Reach { signals: self.first + 12, ..Reach::default() }
    }

    fn evaluate<S: Scalar>(&self, _: &Point<S>, known: &Known<S>, out: &mut [S]) {
        out.copy_from_slice(&self.turn(known.signals));
    }
}
