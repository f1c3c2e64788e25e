use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Reach, Unfit, Vocabulary};
use crate::channels::Channel;
use crate::physics::Point;

/// Penetration depth of a contact, negative when apart, m.
///
/// Example: the [module](crate::quantity).
#[derive(Clone, Debug)]
pub struct Penetration {
    signal: usize,
}

/// A contact's signed depth or clearance, m.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the contact, in models that name theirs.
    contact: Option<String>,
}

impl File {
    /// The place of the contact's depth among the model's signals.
    pub fn signal(self, vocabulary: &Vocabulary) -> Result<usize, Unfit> {
        vocabulary.contact_signal(self.contact.as_deref(), "penetration")
    }
}

impl Penetration {
    /// The depth that is the model's signal at a place.
    #[must_use]
    pub fn new(signal: usize) -> Self {
        Self { signal }
    }
}

impl QuantityFile for Penetration {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        file.signal(vocabulary).map(Self::new)
    }
}

impl Measurable for Penetration {
    const NAME: &'static str = "penetration";

    fn len(&self) -> usize {
        1
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        vec![vocabulary.contact_channel(self.signal, "depth", "m")]
    }

    fn reach(&self) -> Reach {
        Reach { signals: self.signal + 1, ..Reach::default() }
    }

    fn evaluate<S: Scalar>(&self, _: &Point<S>, known: &Known<S>, out: &mut [S]) {
        out[0] = known.signals[self.signal];
    }

    fn signal_of(&self, _: usize) -> Option<usize> {
        Some(self.signal)
    }

    fn depth_of(&self, target: f64) -> Option<(usize, f64)> {
        Some((self.signal, target))
    }
}
