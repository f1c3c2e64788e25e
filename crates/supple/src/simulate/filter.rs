use supple_kernels::{Matrices, Scratch};
use supple_lqg::{Dimensions, Innovation, InnovationCovariance};

use super::ekf::{ExtendedKalman, FilterBatch};

use crate::Error;
use crate::controller::Controller;

/// The filter that a closed loop runs.
#[derive(Clone, Copy)]
pub enum Filter<'a> {
    /// The extended one, which linearises at its estimates (theory, equations B.4 and B.5).
    Extended(ExtendedKalman<'a>),
    /// The linear filter along the plan, as in exported controllers (theory, equation B.6).
    AlongPlan(&'a Controller),
}

impl Filter<'_> {
    /// Corrects all filters with the measurements of step `t`.
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
        match self {
            Self::Extended(filter) => filter.correct(t, measured, batch, scratch),
            Self::AlongPlan(controller) => correct_along(controller, t, measured, batch),
        }
    }

    /// Predicts all filters from step `t` to `t + 1`.
    pub fn predict(&self, t: usize, controls: &Matrices, batch: &mut FilterBatch, scratch: &mut Scratch) {
        match self {
            Self::Extended(filter) => filter.predict(t, controls, batch, scratch),
            Self::AlongPlan(controller) => predict_along(controller, t, controls, batch),
        }
    }
}

fn correct_along(controller: &Controller, t: usize, measured: &Matrices, batch: &mut FilterBatch) -> Result<(), Error> {
    let Dimensions { states: n, measurements: p, .. } = controller.dimensions;
    let factor = innovation_factor(controller, t)?;
    let xbar = controller.trajectory.states.vector(t);
    let (mut before, mut innovation) = (vec![0.0; n], vec![0.0; p]);
    for sample in 0..batch.count() {
        let mean = batch.means.vector_mut(sample);
        subtract(mean, xbar, &mut before);
        controller.correct(t, measured.vector(sample), &before, &mut innovation, mean);
        add(mean, xbar);
        batch.belief.corrected.at_mut(sample).copy_from_slice(controller.corrected.at(t));
        batch.innovations[sample] = Innovation::of(&mut innovation, factor.at(0), factor.stride());
    }
    Ok(())
}

fn predict_along(controller: &Controller, t: usize, controls: &Matrices, batch: &mut FilterBatch) {
    let states = &controller.trajectory.states;
    let mut corrected = vec![0.0; controller.dimensions.states];
    for sample in 0..batch.count() {
        let mean = batch.means.vector_mut(sample);
        subtract(mean, states.vector(t), &mut corrected);
        controller.predict(t, &corrected, controls.vector(sample), mean);
        add(mean, states.vector(t + 1));
    }
}

/// The Cholesky factor of `S^y = C P C' + V` at step `t`.
fn innovation_factor(controller: &Controller, t: usize) -> Result<Matrices, Error> {
    let Controller { dimensions, measurement, predicted, noise, .. } = controller;
    let mut innovation = InnovationCovariance::zeros(dimensions.states, dimensions.measurements);
    innovation.form(measurement.at(t), predicted.at(t), noise.measurement.at(t));
    innovation.factor().ok_or_else(|| Error::not_definite("the innovation covariance of a filter", 0))
}

fn subtract(from: &[f64], what: &[f64], out: &mut [f64]) {
    out.iter_mut().zip(from).zip(what).for_each(|((out, from), what)| *out = from - what);
}

fn add(to: &mut [f64], what: &[f64]) {
    to.iter_mut().zip(what).for_each(|(to, what)| *to += what);
}
