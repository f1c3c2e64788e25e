use serde::Deserialize;
use supple_kernels::Scalar;
use supple_robot::Pose;

use super::{Cost, CostError, CostFile, CostKind, Norm, Residual, Vocabulary};
use crate::model::turn;
use crate::{Point, Value};

/// A frame in the world against a target: its position, m, and `lever` times its turn from the target's orientation.
///
/// The turn is half the skew part of `R_target' R`: the sine of the angle along the axis.
#[derive(Clone, Debug)]
pub struct FramePose {
    /// Place of the frame's x among the model's signals; y, z and the rotation matrix by rows follow.
    pub signal: usize,
    /// Where it should be, m.
    pub position: [Value; 3],
    /// The orientation that it should have, a rotation matrix by rows.
    pub rotation: [[f64; 3]; 3],
    /// Length over which a turn counts as a distance, m/rad.
    pub lever: Value,
}

/// A frame in the world against a target.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Name of the frame or link.
    frame: String,
    /// Where it should be, m.
    position: [Value; 3],
    /// Roll, pitch and yaw that it should have, rad.
    rpy: [f64; 3],
    /// Length over which a turn counts as a distance, m/rad.
    lever: Value,
    /// Weight in every stage, 1/m^2 (with the quadratic norm).
    weight: Value,
    /// Weight in the final cost; as `weight` where left out.
    final_weight: Option<Value>,
    /// How the residual becomes a cost.
    #[serde(default)]
    norm: Norm,
}

impl CostFile for FramePose {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Cost, CostError> {
        let signal = vocabulary.signal_of("frame", "link or frame", &file.frame, "x")?;
        let rotation = Pose::from_rpy([0.0; 3], file.rpy).rotation;
        let kind = CostKind::FramePose(Self { signal, position: file.position, rotation, lever: file.lever });
        Ok(Cost::weighed(kind, file.norm, file.weight, file.final_weight))
    }
}

impl Residual for FramePose {
    fn len(&self) -> usize {
        6
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, signals: &[S], out: &mut [S]) {
        let own = &signals[self.signal..self.signal + 12];
        for i in 0..3 {
            out[i] = own[i] - at.value(self.position[i]);
        }
        let rotation = [0, 1, 2].map(|i| [own[3 + 3 * i], own[4 + 3 * i], own[5 + 3 * i]]);
        let reference = self.rotation.map(|row| row.map(S::constant));
        for (out, turn) in out[3..].iter_mut().zip(turn(&rotation, &reference)) {
            *out = at.value(self.lever) * turn;
        }
    }
}
