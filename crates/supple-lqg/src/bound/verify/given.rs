//! What a proof starts from: the problem as given, and coordinates of a point of the dual.

use super::interval::Interval;
use super::matrix::Matrix;

/// A problem as given: `x+ = A x + w` over T decisions, or one that repeats, and what not knowing the state costs.
pub(crate) struct Given {
    /// `A_t`, `W_t` after each decision, and `Theta_t`: T of them.
    pub stages: Vec<Stage>,
    /// `X_0`; `None` if the only stage repeats for ever.
    pub initial: Option<Matrix>,
    /// What the covariances may cost.
    pub budget: Interval,
}

/// One decision.
pub(crate) struct Stage {
    pub dynamics: Matrix,
    pub process: Matrix,
    pub price: Matrix,
    /// How far each entry of the price may be from this one; `None` if it is exact.
    pub radius: Option<Matrix>,
}

/// The coordinates of a point of the dual.
pub(crate) struct Dual {
    pub steps: Vec<DualStep>,
}

/// Those of one decision.
pub(crate) struct DualStep {
    /// `E`, n x r: the covariance beside it is `E E'`.
    pub basis: Matrix,
    /// States that no price ever sees, n x k.
    pub unseen: Matrix,
}

/// Which step follows.
pub(super) fn next(count: usize, repeats: bool, t: usize) -> Option<usize> {
    if repeats { Some(0) } else { (t + 1 < count).then_some(t + 1) }
}
