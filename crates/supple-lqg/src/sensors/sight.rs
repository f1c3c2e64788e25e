use supple_kernels::{Matrices, rows};

use super::plant::Plant;
use crate::belief::{Belief, BeliefAdjoint, BeliefSeeds, kalman_to_the_end, reverse_kalman};
use crate::dense::{Dense, dense, eigen, store};
use crate::given::{Given, MEASUREMENT};
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
#[non_exhaustive]
pub struct Worth {
    /// Expected cost, along the plan as it is.
    pub cost: f64,
    /// Directed information from the state to the measurements, nats.
    pub information: f64,
}

impl Worth {
    /// Of sensors with which the filter fails: worse than any other, whatever the goal.
    pub(super) const NONE: Self = Self { cost: f64::INFINITY, information: f64::NEG_INFINITY };
}

/// Memory for one thread.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    gradients: bool,
    sweeps: Option<Sweeps>,
}

/// Memory of the sweeps over some number of rows.
#[derive(Clone, Debug)]
struct Sweeps {
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
    /// Where arrays do not fit each other, noise is not positive definite, is shared between owners, or the value of information is indefinite.
    pub fn new(Plant { knots, noise, value, fixed, .. }: Plant, owners: Vec<Option<usize>>) -> Result<Self, Error> {
        let (dimensions, steps) = (knots.dimensions, knots.steps());
        knots.check_shapes()?;
        noise.check(dimensions, steps)?;
        let shape = (dimensions.states, dimensions.states);
        Given { what: VALUE, array: value, shape, count: steps }.check_finite()?;
        check_semidefinite(value)?;
        let rows = whitened(&knots.measurement, &noise.measurement, steps, &owners)?;
        let Noise { initial, process, .. } = noise.clone();
        let (dynamics, value) = (knots.dynamics.clone(), value.clone());
        Ok(Self { dynamics, dimensions, initial, process, value, rows, owners, fixed })
    }

    /// Memory for [`worth`](Self::worth) and, with `gradients`, for [`gradient`](Self::gradient).
    pub fn memory(&self, gradients: bool) -> Memory {
        Memory { gradients, sweeps: None }
    }

    /// Memory of sweeps over so many rows of the measurement, with the dynamics of earlier ones.
    fn sized(&self, rows: usize, gradients: bool, earlier: Option<Sweeps>) -> Sweeps {
        let (n, steps) = (self.dimensions.states, self.dynamics.count());
        let dimensions = Dimensions { measurements: rows, ..self.dimensions };
        let mut measurement = Matrices::constant(rows, rows);
        (0..rows).for_each(|i| measurement.set(0, i, i, 1.0));
        // No sweep of the belief reads the cost.
        let cost = Matrices::default;
        let dynamics = earlier.map_or_else(|| self.dynamics.clone(), |earlier| earlier.knots.dynamics);
        let seen = Matrices::zeros(steps + 1, rows, n);
        Sweeps {
            knots: Knots { dimensions, dynamics, measurement: seen.clone(), cost: cost(), picks: None },
            noise: Noise { initial: self.initial.clone(), process: self.process.clone(), measurement },
            belief: Belief::zeros(n, rows, steps),
            information: Information::default(),
            reverse: gradients.then(|| Reverse {
                work: BeliefAdjoint::keeping(n, rows, steps),
                adjoints: KnotAdjoints {
                    dynamics: Matrices::zeros(steps, n, self.dimensions.joint()),
                    measurement: seen,
                    cost: cost(),
                    has_cost: false,
                },
                by_noise: Noise::zeros(n, rows),
                seen: vec![0.0; n],
            }),
        }
    }

    /// Cost and information with given weights of the candidates, each from 0 to 1; [`Worth::NONE`] if the filter fails.
    pub fn worth(&self, z: &[f64], memory: &mut Memory) -> Worth {
        let present: Vec<usize> = (0..self.owners.len()).filter(|&row| self.weight(row, z) > 0.0).collect();
        let (n, steps) = (self.dimensions.states, self.dynamics.count());
        // More rows than states tell as much as the triangular factor of them.
        let count = present.len().min(n);
        let Memory { gradients, sweeps } = memory;
        let known = sweeps.take();
        let Sweeps { knots, noise, belief, information: told, .. } = sweeps.insert(match known {
            Some(known) if known.knots.dimensions.measurements == count => known,
            earlier => self.sized(count, *gradients, earlier),
        });
        let roots: Vec<f64> = present.iter().map(|&row| self.weight(row, z).sqrt()).collect();
        for t in 0..=steps {
            let entry = |i: usize, j: usize| roots[i] * self.rows.get(t, present[i], j);
            if present.len() > n {
                store(&mut knots.measurement, t, &Dense::from_fn(present.len(), n, entry).qr().unpack_r());
            } else {
                (0..count).for_each(|i| (0..n).for_each(|j| knots.measurement.set(t, i, j, entry(i, j))));
            }
        }
        if kalman_to_the_end(knots, noise, belief).and_then(|()| information(belief, noise, told)).is_err() {
            return Worth::NONE;
        }
        let errors: f64 = (0..steps).map(|t| rows::dot(self.value.at(t), belief.corrected.at(t))).sum();
        Worth { cost: self.fixed + 0.5 * errors, information: told.total }
    }

    /// How much rounding may change the information: each row adds the logarithm of a number near 1.
    pub fn rounding(&self) -> f64 {
        4.0 * f64::EPSILON * ((self.dynamics.count() + 1) * self.owners.len()) as f64
    }

    /// The same; adds to `gradient` the derivatives, by the weights, of the quantity that `of` defines: with the adjoint
    /// `Sb` of `Sigma_t` and `h = Sigma c`, the row `c` of a candidate adds `i/2 c' h - h' Sb h` (theory, equation N.4).
    pub fn gradient(&self, z: &[f64], of: Weights, memory: &mut Memory, gradient: &mut [f64]) -> Worth {
        let worth = self.worth(z, memory);
        let Some(Sweeps { knots, noise, belief, reverse: Some(reverse), .. }) = &mut memory.sweeps else {
            return worth;
        };
        if worth == Worth::NONE {
            return worth;
        }
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
        let what = VALUE;
        let found = eigen(dense(value, t)).ok_or(Error::NotFinite { what, step: t })?.eigenvalues;
        greatest = greatest.max(found.max());
        if found.min() < least {
            (least, step) = (found.min(), t);
        }
    }
    if least < -INDEFINITE * greatest { Err(Error::NotPositiveDefinite { what: VALUE, step }) } else { Ok(()) }
}

const VALUE: &str = "the value of information";

/// Eigenvalues of the value of information down to this, relative to the greatest of all steps, are rounding.
const INDEFINITE: f64 = 1e-9;

/// `L^-1 C` with the Cholesky factor `L` of the noise, at each of `steps` steps and the end.
fn whitened(c: &Matrices, v: &Matrices, steps: usize, owners: &[Option<usize>]) -> Result<Matrices, Error> {
    let (n, p) = (c.cols(), c.rows());
    let mut rows = Matrices::zeros(steps + 1, p, n);
    let mut factor = vec![0.0; p * p];
    for t in 0..=steps {
        for i in 0..p {
            for j in 0..=i {
                let shared = v.get(t, i, j);
                if shared != 0.0 && owners[i] != owners[j] {
                    return Err(Error::CorrelatedSensors { first: j, second: i });
                }
                factor[i * p + j] = shared;
            }
        }
        let indefinite = |_| Error::NotPositiveDefinite { what: MEASUREMENT, step: t };
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
