use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Cost, CostError, CostFile, CostKind, Norm, Residual, Vocabulary, targets};
use crate::{Point, Value};

/// The origin of a frame in the world against a target, m.
#[derive(Clone, Debug)]
pub struct FramePoint {
    /// Place of each selected coordinate among the model's signals, and its target, m.
    pub selected: Vec<(usize, Value)>,
}

/// The origin of a frame in the world against a target.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Name of the frame or link.
    frame: String,
    /// Which coordinates of the world count; all where left out.
    axes: Option<Vec<Axis>>,
    /// Where it should be, m: one number by coordinate that counts.
    target: Vec<Value>,
    /// Weight in every stage, 1/m^2 (with the quadratic norm).
    weight: Value,
    /// Weight in the final cost; as `weight` where left out.
    final_weight: Option<Value>,
    /// How the residual becomes a cost.
    #[serde(default)]
    norm: Norm,
}

/// A coordinate of the world.
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Axis {
    X,
    Y,
    Z,
}

impl CostFile for FramePoint {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Cost, CostError> {
        let x = vocabulary.signal_of("frame", "link or frame", &file.frame, "x")?;
        let axes = file.axes.unwrap_or(vec![Axis::X, Axis::Y, Axis::Z]);
        let targets = targets(Some(file.target), axes.len(), "coordinates")?;
        let selected = axes.into_iter().zip(targets).map(|(axis, target)| (x + axis as usize, target)).collect();
        let kind = CostKind::FramePoint(Self { selected });
        Ok(Cost::weighed(kind, file.norm, file.weight, file.final_weight))
    }
}

impl Residual for FramePoint {
    fn len(&self) -> usize {
        self.selected.len()
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, signals: &[S], out: &mut [S]) {
        for (out, &(signal, target)) in out.iter_mut().zip(&self.selected) {
            *out = signals[signal] - at.value(target);
        }
    }
}
