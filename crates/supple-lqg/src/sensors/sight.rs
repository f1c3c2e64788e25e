use supple_kernels::{Matrices, rows};

use super::Plant;
use crate::belief::{Belief, BeliefAdjoint, BeliefSeeds, kalman, reverse_kalman};
use crate::dense::{dense, eigen};
use crate::information::{Information, information};
use crate::{Dimensions, Error, KnotAdjoints, Knots, Noise};

/// What a filter sees of one plant when each candidate sensor counts with a weight: a candidate with the weight `z` has
/// `1 / z` times its noise, at 0 it is absent (theory, equation N.1).
#[derive(Clone, Debug)]
pub(super) struct Sight {
    /// `[A B]`, n x (n + m), N of them.
    dynamics: Matrices,
    dimensions: Dimensions,
    /// `X_0` and `W`.
    initial: Matrices,
    process: Matrices,
    /// `Xi_t`, n x n, N of them.
    value: Matrices,
    /// Rows `c` of the measurement divided by their noise's root, p x n, N + 1 of them: unit noise, independent.
    rows: Matrices,
    /// Owner of each row: a candidate, or `None` for a sensor that is always there.
    owners: Vec<Option<usize>>,
    /// The part of the cost that no sensor changes.
    fixed: f64,
}

/// What a set of sensors is worth in one plant, or in several together.
///
/// Example: [`Searched`](crate::sensors::Searched).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Worth {
    /// Expected cost, along the plan as it is.
    pub cost: f64,
    /// Directed information from the state to the measurements, nats.
    pub information: f64,
}

impl Worth {
    /// Of a filter whose covariance is not finite.
    const NONE: Self = Self { cost: f64::INFINITY, information: f64::INFINITY };
}

/// Memory of the sweeps, for one thread.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    /// The plant with the rows of the sensors that are present.
    knots: Knots,
    noise: Noise,
    belief: Belief,
    information: Information,
    reverse: Option<Reverse>,
}

/// Memory of the backward sweep.
#[derive(Clone, Debug)]
struct Reverse {
    work: BeliefAdjoint,
    adjoints: KnotAdjoints,
    by_noise: Noise,
    /// `Sigma c`.
    seen: Vec<f64>,
}

/// Which number is differentiated: `cost` times the cost plus `information` times the directed information.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    pub cost: f64,
    pub information: f64,
}

impl Sight {
    /// Builds it for a plant. `owners` maps each measurement to a candidate, or to none if it is always made.
    ///
    /// # Errors
    /// Where noise is not positive definite, is shared between owners, or the value of information is indefinite.
    pub fn new(Plant { knots, noise, value, fixed, .. }: Plant, owners: Vec<Option<usize>>) -> Result<Self, Error> {
        check_semidefinite(value)?;
        let rows = whitened(&knots.measurement, &noise.measurement, &owners)?;
        let Noise { initial, process, .. } = noise.clone();
        let (dynamics, value) = (knots.dynamics.clone(), value.clone());
        Ok(Self { dynamics, dimensions: knots.dimensions, initial, process, value, rows, owners, fixed })
    }

    /// Memory for [`worth`](Self::worth) and, with `gradients`, for [`gradient`](Self::gradient).
    pub fn memory(&self, gradients: bool) -> Memory {
        self.sized(0, gradients)
    }

    /// The same with so many rows of the measurement.
    fn sized(&self, present: usize, gradients: bool) -> Memory {
        let (n, steps) = (self.dimensions.states, self.dynamics.count());
        let dimensions = Dimensions { measurements: present, ..self.dimensions };
        let mut measurement = Matrices::constant(present, present);
        (0..present).for_each(|i| measurement.set(0, i, i, 1.0));
        Memory {
            knots: Knots { dynamics: self.dynamics.clone(), ..Knots::zeros(dimensions, steps) },
            noise: Noise { initial: self.initial.clone(), process: self.process.clone(), measurement },
            belief: Belief::zeros(n, present, steps),
            information: Information::default(),
            reverse: gradients.then(|| Reverse {
                work: BeliefAdjoint::keeping(n, present, steps),
                adjoints: KnotAdjoints::zeros(dimensions, steps),
                by_noise: Noise::zeros(n, present),
                seen: vec![0.0; n],
            }),
        }
    }

    /// Cost and information with given weights of the candidates, each from 0 to 1; infinite where the filter has none.
    pub fn worth(&self, z: &[f64], memory: &mut Memory) -> Worth {
        let present: Vec<usize> = (0..self.owners.len()).filter(|&row| self.weight(row, z) > 0.0).collect();
        if memory.knots.dimensions.measurements != present.len() {
            *memory = self.sized(present.len(), memory.reverse.is_some());
        }
        let (n, steps) = (self.dimensions.states, self.dynamics.count());
        for (i, &row) in present.iter().enumerate() {
            let root = self.weight(row, z).sqrt();
            for t in 0..=steps {
                (0..n).for_each(|j| memory.knots.measurement.set(t, i, j, root * self.rows.get(t, row, j)));
            }
        }
        let Memory { knots, noise, belief, information: told, .. } = memory;
        if kalman(knots, noise, belief).and_then(|()| information(belief, noise, told)).is_err() {
            return Worth::NONE;
        }
        let errors: f64 = (0..steps).map(|t| rows::dot(self.value.at(t), belief.corrected.at(t))).sum();
        Worth { cost: self.fixed + 0.5 * errors, information: told.total }
    }

    /// The same; adds to `gradient` the derivatives, by the weights, of the quantity that `of` defines: with the adjoint
    /// `Sb` of `Sigma_t` and `h = Sigma c`, the row `c` of a candidate adds `i/2 c' h - h' Sb h` (theory, equation N.4).
    pub fn gradient(&self, z: &[f64], of: Weights, memory: &mut Memory, gradient: &mut [f64]) -> Worth {
        let worth = self.worth(z, memory);
        let Memory { knots, noise, belief, reverse: Some(reverse), .. } = memory else { return worth };
        let Reverse { work, adjoints, by_noise, seen } = reverse;
        let weights = Some((&self.value, of.cost));
        let seeds = BeliefSeeds { information: of.information, weights, covariances: None };
        reverse_kalman(knots, noise, belief, seeds, work, adjoints, by_noise);
        let (n, stride) = (self.dimensions.states, self.rows.stride());
        let Some(after) = work.corrected() else { return worth };
        for t in 0..=self.dynamics.count() {
            let (sigma, after) = (belief.corrected.at(t), after.at(t));
            for (row, owner) in self.owners.iter().enumerate() {
                let Some(owner) = *owner else { continue };
                let c = &self.rows.at(t)[row * stride..row * stride + n];
                let line = |matrix: &[f64], i: usize, by: &[f64]| rows::dot(&matrix[i * stride..i * stride + n], by);
                (0..n).for_each(|i| seen[i] = line(sigma, i, c));
                let through: f64 = (0..n).map(|i| seen[i] * line(after, i, seen)).sum();
                gradient[owner] += 0.5 * of.information * rows::dot(c, seen) - through;
            }
        }
        worth
    }

    fn weight(&self, row: usize, z: &[f64]) -> f64 {
        self.owners[row].map_or(1.0, |owner| z[owner])
    }
}

/// Checks that the value of information is positive semidefinite up to rounding, as convexity requires: a matrix of a step
/// may be of rounding only, so that eigenvalues are compared with those of all steps.
fn check_semidefinite(value: &Matrices) -> Result<(), Error> {
    let (mut least, mut step, mut greatest) = (0.0, 0, 0.0_f64);
    for t in 0..value.count() {
        let what = "the value of information";
        let found = eigen(dense(value, t)).ok_or(Error::NotFinite { what, step: t })?.eigenvalues;
        greatest = greatest.max(found.max());
        if found.min() < least {
            (least, step) = (found.min(), t);
        }
    }
    let what = "the value of information";
    if least < -INDEFINITE * greatest { Err(Error::NotPositiveDefinite { what, step }) } else { Ok(()) }
}

/// Eigenvalues of the value of information down to this, relative to the greatest of all steps, are rounding.
const INDEFINITE: f64 = 1e-9;

/// `L^-1 C` with the Cholesky factor `L` of the noise, step by step.
fn whitened(c: &Matrices, v: &Matrices, owners: &[Option<usize>]) -> Result<Matrices, Error> {
    let (steps, n, p) = (c.count(), c.cols(), c.rows());
    let mut rows = Matrices::zeros(steps, p, n);
    let mut factor = vec![0.0; p * p];
    for t in 0..steps {
        for i in 0..p {
            for j in 0..=i {
                let shared = v.get(t, i, j);
                if shared != 0.0 && owners[i] != owners[j] {
                    return Err(Error::CorrelatedSensors { first: j, second: i });
                }
                factor[i * p + j] = shared;
            }
        }
        let indefinite = |_| Error::NotPositiveDefinite { what: "the measurement covariance", step: t };
        rows::cholesky(&mut factor, p, p).map_err(indefinite)?;
        for i in 0..p {
            for a in 0..n {
                let above: f64 = (0..i).map(|j| factor[i * p + j] * rows.get(t, j, a)).sum();
                rows.set(t, i, a, (c.get(t, i, a) - above) / factor[i * p + i]);
            }
        }
    }
    Ok(rows)
}
