//! Input of a proof: the problem as given, and the coordinates of a dual point.

use super::interval::Interval;
use super::matrix::Matrix;

/// A problem as given: `x+ = A x + w` over T decisions, or one that repeats, with the cost of state uncertainty.
pub(crate) struct Given {
    /// `A_t`, `W_t` after each decision, and `Theta_t`: T of them.
    pub stages: Vec<Stage>,
    /// `X_0`; `None` if the only stage repeats for ever.
    pub initial: Option<Matrix>,
    /// The highest cost that the covariances may incur.
    pub budget: Interval,
}

/// One decision.
pub(crate) struct Stage {
    pub dynamics: Matrix,
    pub process: Matrix,
    pub price: Matrix,
    /// A bound on the error of each entry of the price; `None` if it is exact.
    pub radius: Option<Matrix>,
}

/// The coordinates of a point of the dual.
pub(crate) struct Dual {
    pub steps: Vec<DualStep>,
}

/// The coordinates of one decision.
pub(crate) struct DualStep {
    /// `E`, n x r: the covariance at the dual point is `E E'`.
    pub basis: Matrix,
    /// States that never affect the cost, n x k.
    pub unseen: Matrix,
}

/// Which step follows.
pub(super) fn next(count: usize, repeats: bool, t: usize) -> Option<usize> {
    if repeats { Some(0) } else { (t + 1 < count).then_some(t + 1) }
}
