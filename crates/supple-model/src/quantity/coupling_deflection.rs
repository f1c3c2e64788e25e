use supple_kernels::Scalar;

use super::coupling_force::File;
use super::{Known, Measurable, QuantityFile, Unfit, Vocabulary, pick};
use crate::channels::Channel;
use crate::physics::Point;

/// How far an element of compliance is from rest, m and rad: `deflection` of springs and elastic joints; of bushings
/// `deflection_x`, `_y` and `_z` in the half-way frame, and `deflection_roll`, `_pitch` and `_yaw`.
///
/// As a limit in a task file:
///
/// ```toml
/// limits = [{ kind = "coupling_deflection", coupling = "gripper", select = ["deflection_x"], upper = 2e-3 }]
/// ```
#[derive(Clone, Debug)]
pub struct CouplingDeflection {
    selected: Vec<usize>,
}

impl QuantityFile for CouplingDeflection {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        let coupling = file.coupling().to_owned();
        let selected = file.places(vocabulary, true)?;
        if selected.is_empty() {
            let message = format!("`{coupling}` is a contact and has no deflection; use the quantity `clearance`");
            return Err(Unfit::new("coupling", message));
        }
        Ok(Self { selected })
    }
}

impl Measurable for CouplingDeflection {
    const NAME: &'static str = "coupling_deflection";

    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        self.selected.iter().map(|&place| vocabulary.coupling_channel(place)).collect()
    }

    fn evaluate<S: Scalar>(&self, _: &Point<S>, known: &Known<S>, out: &mut [S]) {
        pick(known.signals, &self.selected, out);
    }
}
