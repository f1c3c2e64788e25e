use schemars::JsonSchema;
use serde::Deserialize;
use supple::cost::{NormFile, NormKind};
use supple::parameters::Parameters;
use supple::{Scalar, Value};

/// `ln(1 + (r / s)^2)`: what is further away than `s` counts little more. Beyond `s` it is not convex.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cauchy {
    /// `s`, in the residual's unit, above 0.
    scale: Value,
}

impl NormKind for Cauchy {
    const NAME: &'static str = "cauchy";

    fn value<S: Scalar>(&self, r: S, phi: &[S]) -> S {
        (r / self.scale.resolve::<S>(phi)).square().ln_1p()
    }

    fn check(&self, parameters: &Parameters) -> Result<(), String> {
        match parameters.least(&self.scale) {
            Some(least) if least <= 0.0 => Err(format!("its scale must be above 0; found {least}")),
            _ => Ok(()),
        }
    }
}

impl NormFile for Cauchy {
    type File = Self;

    fn build(file: Self) -> Self {
        file
    }
}
