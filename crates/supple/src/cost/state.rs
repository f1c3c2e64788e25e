use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Cost, CostError, CostFile, CostKind, Norm, Residual, Vocabulary};
use crate::{Point, Value};

/// Selected states against targets.
#[derive(Clone, Debug)]
pub struct State {
    /// Place of each selected state, and its target.
    pub selected: Vec<(usize, Value)>,
}

/// Selected states against targets.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Names of the states.
    select: Vec<String>,
    /// One target per selected state; 0 where left out.
    target: Option<Vec<Value>>,
    /// Weight in every stage.
    weight: Value,
    /// Weight in the final cost; as `weight` where left out.
    final_weight: Option<Value>,
    /// How the residual becomes a cost.
    #[serde(default)]
    norm: Norm,
}

impl CostFile for State {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Cost, CostError> {
        let kind = CostKind::State(Self::select(&file.select, file.target, vocabulary)?);
        Ok(Cost::weighed(kind, file.norm, file.weight, file.final_weight))
    }
}

impl State {
    /// The states with these names, and one target each; 0 where there are none.
    pub(super) fn select(
        names: &[String],
        targets: Option<Vec<Value>>,
        vocabulary: &Vocabulary,
    ) -> Result<Self, CostError> {
        if names.is_empty() {
            return Err(CostError::new("select", "name at least one"));
        }
        let targets = super::targets(targets, names.len(), "that are selected")?;
        let selected = names.iter().zip(targets).map(|(name, target)| {
            let index = vocabulary.states.iter().position(|state| state == name);
            let unknown = || {
                let what = format!("the model has no state `{name}`");
                let locked = vocabulary.if_locked("select", name);
                locked.unwrap_or_else(|| CostError::unknown("select", &what, name, &vocabulary.states))
            };
            Ok((index.ok_or_else(unknown)?, target))
        });
        Ok(Self { selected: selected.collect::<Result<_, _>>()? })
    }
}

impl Residual for State {
    fn len(&self) -> usize {
        self.selected.len()
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, _: &[S], out: &mut [S]) {
        for (out, &(index, target)) in out.iter_mut().zip(&self.selected) {
            *out = at.x[index] - at.value(target);
        }
    }
}
