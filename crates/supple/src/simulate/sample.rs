use serde::{Deserialize, Serialize};
use supple_kernels::Matrices;
use supple_lqg::Noise;
use supple_model::or_nan;

use super::closed_loop::{ClosedLoop, Record};
use super::factors::NoiseFactors;
use super::setting::LoopSetting;
use super::truth::{Truth, World};
use crate::Error;
use crate::controller::Controller;
use crate::plan::Plan;
use crate::problem::Task;

/// One closed-loop run, up to the step where it diverges, if it does.
///
/// Example: [`Evaluation`](crate::Evaluation).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Seed of its noise.
    pub seed: u64,
    /// True states, one row per time.
    pub states: Vec<Vec<f64>>,
    /// Estimates of the filter after each measurement, one row per time.
    pub estimates: Vec<Vec<f64>>,
    /// Standard deviations that the filter gives them.
    pub deviations: Vec<Vec<f64>>,
    /// Controls, one row per step.
    pub controls: Vec<Vec<f64>>,
    /// What was measured, one row per time; empty in results of versions that did not keep it.
    #[serde(default)]
    pub measurements: Vec<Vec<f64>>,
    /// Its cost; infinite where it diverged.
    #[serde(deserialize_with = "or_nan")]
    pub cost: f64,
}

/// Which of the samples of a seed: sample i draws from stream i.
///
/// Example: [`monte_carlo`](super::monte_carlo).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleId {
    /// The seed.
    pub seed: u64,
    /// Its number, from 0.
    pub number: u64,
}

/// The first sample of those of [`monte_carlo`](super::monte_carlo), as it runs.
///
/// # Errors
/// Where a covariance is indefinite.
///
/// Example: [`monte_carlo`](crate::simulate::monte_carlo).
pub fn sample(task: &Task, phi: &[f64], plan: &Plan, noise: &Noise, seed: u64) -> Result<Sample, Error> {
    sample_number(task, phi, plan, noise, SampleId { seed, number: 0 })
}

/// This sample of those of [`monte_carlo`](super::monte_carlo), as it runs.
///
/// # Errors
/// Where a covariance is indefinite.
///
/// Example: [`monte_carlo`](crate::simulate::monte_carlo).
pub fn sample_number(task: &Task, phi: &[f64], plan: &Plan, noise: &Noise, which: SampleId) -> Result<Sample, Error> {
    sample_of(task, plan, None, World { phi, noise }, which)
}

/// A sample of a plan, with the extended filter or a controller's filter.
pub(super) fn sample_of(
    task: &Task,
    plan: &Plan,
    along: Option<&Controller>,
    world: World,
    SampleId { seed, number }: SampleId,
) -> Result<Sample, Error> {
    let phi = world.phi;
    let noise = world.fixed_noise(task)?;
    let factors = NoiseFactors::of(&noise)?;
    let believed = World { phi, noise: &noise };
    let truth = Truth::of(task, phi);
    let setting = LoopSetting { task, plan, believed, truth, factors: &factors, along, watch: None };
    let size = task.system.dimensions();
    let mut closed = ClosedLoop::new(size, 1);
    let mut record = Record::new(size, task.steps);
    let times = match closed.run(setting, seed, number, Some(&mut record)) {
        Ok(()) => task.steps + 1,
        Err(Error::Lqg(
            supple_lqg::Error::NotFinite { step, .. } | supple_lqg::Error::NotPositiveDefinite { step, .. },
        )) => step,
        Err(error) => return Err(error),
    };
    let rows = |matrices: &Matrices| {
        let mut rows = matrices.to_rows();
        rows.truncate(times);
        rows
    };
    Ok(Sample {
        seed,
        states: rows(&record.truth),
        estimates: rows(&record.run.states),
        deviations: rows(&record.deviations),
        controls: rows(&record.run.controls),
        measurements: rows(&record.measured),
        cost: if times > task.steps { closed.outcomes[0].cost } else { f64::INFINITY },
    })
}
