use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Cost, CostError, CostFile, CostKind, Norm, Residual, Vocabulary, Weights};
use crate::{Point, Value};

/// All controls; no part of the final cost.
#[derive(Clone, Debug)]
pub struct Control {
    /// How many controls there are.
    pub controls: usize,
}

/// All controls, in every stage.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Weight in every stage, above 0.
    weight: Value,
    /// How the residual becomes a cost.
    #[serde(default)]
    norm: Norm,
}

impl CostFile for Control {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Cost, CostError> {
        Ok(Cost {
            kind: CostKind::Control(Self { controls: vocabulary.controls }),
            norm: file.norm,
            stage: Weights::Equal(file.weight),
            last: Weights::Equal(Value::Number(0.0)),
        })
    }
}

impl Residual for Control {
    fn len(&self) -> usize {
        self.controls
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, _: &[S], out: &mut [S]) {
        out.copy_from_slice(at.u);
    }
}
