use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Cost, CostError, CostFile, CostKind, Norm, Residual, Vocabulary};
use crate::{Point, Value};

/// How deep a contact is, negative when apart, against a target, in m.
#[derive(Clone, Debug)]
pub struct Penetration {
    /// Place of the depth among the model's signals.
    pub signal: usize,
    /// Depth to reach, m.
    pub target: Value,
}

/// A contact's signed depth against a target.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Name of the contact, in models that name theirs.
    contact: Option<String>,
    /// Depth to reach, m.
    #[serde(default)]
    target: Value,
    /// Weight in every stage, 1/m^2 (with the quadratic norm).
    weight: Value,
    /// Weight in the final cost; as `weight` where left out.
    final_weight: Option<Value>,
    /// How the residual becomes a cost.
    #[serde(default)]
    norm: Norm,
}

impl CostFile for Penetration {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Cost, CostError> {
        let signal = vocabulary.contact_signal(file.contact.as_deref(), "penetration")?;
        let kind = CostKind::Penetration(Self { signal, target: file.target });
        Ok(Cost::weighed(kind, file.norm, file.weight, file.final_weight))
    }
}

impl Residual for Penetration {
    fn len(&self) -> usize {
        1
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, signals: &[S], out: &mut [S]) {
        out[0] = signals[self.signal] - at.value(self.target);
    }
}
