use std::borrow::Cow;
use supple_kernels::Matrices;
use supple_lqg::Noise;
use supple_model::system::System;

use crate::Error;
use crate::problem::Task;

/// Number of parts into which a plant with finer steps divides each step of the task, and a filter each step
/// without sub-steps.
pub(super) const PARTS: usize = 16;

/// Propagates true states in place of a model: from the number of a step, states (vectors of length n) and controls
/// (vectors of length m) of all samples to their next states (vectors of length n). Numbers that are not finite are those
/// of a sample that diverged.
///
/// Example: [`Elsewhere`](crate::Elsewhere).
pub type Plant<'a> = &'a (dyn Fn(usize, &Matrices, &Matrices, &mut Matrices) + Sync);

/// The true system in a roll-out, whatever its filter assumes.
#[derive(Clone, Copy)]
pub(crate) struct Truth<'a> {
    /// Measurements, costs, contacts and limits.
    pub system: &'a dyn System,
    /// All parameters of the system.
    pub phi: &'a [f64],
    /// The dynamics.
    pub motion: Motion<'a>,
}

/// The dynamics of the true system.
#[derive(Clone, Copy)]
pub(crate) enum Motion<'a> {
    /// Those of the system.
    Own,
    /// Those of the system, with each step in so many parts.
    InParts(usize),
    /// Those of a plant.
    Plant(Plant<'a>),
}

impl Motion<'_> {
    /// In how many parts each step is taken.
    pub fn parts(self) -> usize {
        if let Self::InParts(parts) = self { parts } else { 1 }
    }
}

impl<'a> Truth<'a> {
    /// The task's own system.
    pub fn of(task: &'a Task, phi: &'a [f64]) -> Self {
        Self { system: &*task.system, phi, motion: Motion::Own }
    }
}

/// Parameters and noise: the true ones, or those that a controller assumes.
///
/// Example: [`monte_carlo`](crate::simulate::monte_carlo).
#[derive(Clone, Copy, Debug)]
pub struct World<'a> {
    /// All parameters.
    pub phi: &'a [f64],
    /// The noise: at the parameters, along any trajectory where it varies with the state.
    pub noise: &'a Noise,
}

impl<'a> World<'a> {
    /// Its noise, except for what varies with the state, which every roll-out evaluates at its own states.
    pub(crate) fn fixed_noise(self, task: &Task) -> Result<Cow<'a, Noise>, Error> {
        if task.noise.varying.is_empty() {
            return Ok(Cow::Borrowed(self.noise));
        }
        let mut noise = self.noise.clone();
        task.noise.resolve(self.phi, &mut noise)?;
        Ok(Cow::Owned(noise))
    }
}
