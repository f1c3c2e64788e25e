//! Roll-outs of the design on screen, as threads beside its plan.

use std::sync::atomic::{AtomicBool, Ordering};

use supple::design::{Attempts, plan_at};
use supple::pipeline::TaskState;
use supple::simulate::{Sample, sample};
use supple::{Matrices, Problem};

/// Roll-outs that are sent together.
const BATCH: usize = 10;

/// Rolls out a task of a problem `count` times; sample `i` has seed `i`, and sample 0 is also the one in the curves.
/// `tell` receives every batch, with the times of its states, and returns whether anyone is still listening.
///
/// # Errors
/// Where the task cannot be planned, or a covariance is indefinite.
pub fn roll_out(
    problem: &Problem,
    phi: &[f64],
    task: usize,
    count: usize,
    controls: Option<&Matrices>,
    stop: &AtomicBool,
    tell: &dyn Fn(&[f64], &[Sample]) -> bool,
) -> Result<(), supple::Error> {
    let Some(task) = problem.tasks.get(task) else { return Ok(()) };
    let mut state = TaskState::new(task);
    plan_at(problem, task, phi, controls, Attempts::default(), &mut state)?;
    let step = task.time_step.resolve::<f64>(phi);
    let time: Vec<f64> = (0..=task.steps).map(|t| t as f64 * step).collect();
    let mut batch = Vec::new();
    for seed in 0..count {
        if stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        batch.push(sample(task, phi, &state.plan, &state.noise, seed as u64)?);
        if batch.len() == BATCH || seed + 1 == count {
            if !tell(&time, &batch) {
                return Ok(());
            }
            batch.clear();
        }
    }
    Ok(())
}
