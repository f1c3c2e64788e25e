use supple_kernels::Matrices;

use super::proof::{Achieved, Proof};
use super::sensitivity::Worth;

/// How the minimum is searched for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundSettings {
    /// The duality gap at which the search ends, nats per step.
    pub gap: f64,
    /// Newton steps that it may take.
    pub max_iterations: usize,
}

impl Default for BoundSettings {
    fn default() -> Self {
        Self { gap: 1e-7, max_iterations: 200 }
    }
}

/// How a search for the minimum ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundStatus {
    /// The gap asked for is reached.
    Converged,
    /// The Newton steps allowed were too few; the bounds hold, with a larger gap than asked for.
    MaxIterations,
    /// Rounding ended the search; the bounds hold, with a larger gap than asked for.
    Stalled,
}

/// The least directed information over a horizon at an expected cost, between two bounds.
#[derive(Clone, Debug)]
pub struct MinimumInformation {
    /// Nats over the whole horizon that `posterior` needs: the minimum is at most this.
    pub nats: f64,
    /// Nats over the whole horizon below which no sensors and no controller keep the cost: from a feasible point of the dual.
    pub lower_nats: f64,
    /// The expected cost that `posterior` gives.
    pub cost: f64,
    /// `dR/dD`, nats per cost: how much information a looser bound on the cost would save, as a number of at most 0.
    pub slope: f64,
    /// `A_t P_t A_t' + W_t` before what is learnt at each decision, n x n, T of them; the first is `X_0`.
    pub predicted: Matrices,
    /// `P_t`, n x n, T of them.
    pub posterior: Matrices,
    /// Nats at each decision.
    pub per_step_nats: Vec<f64>,
    /// Newton steps taken.
    pub iterations: usize,
    /// How the search ended.
    pub status: BoundStatus,
    /// The sensor of each decision, T of them.
    pub(super) sensors: Vec<VirtualSensor>,
    /// What larger covariances before each decision are worth; empty where nothing need be known.
    pub(super) worth: Worth,
    /// Whether `lower_nats` is proved.
    pub proof: Proof,
    /// What the sensors achieve; none where their filter does not settle.
    pub achieved: Option<Achieved>,
}

/// The same per step where nothing changes over time.
#[derive(Clone, Debug)]
pub struct StationaryMinimum {
    /// As of [`MinimumInformation`], per step.
    pub nats: f64,
    /// As of [`MinimumInformation`], per step.
    pub lower_nats: f64,
    /// The expected cost per step.
    pub cost: f64,
    /// `dR/dD`, nats per cost.
    pub slope: f64,
    /// `A P A' + W`, n x n.
    pub predicted: Matrices,
    /// `P`, n x n.
    pub posterior: Matrices,
    /// Newton steps taken.
    pub iterations: usize,
    /// How the search ended.
    pub status: BoundStatus,
    /// The sensor that attains it.
    pub(super) sensor: VirtualSensor,
    /// What larger covariances before each decision are worth; empty where nothing need be known.
    pub(super) worth: Worth,
    /// Whether `lower_nats` is proved.
    pub proof: Proof,
    /// What the sensors achieve; none where their filter does not settle.
    pub achieved: Option<Achieved>,
}

/// A sensor that, with the Kalman filter and the optimal regulator, needs no more than the minimum:
/// `y = C x + v`, one at each step (theory, equation L.13).
#[derive(Clone, Debug)]
pub struct VirtualSensor {
    /// How many numbers it measures: the rank of `P^-1 - (A P A' + W)^-1 = C' V^-1 C`.
    pub rank: usize,
    /// `C`, rank x n.
    pub measurement: Matrices,
    /// The variances of `v`, the diagonal of `V`, rank.
    pub variances: Vec<f64>,
    /// The Kalman gain `L`, n x rank.
    pub gain: Matrices,
}

impl VirtualSensor {
    /// One that measures nothing of `n` states.
    pub(super) fn none(n: usize) -> Self {
        Self { rank: 0, measurement: Matrices::zeros(1, 0, n), variances: Vec::new(), gain: Matrices::zeros(1, n, 0) }
    }
}
