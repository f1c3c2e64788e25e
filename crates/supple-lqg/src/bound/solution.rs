//! What a search for the minimum gives: numbers, covariances, sensors and a proof.

use supple_kernels::Matrices;

use super::horizon::{Horizon, Stationary};
use super::proof::{Achieved, Proof};
use super::sensitivity::{Sensitivity, Worth};
use super::settings::BoundStatus;
use super::virtual_sensor::VirtualSensor;

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

impl MinimumInformation {
    /// How the minimum changes with the numbers of its horizon (theory, equation L.32).
    #[must_use]
    pub fn sensitivity(&self, horizon: &Horizon) -> Sensitivity {
        Sensitivity::over_horizon(horizon, &self.worth, &self.posterior, self.slope)
    }
}

impl StationaryMinimum {
    /// The sensor that attains it.
    pub fn virtual_sensor(&self) -> VirtualSensor {
        self.sensor.clone()
    }

    /// How the minimum per step changes with the numbers of its system (theory, equation L.32).
    #[must_use]
    pub fn sensitivity(&self, system: &Stationary) -> Sensitivity {
        Sensitivity::per_step(system, &self.worth, &self.posterior, self.slope)
    }
}

/// The sensor of each decision: what it measures, its noise and its gain (theory, equation L.13).
#[must_use]
pub fn virtual_sensors(minimum: &MinimumInformation) -> Vec<VirtualSensor> {
    minimum.sensors.clone()
}
