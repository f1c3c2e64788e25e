use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Cost, CostError, CostFile, CostKind, Norm, Residual, Vocabulary};
use crate::parameters::Parameters;
use crate::{Point, Value};

/// The force of a contact, kept from pulling, against a target: `target - 1/2 (sqrt(F^2 + smoothing^2) + F)`, in N.
#[derive(Clone, Debug)]
pub struct ContactForce {
    /// Place of the force among the model's signals.
    pub signal: usize,
    /// Force to reach, N.
    pub target: Value,
    /// Force over which pulling is cut off, N.
    pub smoothing: Value,
}

/// A contact's force against a target.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Name of the contact, in models that name theirs.
    contact: Option<String>,
    /// Force to reach, N.
    target: Value,
    /// Force gamma over which pulling is cut off, N.
    smoothing: Value,
    /// Weight in every stage, 1/N^2 (with the quadratic norm).
    weight: Value,
    /// Weight in the final cost; as `weight` where left out.
    final_weight: Option<Value>,
    /// How the residual becomes a cost.
    #[serde(default)]
    norm: Norm,
}

impl CostFile for ContactForce {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Cost, CostError> {
        let signal = vocabulary.contact_signal(file.contact.as_deref(), "contact_force")?;
        let kind = CostKind::ContactForce(Self { signal, target: file.target, smoothing: file.smoothing });
        Ok(Cost::weighed(kind, file.norm, file.weight, file.final_weight))
    }
}

impl Residual for ContactForce {
    fn len(&self) -> usize {
        1
    }

    fn check(&self, parameters: &Parameters) -> Result<(), (&'static str, String)> {
        match parameters.least(self.smoothing) {
            Some(least) if least < 0.0 => {
                Err(("smoothing", format!("must be at least 0 N; {}", self.smoothing.found(least))))
            }
            _ => Ok(()),
        }
    }

    fn wanted(&self, phi: &[f64]) -> Vec<(usize, f64)> {
        let target = self.target.resolve(phi);
        if target == 0.0 { Vec::new() } else { vec![(self.signal, target)] }
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, signals: &[S], out: &mut [S]) {
        let force = signals[self.signal];
        out[0] = at.value(self.target) - force.smooth_positive_part(at.value(self.smoothing));
    }
}
