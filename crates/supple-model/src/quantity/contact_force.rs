use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Reach, Unfit, Vocabulary};
use crate::Value;
use crate::channels::Channel;
use crate::parameters::Parameters;
use crate::physics::Point;

/// The normal force of a contact, N; with a smoothing `1/2 (sqrt(F^2 + smoothing^2) + F)`, which never pulls.
///
/// Example: the [module](crate::quantity).
#[derive(Clone, Debug)]
pub struct ContactForce {
    signal: usize,
    smoothing: Option<Value>,
}

/// The normal force of a contact, N.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Name of the contact, in models that name theirs.
    contact: Option<String>,
    /// Force gamma over which pulling is cut off, N; default: the force is not cut off.
    smoothing: Option<Value>,
}

impl ContactForce {
    /// The force that is the model's signal at a place.
    #[must_use]
    pub fn new(signal: usize) -> Self {
        Self { signal, smoothing: None }
    }

    /// The same, with pulling cut off over a force, N.
    #[must_use]
    pub fn with_smoothing(self, smoothing: impl Into<Value>) -> Self {
        Self { smoothing: Some(smoothing.into()), ..self }
    }
}

impl QuantityFile for ContactForce {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        let signal = vocabulary.contact_signal(file.contact.as_deref(), "contact_force")?;
        Ok(Self { signal, smoothing: file.smoothing })
    }
}

impl Measurable for ContactForce {
    const NAME: &'static str = "contact_force";

    fn len(&self) -> usize {
        1
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        let name = if self.smoothing.is_some() { "smoothed normal force" } else { "normal force" };
        vec![vocabulary.contact_channel(self.signal, name, "N")]
    }

    fn reach(&self) -> Reach {
        Reach { signals: self.signal + 1, ..Reach::default() }
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, known: &Known<S>, out: &mut [S]) {
        let force = known.signals[self.signal];
        out[0] = self.smoothing.as_ref().map_or(force, |smoothing| force.smooth_positive_part(at.value(smoothing)));
    }

    fn needs_target(&self) -> bool {
        true
    }

    fn signal_of(&self, _: usize) -> Option<usize> {
        Some(self.signal)
    }

    fn check(&self, parameters: &Parameters) -> Result<(), Unfit> {
        let Some(smoothing) = &self.smoothing else { return Ok(()) };
        match parameters.least(smoothing) {
            Some(least) if least <= 0.0 => {
                let valid = "must be above 0 N, or left out for the force as it is";
                Err(Unfit::new("smoothing", format!("{valid}; {}", smoothing.found(least))))
            }
            _ => Ok(()),
        }
    }
}
