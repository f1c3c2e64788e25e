use supple_kernels::{Matrices, Scratch};
use supple_lqg::{Belief, Dimensions, Innovation, Knots, Noise, SampleNoise, correct_each, predict_each};
use supple_model::noise::{VaryingNoise, VaryingVariance};
use supple_model::system::{Points, System, Times};

use crate::Error;

/// Extended Kalman filters of a batch of samples in step with one another; each linearises at its own estimate.
///
/// Matrices and vectors are indexed by sample.
///
/// ```
/// use supple::Dimensions;
/// use supple::lqg::Noise;
/// use supple::simulate::FilterBatch;
///
/// let mut filters = FilterBatch::new(Dimensions { states: 2, controls: 1, measurements: 1 }, 3);
/// filters.start(&[1.0, 0.0], &Noise::zeros(2, 1));
/// assert_eq!((filters.count(), filters.means.vector(2)), (3, &[1.0, 0.0][..]));
/// ```
#[derive(Clone, Debug)]
pub struct FilterBatch {
    /// Estimates `mu`, length n.
    pub means: Matrices,
    /// Covariances, in the corrected and predicted matrices of a belief.
    pub belief: Belief,
    knots: Knots,
    /// Innovations of the filters at the last measurements.
    pub innovations: Vec<Innovation>,
    /// Measurements to expect, length p.
    expected: Matrices,
    /// Predicted next states, length n.
    next: Matrices,
    /// Placeholder for controls where they do not matter.
    idle: Matrices,
    /// `V` at the estimates, p x p, where it varies with the state.
    variances: Matrices,
}

/// The model that a filter assumes.
#[derive(Clone, Copy)]
pub struct ExtendedKalman<'a> {
    /// The system.
    pub system: &'a dyn System,
    /// All parameters.
    pub phi: &'a [f64],
    /// The noise, except for what varies with the state.
    pub noise: &'a Noise,
    /// Number of parts into which it divides each of the system's integration steps; 1 leaves the steps as they are.
    pub parts: usize,
    /// State-dependent noise, evaluated at the estimate before the measurement, where the filter also linearises.
    pub varying: &'a [VaryingVariance],
}

impl FilterBatch {
    /// Room for `count` samples.
    #[must_use]
    pub fn new(dimensions: Dimensions, count: usize) -> Self {
        Self {
            means: Matrices::vectors(count, dimensions.states),
            belief: Belief::zeros(dimensions.states, dimensions.measurements, count - 1),
            knots: Knots::zeros(dimensions, count),
            innovations: vec![Innovation::default(); count],
            expected: Matrices::vectors(count, dimensions.measurements),
            next: Matrices::vectors(count, dimensions.states),
            idle: Matrices::vectors(count, dimensions.controls),
            variances: Matrices::zeros(count, dimensions.measurements, dimensions.measurements),
        }
    }

    /// How many samples there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.means.count()
    }

    /// Sets all filters to the first state's mean and covariance.
    pub fn start(&mut self, mean: &[f64], noise: &Noise) {
        (0..self.count()).for_each(|sample| self.start_one(sample, mean, noise));
    }

    /// Sets the filter of one sample to the first state's mean and covariance.
    pub fn start_one(&mut self, sample: usize, mean: &[f64], noise: &Noise) {
        self.means.vector_mut(sample).copy_from_slice(mean);
        self.belief.predicted.at_mut(sample).copy_from_slice(noise.initial.at(0));
    }
}

impl ExtendedKalman<'_> {
    /// Takes in measurements of step `t`, one per sample.
    ///
    /// # Errors
    /// Where an innovation covariance is not positive definite; the step is that of the sample.
    pub fn correct(
        &self,
        t: usize,
        measured: &Matrices,
        batch: &mut FilterBatch,
        scratch: &mut Scratch,
    ) -> Result<(), Error> {
        let FilterBatch { means, belief, knots, innovations, expected, idle, variances, .. } = batch;
        let count = means.count();
        let at = Points { states: means, controls: idle, stages: count, has_end: false, times: Times::At(t) };
        let picks = self.system.picks().filter(|_| self.noise.measurements_are_independent());
        if picks.is_none() {
            self.system.measurement_jacobians(at, self.phi, &mut knots.measurement, scratch);
        }
        let noise = match self.varying {
            [] => SampleNoise::Shared(self.noise.measurement.at(t)),
            _ => SampleNoise::Each(self.vary(t, means, variances)),
        };
        correct_each(knots, picks, noise, belief)?;
        if let Some(picks) = picks {
            for (sample, said) in innovations.iter_mut().enumerate() {
                *said = belief.take_in(sample, picks, measured.vector(sample), means.vector_mut(sample));
            }
            return Ok(());
        }
        self.system.observe_all(at, self.phi, expected, scratch);
        for (sample, said) in innovations.iter_mut().enumerate() {
            let innovation = expected.vector_mut(sample);
            innovation.iter_mut().zip(measured.vector(sample)).for_each(|(expected, y)| *expected = y - *expected);
            let mean = means.vector_mut(sample);
            let gain = belief.gain_transposed.at(sample);
            let stride = belief.gain_transposed.stride();
            for (k, innovation) in innovation.iter().enumerate() {
                for (mean, gain) in mean.iter_mut().zip(&gain[k * stride..]) {
                    *mean += gain * innovation;
                }
            }
            let (factor, stride) = (belief.innovation_factor.at(sample), belief.innovation_factor.stride());
            *said = Innovation::of(innovation, factor, stride);
        }
        Ok(())
    }

    /// `V` of each sample at its estimate.
    fn vary<'v>(&self, t: usize, means: &Matrices, variances: &'v mut Matrices) -> &'v Matrices {
        for sample in 0..means.count() {
            variances.at_mut(sample).copy_from_slice(self.noise.measurement.at(t));
        }
        for varying in self.varying {
            let varying = VaryingNoise::of(varying, self.phi);
            (0..means.count()).for_each(|sample| varying.add(means.vector(sample), variances, sample));
        }
        variances
    }

    /// Predicts all filters from step `t` to the next under their controls.
    pub fn predict(&self, t: usize, controls: &Matrices, batch: &mut FilterBatch, scratch: &mut Scratch) {
        let FilterBatch { means, belief, knots, next, .. } = batch;
        let count = means.count();
        let at = Points { states: means, controls, stages: count, has_end: false, times: Times::At(t) };
        if self.parts == 1 {
            self.system.dynamics_jacobians(at, self.phi, &mut knots.dynamics, scratch);
            self.system.step_all(at, self.phi, next, scratch);
        } else {
            self.system.dynamics_jacobians_in(self.parts, at, self.phi, &mut knots.dynamics, scratch);
            self.system.step_all_in(self.parts, at, self.phi, next, scratch);
        }
        predict_each(knots, self.noise.process.at(t), belief);
        means.copy_from(next);
    }
}
