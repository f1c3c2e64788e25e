use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Cost, CostError, CostFile, CostKind, Norm, Residual, State, Vocabulary};
use crate::{Point, Value};

/// Positions of joints against targets, rad or m.
#[derive(Clone, Debug)]
pub struct JointPosition(pub State);

/// Positions or velocities of joints against targets.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    /// Names of the joints; all that move where left out.
    select: Option<Vec<String>>,
    /// One target per selected joint; 0 where left out.
    target: Option<Vec<Value>>,
    /// Weight in every stage.
    weight: Value,
    /// Weight in the final cost; as `weight` where left out.
    final_weight: Option<Value>,
    /// How the residual becomes a cost.
    #[serde(default)]
    norm: Norm,
}

impl File {
    /// The cost of the states `PREFIX.NAME` of the joints.
    pub fn build(
        self,
        prefix: &str,
        vocabulary: &Vocabulary,
        kind: impl FnOnce(State) -> CostKind,
    ) -> Result<Cost, CostError> {
        let joints = &vocabulary.joints;
        if joints.is_empty() {
            return Err(CostError::new("kind", "the model has no joints"));
        }
        let select = self.select.unwrap_or_else(|| joints.clone());
        if let Some(name) = select.iter().find(|name| !joints.contains(name)) {
            let unknown =
                || CostError::unknown("select", &format!("the robot has no moving joint `{name}`"), name, joints);
            return Err(vocabulary.if_locked("select", name).unwrap_or_else(unknown));
        }
        let states: Vec<String> = select.iter().map(|name| format!("{prefix}.{name}")).collect();
        let kind = kind(State::select(&states, self.target, vocabulary)?);
        Ok(Cost::weighed(kind, self.norm, self.weight, self.final_weight))
    }
}

impl CostFile for JointPosition {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Cost, CostError> {
        file.build("q", vocabulary, |state| CostKind::JointPosition(Self(state)))
    }
}

impl Residual for JointPosition {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, signals: &[S], out: &mut [S]) {
        self.0.evaluate(at, signals, out);
    }
}
