use supple_kernels::Scalar;

use super::joint_position::File;
use super::{Cost, CostError, CostFile, CostKind, Residual, State, Vocabulary};
use crate::Point;

/// Velocities of joints against targets, rad/s or m/s.
#[derive(Clone, Debug)]
pub struct JointVelocity(pub State);

impl CostFile for JointVelocity {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Cost, CostError> {
        file.build("v", vocabulary, |state| CostKind::JointVelocity(Self(state)))
    }
}

impl Residual for JointVelocity {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, signals: &[S], out: &mut [S]) {
        self.0.evaluate(at, signals, out);
    }
}
