use serde::Deserialize;
use supple_kernels::Scalar;
use supple_kernels::graph::Node;

use super::{NormFile, NormKind};
use crate::Value;
use crate::parameters::Parameters;

/// `sqrt(r^2 + s^2) - s`: approximately `|r|` for `|r|` well above `s`
///
/// Example: the [module](crate::cost).
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(
    feature = "schema",
    schemars(description = "`sqrt(r^2 + s^2) - s`: approximately `|r|` for `|r|` well above `s`")
)]
#[serde(deny_unknown_fields)]
pub struct Absolute {
    /// `s`, in the residual's unit, above 0.
    pub smoothing: Value,
}

impl NormKind for Absolute {
    const NAME: &'static str = "absolute";

    fn value<S: Scalar>(&self, r: S, phi: &[S]) -> S {
        let s: S = self.smoothing.resolve(phi);
        r.mul_add(r, s * s).sqrt() - s
    }

    /// `s^2 / (r^2 + s^2)^(3/2)`: written this way it cannot become negative, unlike a difference of large numbers.
    fn curvature(&self, r: Node, phi: &[Node]) -> Node {
        let s: Node = self.smoothing.resolve(phi);
        let inverse = r.mul_add(r, s * s).sqrt().recip();
        s * s * inverse * inverse * inverse
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn check(&self, parameters: &Parameters) -> Result<(), String> {
        match parameters.least(&self.smoothing).filter(|&least| least <= 0.0) {
            Some(least) => Err(format!("its smoothing must be above 0; {}", self.smoothing.found(least))),
            None => Ok(()),
        }
    }
}

impl NormFile for Absolute {
    type File = Self;

    fn build(file: Self) -> Self {
        file
    }
}
