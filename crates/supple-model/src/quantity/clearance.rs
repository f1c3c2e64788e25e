use supple_kernels::Scalar;

use super::penetration::File;
use super::{Known, Measurable, QuantityFile, Unfit, Vocabulary};
use crate::channels::Channel;
use crate::physics::Point;

/// Distance between a contact's body and its wall, negative if the body penetrates it, m.
///
/// As a limit in a task file:
///
/// ```toml
/// limits = [{ kind = "clearance", contact = "floor", lower = 0.0, enforce = true }]
/// ```
#[derive(Clone, Debug)]
pub struct Clearance {
    /// Place of the depth among the model's signals.
    depth: usize,
}

impl QuantityFile for Clearance {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        Ok(Self { depth: file.signal(vocabulary)? })
    }
}

impl Measurable for Clearance {
    const NAME: &'static str = "clearance";

    fn len(&self) -> usize {
        1
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        vec![vocabulary.contact_channel(self.depth, "clearance", "m")]
    }

    fn evaluate<S: Scalar>(&self, _: &Point<S>, known: &Known<S>, out: &mut [S]) {
        out[0] = -known.signals[self.depth];
    }

    fn depth_of(&self, target: f64) -> Option<(usize, f64)> {
        Some((self.depth, -target))
    }
}
