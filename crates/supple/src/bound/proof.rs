//! What the proofs read of a search: the problem as given, and a point of the dual.

use supple_kernels::Matrices;

use super::horizon::{Horizon, Stationary};
use super::verify::{Dual, DualStep, Given, Interval, Matrix, Stage, information};
use super::witness::Witness;
use crate::dense::Dense;

/// Whether a lower bound is proved.
#[derive(Clone, Debug, PartialEq)]
pub enum Proof {
    /// It is, by intervals, for numbers that differ from those given by at most this, relatively: 0 where no coordinate is left
    /// out, and rounding otherwise.
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

/// Margins that a dual point is given against rounding, nats: the first that proves a bound, or the next where it proves more.
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
        let stage = |t: usize| Stage {
            dynamics: of(&horizon.dynamics, t),
            process: of(&horizon.process, t),
            price: of(&horizon.prices, t),
        };
        let last = horizon.steps().saturating_sub(1);
        // What follows the last decision does not count.
        let stages = (0..horizon.steps()).map(|t| if t < last { stage(t) } else { Stage { price: of(&horizon.prices, t), ..stage(0) } });
        let budget = Interval::point(cost) - Interval::point(horizon.base_cost);
        Self::new(&Given { stages: stages.collect(), initial: Some(of(&horizon.initial, 0)), budget }, witness)
    }

    /// Per step, where nothing changes over time.
    pub fn of_stationary(system: &Stationary, cost: f64, witness: impl Fn(f64) -> Option<Witness>) -> Self {
        let stage =
            Stage { dynamics: of(&system.dynamics, 0), process: of(&system.process, 0), price: of(&system.price, 0) };
        let budget = Interval::point(cost) - Interval::point(system.base_cost);
        Self::new(&Given { stages: vec![stage], initial: None, budget }, witness)
    }
}

/// Symmetric matrices are read as the mean with their transposes elsewhere; here as they are.
fn of(matrices: &Matrices, t: usize) -> Matrix {
    Matrix::from_fn(matrices.rows(), matrices.cols(), |i, j| matrices.get(t, i, j))
}

fn matrix(a: &Dense) -> Matrix {
    Matrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}
