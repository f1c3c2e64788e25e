//! What the proofs read of a search: the problem as given, and a point of the dual.

use supple_kernels::Matrices;

use super::horizon::{Horizon, Stationary};
use super::regulator::regulator;
use super::solution::VirtualSensor;
use super::verify::{
    Back, Dual, DualStep, Given, Interval, Matrix, Sensor, Stage, distance, information, is_paid, over_horizon, steady,
};
use super::witness::Witness;
use crate::dense::{Dense, dense};

/// Whether a lower bound is proved.
#[derive(Clone, Debug, PartialEq)]
pub enum Proof {
    /// It is, by intervals, for numbers that differ from those given by at most this, relatively: 0 where no coordinate
    /// is left out, and rounding otherwise.
    Proved {
        /// How far.
        distance: f64,
    },
    /// It is not; the lower bound is 0.
    NotProved {
        /// Why.
        reason: String,
    },
}

/// A lower bound in nats with its proof.
pub(super) struct Lower {
    pub nats: f64,
    pub proof: Proof,
}

/// Margins that a dual point is given against rounding, nats: the first that proves a bound, or the next where it
/// proves more.
const MARGINS: [f64; 6] = [0.0, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7];

impl Lower {
    fn new(given: &Given, witness: impl Fn(f64) -> Option<Witness>) -> Self {
        let mut best = Self { nats: 0.0, proof: Proof::NotProved { reason: "there is no dual point".into() } };
        let mut first = true;
        for margin in MARGINS {
            let Some(witness) = witness(margin) else { continue };
            let steps = witness.steps.iter().map(|step| DualStep {
                basis: matrix(&step.basis),
                unseen: matrix(&step.unseen),
                multiplier: matrix(&step.multiplier),
            });
            let proved = matches!(best.proof, Proof::Proved { .. });
            match information(given, &Dual { price: witness.price, steps: steps.collect() }) {
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

    /// Over a horizon.
    pub fn of_horizon(horizon: &Horizon, cost: f64, witness: impl Fn(f64) -> Option<Witness>) -> Self {
        let budget = Interval::point(cost) - Interval::point(horizon.base_cost);
        let given = Given { stages: stages(horizon), initial: Some(of(&horizon.initial, 0)), budget };
        Self::new(&given, witness)
    }

    /// Per step, where nothing changes over time.
    pub fn of_stationary(system: &Stationary, cost: f64, witness: impl Fn(f64) -> Option<Witness>) -> Self {
        let budget = Interval::point(cost) - Interval::point(system.base_cost);
        Self::new(&Given { stages: vec![stage(system)], initial: None, budget }, witness)
    }
}

/// How far, relatively, the cost given is from one for which the regulator of a system that does not change is exact;
/// why it is none of it otherwise.
pub fn regulator_distance(system: &Stationary, dynamics: &Matrices, cost: &Matrices) -> Result<f64, String> {
    let (n, joint) = (dynamics.rows(), dynamics.cols());
    let (f, l) = (dense(dynamics, 0), dense(cost, 0));
    let (a, b) = (f.columns(0, n).into_owned(), f.columns(n, joint - n).into_owned());
    let (s, _) = regulator(&a, &b, &l).map_err(|error| error.to_string())?;
    let (f, l, s) = (matrix(&f), matrix(&l), matrix(&s));
    let found = distance(&Back { dynamics: &f, cost: &l, next: &s, here: &s, price: &of(&system.price, 0) })?;
    if !is_paid(&f, &l, &s) {
        return Err("the regulator stabilises states that may not affect the cost".into());
    }
    Ok(found)
}

/// What sensors achieve, computed by their filter on the problem as given.
#[derive(Clone, Copy, Debug, PartialEq)]
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

    /// Per step, near the steady state with this basis of covariances.
    pub(super) fn of_stationary(system: &Stationary, one: &VirtualSensor, basis: &Dense) -> Option<Self> {
        let found = steady(&stage(system), &matrix(basis), &sensor(one))?;
        Some(Self { nats: found.nats, cost: system.base_cost + found.price })
    }

    /// Whether it keeps a cost, but for rounding.
    pub(super) fn keeps(&self, cost: f64, base: f64) -> bool {
        self.cost - base <= (cost - base) * (1.0 + 1e-9) + 1e-14 * base.abs()
    }
}

fn sensor(one: &VirtualSensor) -> Sensor {
    let measurement = Matrix::from_fn(one.rank, one.measurement.cols(), |i, j| one.measurement.get(0, i, j));
    Sensor { measurement, variances: one.variances.clone() }
}

fn stages(horizon: &Horizon) -> Vec<Stage> {
    let last = horizon.steps().saturating_sub(1);
    // What follows the last decision does not count.
    let at = |of_all: &Matrices, t: usize| of(of_all, if t < last { t } else { 0 });
    let stage = |t: usize| Stage {
        dynamics: at(&horizon.dynamics, t),
        process: at(&horizon.process, t),
        price: of(&horizon.prices, t),
    };
    (0..horizon.steps()).map(stage).collect()
}

fn stage(system: &Stationary) -> Stage {
    Stage { dynamics: of(&system.dynamics, 0), process: of(&system.process, 0), price: of(&system.price, 0) }
}

/// Symmetric matrices are read as the mean with their transposes elsewhere; here as they are.
fn of(matrices: &Matrices, t: usize) -> Matrix {
    Matrix::from_fn(matrices.rows(), matrices.cols(), |i, j| matrices.get(t, i, j))
}

fn matrix(a: &Dense) -> Matrix {
    Matrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}
