use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Cost, CostError, CostFile, CostKind, Norm, Residual, Vocabulary, targets};
use crate::{Point, Value};

/// Forces or torques in an element of compliance against targets, N or N m.
#[derive(Clone, Debug)]
pub struct CouplingForce {
    /// Place of each selected force among the model's signals, and its target.
    pub selected: Vec<(usize, Value)>,
}

/// Forces or torques in an element of compliance against targets.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Name of the element of compliance.
    coupling: String,
    /// Which of its forces.
    select: Vec<String>,
    /// One target per selected force; 0 where left out.
    target: Option<Vec<Value>>,
    /// Weight in every stage, 1/N^2 or 1/(N m)^2 (with the quadratic norm).
    weight: Value,
    /// Weight in the final cost; as `weight` where left out.
    final_weight: Option<Value>,
    /// How the residual becomes a cost.
    #[serde(default)]
    norm: Norm,
}

impl CostFile for CouplingForce {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Cost, CostError> {
        if file.select.is_empty() {
            return Err(CostError::new("select", "name at least one force"));
        }
        let targets = targets(file.target, file.select.len(), "selected forces")?;
        let place = |force: &String| vocabulary.force_of(&file.coupling, force);
        let selected = file.select.iter().zip(targets).map(|(force, target)| Ok((place(force)?, target)));
        let kind = CostKind::CouplingForce(Self { selected: selected.collect::<Result<_, _>>()? });
        Ok(Cost::weighed(kind, file.norm, file.weight, file.final_weight))
    }
}

impl Residual for CouplingForce {
    fn len(&self) -> usize {
        self.selected.len()
    }

    fn wanted(&self, phi: &[f64]) -> Vec<(usize, f64)> {
        let targets = self.selected.iter().map(|&(signal, target)| (signal, target.resolve(phi)));
        targets.filter(|&(_, target)| target != 0.0).collect()
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, signals: &[S], out: &mut [S]) {
        for (out, &(signal, target)) in out.iter_mut().zip(&self.selected) {
            *out = signals[signal] - at.value(target);
        }
    }
}
