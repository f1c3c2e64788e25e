//! The result of a search for the minimum: numbers, covariances, sensors and a proof.

use supple_kernels::Matrices;

use super::horizon::{Horizon, Stationary};
use super::proof::{Achieved, Lower, Proof};
use super::sensitivity::{Sensitivity, Worth};
use super::settings::BoundStatus;
use super::virtual_sensor::VirtualSensor;
use crate::dense::{Dense, dense, store};

/// The least directed information over a horizon at an expected cost, between two bounds.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug)]
pub struct MinimumInformation {
    /// Nats over the whole horizon with the covariances `posterior`: an upper bound on the minimum.
    pub nats: f64,
    /// Nats over the whole horizon below which no sensors and no controller keep the cost: from a feasible point of the
    /// dual.
    pub lower_nats: f64,
    /// The expected cost with the covariances `posterior`.
    pub cost: f64,
    /// `dR/dD`, nats per cost, at most 0: the change in information per unit increase of the cost limit.
    pub slope: f64,
    /// `A_t P_t A_t' + W_t` before the measurement at each decision, n x n, T of them; the first is `X_0`.
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
    /// Sensitivity to the covariance before each decision; empty if no information is needed.
    pub(super) worth: Worth,
    /// Whether `lower_nats` is proved.
    pub proof: Proof,
    /// What the sensors achieve; `None` if their filter does not settle.
    pub achieved: Option<Achieved>,
}

/// The same per step, for a time-invariant system.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug)]
pub struct StationaryMinimum {
    /// As in [`MinimumInformation`], per step.
    pub nats: f64,
    /// As in [`MinimumInformation`], per step.
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
    /// The sensor that attains the minimum.
    pub(super) sensor: VirtualSensor,
    /// Sensitivity to the covariance before each decision; empty if no information is needed.
    pub(super) worth: Worth,
    /// Whether `lower_nats` is proved.
    pub proof: Proof,
    /// What the sensors achieve; `None` if their filter does not settle.
    pub achieved: Option<Achieved>,
}

/// The relative distance from the minimum at which a lower bound still counts as tight.
const TIGHT: f64 = 1e-2;

/// The least gap that matters, nats per decision.
pub(super) const FINEST: f64 = 1e-14;

/// Whether the bounds are this close, or differ by an amount that does not matter, nats.
fn is_tight(nats: f64, lower_nats: f64) -> bool {
    nats - lower_nats <= (TIGHT * nats).max(FINEST)
}

impl MinimumInformation {
    fn lower(&self) -> Lower {
        Lower { nats: self.lower_nats, proof: self.proof.clone() }
    }

    /// Keeps the better of each bound of two solutions.
    pub(super) fn beside(self, other: Self) -> Self {
        let Lower { nats: lower_nats, proof } = self.lower().or(other.lower());
        let best = if other.nats <= self.nats && other.achieved.is_some() { other } else { self };
        Self { nats: best.nats.max(lower_nats), lower_nats, proof, ..best }
    }

    /// Sensitivity of the minimum to the data of its horizon (theory, equation L.32).
    #[must_use]
    pub fn sensitivity(&self, horizon: &Horizon) -> Sensitivity {
        Sensitivity::over_horizon(horizon, &self.worth, &self.posterior, self.slope)
    }
}

impl StationaryMinimum {
    fn lower(&self) -> Lower {
        Lower { nats: self.lower_nats, proof: self.proof.clone() }
    }

    /// Keeps the better of each bound of two solutions.
    pub(super) fn beside(self, other: Self) -> Self {
        let Lower { nats: lower_nats, proof } = self.lower().or(other.lower());
        let best = if other.nats <= self.nats && other.achieved.is_some() { other } else { self };
        Self { nats: best.nats.max(lower_nats), lower_nats, proof, ..best }
    }

    /// Whether the bounds are tight and the sensor keeps the cost limit.
    pub(super) fn is_tight(&self) -> bool {
        is_tight(self.nats, self.lower_nats) && matches!(self.proof, Proof::Proved { .. })
    }

    /// The minimum for `R x`, with `R` the identity in the states `kept`, expressed in `x`: the others take their values of
    /// least uncertainty given these.
    pub(super) fn among_all(self, rows: &Dense, kept: &[usize]) -> Self {
        let n = rows.ncols();
        let place = |i: usize| kept.iter().position(|&kept| kept == i);
        let covariance = |of: &Matrices| {
            let (of, mut out) = (dense(of, 0), Matrices::constant(n, n));
            let entry = |i: usize, j: usize| place(i).zip(place(j)).map_or(0.0, |at| of[at]);
            store(&mut out, 0, &Dense::from_fn(n, n, entry));
            out
        };
        let sensor = VirtualSensor {
            measurement: {
                let mut out = Matrices::zeros(1, self.sensor.rank, n);
                store(&mut out, 0, &(dense(&self.sensor.measurement, 0) * rows));
                out
            },
            gain: {
                let (gain, mut out) = (dense(&self.sensor.gain, 0), Matrices::zeros(1, n, self.sensor.rank));
                let entry = |i: usize, k: usize| place(i).map_or(0.0, |row| gain[(row, k)]);
                store(&mut out, 0, &Dense::from_fn(n, self.sensor.rank, entry));
                out
            },
            ..self.sensor
        };
        Self {
            predicted: covariance(&self.predicted),
            posterior: covariance(&self.posterior),
            worth: self.worth.among_all(rows),
            sensor,
            ..self
        }
    }

    /// The sensor that attains the minimum.
    #[must_use]
    pub fn virtual_sensor(&self) -> VirtualSensor {
        self.sensor.clone()
    }

    /// Sensitivity of the minimum per step to the data of its system (theory, equation L.32).
    #[must_use]
    pub fn sensitivity(&self, system: &Stationary) -> Sensitivity {
        Sensitivity::per_step(system, &self.worth, &self.posterior, self.slope)
    }
}

/// The sensor of each decision: what it measures, its noise and its gain (theory, equation L.13).
///
/// Example: the [module](crate::bound).
#[must_use]
pub fn virtual_sensors(minimum: &MinimumInformation) -> Vec<VirtualSensor> {
    minimum.sensors.clone()
}
