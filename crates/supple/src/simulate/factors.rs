use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use supple_kernels::Matrices;
use supple_kernels::math;
use supple_lqg::Noise;
use supple_lqg::semidefinite_factor;

use crate::Error;

/// How samples are drawn: factors of the covariances.
#[derive(Clone, Debug)]
pub(crate) struct NoiseFactors {
    pub(super) initial: Factors,
    pub(super) process: Factors,
    pub(super) measurement: Factors,
}

/// `G` of covariances `G G'`: one for each step, or one for all.
#[derive(Clone, Debug)]
pub(super) struct Factors {
    order: usize,
    /// Row-major, order x order each.
    each: Vec<Vec<f64>>,
}

impl Factors {
    fn of(covariance: &Matrices, what: &'static str) -> Result<Self, Error> {
        let factor = |step| semidefinite_factor(covariance, step).map_err(|_| Error::not_definite(what, step));
        let each = (0..covariance.count()).map(factor).collect::<Result<_, _>>()?;
        Ok(Self { order: covariance.rows(), each })
    }

    /// The factor of step `t`.
    pub fn at(&self, t: usize) -> Factor<'_> {
        Factor { order: self.order, entries: &self.each[if self.each.len() == 1 { 0 } else { t }] }
    }
}

/// `G` of one covariance `G G'`, row-major, order x order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factor<'a> {
    order: usize,
    entries: &'a [f64],
}

impl Factor<'_> {
    /// `ln |G G'|`
    pub fn log_determinant(&self) -> f64 {
        (0..self.order).map(|i| 2.0 * math::ln(self.entries[i * self.order + i])).sum()
    }

    /// `out += G n` with standard normal `n`, of which `n' n` is returned; draws as many numbers as the order.
    pub fn add_sample(&self, random: &mut ChaCha8Rng, out: &mut [f64]) -> f64 {
        let mut squared = 0.0;
        for column in 0..self.order {
            let normal: f64 = StandardNormal.sample(random);
            squared += normal * normal;
            for (row, out) in out.iter_mut().enumerate().skip(column) {
                *out += self.entries[row * self.order + column] * normal;
            }
        }
        squared
    }
}

impl NoiseFactors {
    pub fn of(noise: &Noise) -> Result<Self, Error> {
        Ok(Self {
            initial: Factors::of(&noise.initial, "the covariance of the first state")?,
            process: Factors::of(&noise.process, "the process covariance")?,
            measurement: Factors::of(&noise.measurement, "the measurement covariance")?,
        })
    }
}
