use supple_kernels::Matrices;

use crate::{Knots, Noise};

/// A plant along its trajectory with every candidate sensor, and what it costs.
///
/// Example: [`Selection`](super::Selection).
#[derive(Clone, Copy, Debug)]
pub struct Plant<'a> {
    /// The plant; its measurements are those of all sensors.
    pub knots: &'a Knots,
    /// The noise; that of different sensors is independent.
    pub noise: &'a Noise,
    /// `Xi_t`, n x n, N of them: what an error of the estimate costs.
    pub value: &'a Matrices,
    /// The part of the expected cost that no sensor changes.
    pub fixed: f64,
    /// Weight of the plant's information in the sum over several.
    pub weight: f64,
}
