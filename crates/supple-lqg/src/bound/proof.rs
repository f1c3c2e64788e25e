//! Input of the proofs from a search: the problem as given, and a dual point.

use std::f64::consts::LN_2;

use supple_kernels::{Matrices, halt};

use super::along::Spread;
use super::free::matrix;
use super::horizon::{Horizon, Stationary};
use super::verify::{
    Dual, DualStep, Filtered, Given, Interval, Matrix, Proving, Sensor, Stage, over_horizon, steady,
    steady_law_distance,
};
use super::virtual_sensor::VirtualSensor;
use super::witness::{Witness, WitnessStep};
use crate::dense::{Dense, dense};

/// Whether a lower bound is proved.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, PartialEq)]
pub enum Proof {
    /// Proved by interval arithmetic, for numbers that differ from those given by at most `distance`, relatively: 0 if no
    /// coordinate is left out, otherwise of the order of rounding.
    Proved {
        /// The relative distance.
        distance: f64,
    },
    /// Not proved; the lower bound is 0.
    NotProved {
        /// The reason.
        reason: String,
    },
}

/// A lower bound in nats with its proof.
pub(super) struct Lower {
    pub nats: f64,
    pub proof: Proof,
}

/// Margins against rounding to add to a dual point, nats: stops at the first that proves a bound, or at the next
/// one, if that proves more.
const MARGINS: [f64; 6] = [0.0, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7];

/// The difference by rounding between rates that should agree, relatively and in nats.
const CONSISTENT: f64 = 1e-11;

/// If a dual point proves this share of the search result, no second one is tried.
const ENOUGH: f64 = 1.0 - 1e-5;

/// The largest relative coupling to other states of the states left out because they cost nothing.
const LEFT_OUT: f64 = 1e-9;

/// Dual points with which to prove a bound near this many nats, tried in turn until one is good enough.
pub(super) struct Attempt<'a> {
    pub nats: f64,
    pub witnesses: [&'a dyn Fn() -> Witness; 2],
}

impl Lower {
    fn of_any(given: &Given, attempt: &Attempt) -> Self {
        let is_proved = |one: &Self| matches!(one.proof, Proof::Proved { .. });
        let [first, second] = attempt.witnesses;
        let best = Self::new(given, &first());
        if is_proved(&best) && best.nats >= ENOUGH * attempt.nats {
            return best;
        }
        let other = Self::new(given, &second());
        if is_proved(&other) && (!is_proved(&best) || other.nats > best.nats) { other } else { best }
    }

    fn new(given: &Given, witness: &Witness) -> Self {
        let mut best = Self { nats: 0.0, proof: Proof::NotProved { reason: "there is no dual point".into() } };
        let dual = Dual { steps: witness.steps.iter().map(dual_step).collect() };
        let proving = match Proving::new(given, &dual) {
            Ok(proving) => proving,
            Err(reason) => return Self { nats: 0.0, proof: Proof::NotProved { reason } },
        };
        let mut first = true;
        for margin in MARGINS {
            if halt::is_requested() {
                break;
            }
            let Some((price, multipliers)) = witness.with_margin(margin) else { continue };
            let multipliers: Vec<Matrix> = multipliers.iter().map(matrix).collect();
            let proved = matches!(best.proof, Proof::Proved { .. });
            match proving.information(price, &multipliers, &halt::is_requested) {
                Ok(found) if !proved || found.nats > best.nats => {
                    best = Self { nats: found.nats, proof: Proof::Proved { distance: found.distance } };
                }
                Err(reason) if first => best.proof = Proof::NotProved { reason },
                _ => {}
            }
            first = false;
            if proved {
                break;
            }
        }
        best
    }

    /// The greater of two lower bounds; if only one is proved, that one.
    pub fn or(self, other: Self) -> Self {
        let is_proved = |one: &Self| matches!(one.proof, Proof::Proved { .. });
        let first = is_proved(&self) && self.nats >= other.nats || !is_proved(&other);
        if first { self } else { other }
    }

    /// Over a horizon with the error `spread`.
    pub fn of_horizon(horizon: &Horizon, spread: &Spread, cost: f64, attempt: &Attempt) -> Self {
        let [below, above] = spread.least;
        let least = Interval::point(horizon.base_cost) + Interval { low: -below, high: above };
        let mut stages = stages(horizon);
        if let Some(radii) = &spread.prices {
            stages.iter_mut().enumerate().for_each(|(t, stage)| stage.radius = Some(of(radii, t)));
        }
        let budget = Interval::point(cost) - least;
        Self::of_any(&Given { stages, initial: Some(of(&horizon.initial, 0)), budget }, attempt)
    }

    /// The same compared with what sensors achieve at the requested cost; also returns the upper bound, nats, where the
    /// search found `nats`. What sensors achieve is an upper bound too, without the excess due to the barriers.
    /// It cannot be below the proved bound: if it is, one of the two is wrong, and neither is used.
    pub fn beside(self, kept: Option<Achieved>, nats: f64) -> (Self, f64) {
        let achieved = kept.map_or(nats, |achieved| achieved.nats);
        if kept.is_some() && achieved < self.nats * (1.0 - CONSISTENT) - CONSISTENT {
            let reason = format!(
                "the virtual sensor achieves {:.7} bits, less than the bound of {:.7}",
                achieved / LN_2,
                self.nats / LN_2
            );
            return (Self { nats: 0.0, proof: Proof::NotProved { reason } }, nats);
        }
        let least = achieved.min(nats).max(self.nats);
        (self, least)
    }

    /// Per step, in the time-invariant case.
    pub fn of_stationary(system: &Stationary, cost: f64, attempt: &Attempt) -> Self {
        // The least cost is rounded to the nearest number.
        let least = Interval { low: system.base_cost.next_down(), high: system.base_cost.next_up() };
        let budget = Interval::point(cost) - least;
        Self::of_any(&Given { stages: vec![stage(system)], initial: None, budget }, attempt)
    }
}

/// Why the time-invariant regulator could not be proved to be exact for a cost near the given one.
///
/// ```
/// use supple_lqg::bound::{Stationary, regulator_distance};
/// use supple_lqg::constant;
///
/// // The price of uncertainty is that of x+ = x + u with the cost (x^2 + u^2) / 2 per step, not of another plant.
/// let (cost, one) = (constant(&[[1.0, 0.0], [0.0, 1.0]]), constant(&[[1.0]]));
/// let plant = Stationary::new(&constant(&[[1.0, 1.0]]), &one, &cost)?;
/// let unproved = regulator_distance(&plant, &constant(&[[0.5, 1.0]]), &cost).err();
/// assert!(unproved.is_some_and(|unproved| unproved.reason.contains("Riccati")));
/// # Ok::<(), supple_lqg::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
#[non_exhaustive]
pub struct Unproved {
    /// Which step of the proof failed.
    pub reason: String,
}

/// The relative distance of the given cost from one for which the time-invariant regulator is exact.
///
/// # Errors
/// If no such distance can be proved, or the computation is stopped.
///
/// Example: [`own_rates`](crate::bound::own_rates).
pub fn regulator_distance(system: &Stationary, dynamics: &Matrices, cost: &Matrices) -> Result<f64, Unproved> {
    distance_of(system, dynamics, cost).map_err(|reason| Unproved { reason })
}

fn distance_of(system: &Stationary, dynamics: &Matrices, cost: &Matrices) -> Result<f64, String> {
    let (dynamics, cost, price) = (matrix(&dense(dynamics, 0)), matrix(&dense(cost, 0)), of(&system.price, 0));
    let Some(quotient) = system.quotient() else {
        return steady_law_distance(&dynamics, &cost, &price, &halt::is_requested);
    };
    let process = of(&system.process, 0);
    let fewer = quotient.of(&dynamics, &cost, &process);
    let left_out = quotient.distance(&fewer, &dynamics, &cost, &process).max(quotient.price_distance(&price));
    if left_out > LEFT_OUT {
        return Err(format!("states that should cost nothing are coupled to those that do by {left_out:.1e}"));
    }
    let price = quotient.price(&price);
    Ok(steady_law_distance(&fewer.dynamics, &fewer.cost, &price, &halt::is_requested)?.max(left_out))
}

/// What sensors achieve, computed by their Kalman filter on the problem as given.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Achieved {
    /// Directed information, nats: over all decisions, or per step where nothing changes over time.
    pub nats: f64,
    /// The expected cost with the optimal regulator.
    pub cost: f64,
}

impl Achieved {
    /// Over a horizon.
    pub(super) fn of_horizon(horizon: &Horizon, sensors: &[VirtualSensor]) -> Option<Self> {
        let sensors: Vec<Sensor> = sensors.iter().map(sensor).collect();
        let found = over_horizon(&stages(horizon), &of(&horizon.initial, 0), &sensors)?;
        Some(Self { nats: found.nats, cost: horizon.base_cost + found.price })
    }

    /// Per step in the steady state near a point of the dual, with the covariance before the measurement.
    pub(super) fn of_stationary(system: &Stationary, one: &VirtualSensor, near: &WitnessStep) -> Option<(Self, Dense)> {
        let found = steady(&stage(system), &dual_step(near), &sensor(one), &halt::is_requested)?;
        let n = near.basis.nrows();
        let predicted = Dense::from_fn(n, n, |i, j| found.predicted.at(i, j));
        let Filtered { nats, price } = found.filtered;
        Some((Self { nats, cost: system.base_cost + price }, predicted))
    }

    /// Whether the sensors keep the cost limit, up to rounding.
    pub(super) fn keeps(&self, cost: f64, base: f64) -> bool {
        self.cost - base <= (cost - base) * (1.0 + 1e-9) + 1e-14 * base.abs()
    }
}

fn dual_step(step: &WitnessStep) -> DualStep {
    DualStep { basis: matrix(&step.basis), unseen: matrix(&step.unseen) }
}

fn sensor(one: &VirtualSensor) -> Sensor {
    let measurement = Matrix::from_fn(one.rank, one.measurement.cols(), |i, j| one.measurement.get(0, i, j));
    Sensor { measurement, variances: one.variances.clone() }
}

fn stages(horizon: &Horizon) -> Vec<Stage> {
    let last = horizon.steps().saturating_sub(1);
    // What follows the last decision is irrelevant.
    let at = |of_all: &Matrices, t: usize| of(of_all, if t < last { t } else { 0 });
    let stage = |t: usize| Stage {
        dynamics: at(&horizon.dynamics, t),
        process: at(&horizon.process, t),
        price: of(&horizon.prices, t),
        radius: None,
    };
    (0..horizon.steps()).map(stage).collect()
}

fn stage(system: &Stationary) -> Stage {
    let (dynamics, process, price) = (of(&system.dynamics, 0), of(&system.process, 0), of(&system.price, 0));
    Stage { dynamics, process, price, radius: None }
}

/// Elsewhere symmetric matrices are averaged with their transposes; here they are read as they are.
fn of(matrices: &Matrices, t: usize) -> Matrix {
    Matrix::from_fn(matrices.rows(), matrices.cols(), |i, j| matrices.get(t, i, j))
}
