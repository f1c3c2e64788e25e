//! Roll-outs on a plant with finer steps, which show the effect of the task's time step.

use super::closed_loop::{BATCH, Rollouts, in_batches};
use super::factors::NoiseFactors;
use super::outcome::Outcome;
use super::setting::LoopSetting;
use super::statistics::{FinerSteps, MonteCarlo};
use super::truth::{Motion, PARTS, Truth, World};
use super::watch::Watch;
use crate::Error;
use crate::plan::Plan;
use crate::problem::Task;

/// Number of states up to which as many roll-outs are repeated as share a batch.
const REPEATED_STATES: f64 = 48.0;
/// Minimum number of repeated roll-outs: as they differ from the first ones by the steps alone, few tell enough.
const LEAST_REPEATED: usize = 8;

/// How many roll-outs are repeated, at most: the time for a filter step grows with the cube of the number of states.
fn most_repeated(states: usize) -> usize {
    let share = (REPEATED_STATES / states.max(1) as f64).powi(3).min(1.0);
    ((BATCH as f64 * share) as usize).max(LEAST_REPEATED)
}

/// Repeats the first of the roll-outs on a plant with finer steps. `None` for models whose integration steps cannot be
/// refined, and if one of these roll-outs diverged.
///
/// # Errors
/// Where a covariance is indefinite.
pub(crate) fn on_finer_steps(
    task: &Task,
    plan: &Plan,
    world: World,
    seed: u64,
    sampled: &MonteCarlo,
) -> Result<Option<FinerSteps>, Error> {
    let most = most_repeated(task.system.dimensions().states);
    let [own, own_bits] = [&sampled.costs, &sampled.bits].map(|all| &all[..all.len().min(most)]);
    let World { phi, .. } = world;
    if task.system.substeps().is_none() || own.iter().any(|cost| !cost.is_finite()) {
        return Ok(None);
    }
    let noise = &*world.fixed_noise(task)?;
    let factors = &NoiseFactors::of(noise)?;
    let truth = Truth { motion: Motion::InParts(PARTS), ..Truth::of(task, phi) };
    let watch = &Watch::of(task.at(phi), &plan.trajectory);
    let believed = World { phi, noise };
    let setting = LoopSetting { task, plan, believed, truth, factors, along: None, watch: Some(watch) };
    // In small batches, so that every thread has some.
    let batch = own.len().div_ceil(rayon::current_num_threads()).max(1);
    let rollouts = Rollouts { count: own.len(), seed };
    let outcomes: Vec<Outcome> = in_batches(setting, rollouts, batch, |closed| closed.outcomes)?.concat();
    Ok(Some(FinerSteps::of(setting, PARTS, &outcomes, own, own_bits)))
}
