//! Contact found from afar (theory, section "Finding contact").

use supple_kernels::{Matrices, Scratch};

use super::{NominalProblem, Plan, PlanSettings, PlanWorkspace, plan};
use crate::contacts::ContactState;
use crate::problem::Task;
use crate::trajectory::Trajectory;

/// Widths that are tried at most; each is at most 0.9 times the one before.
const STAGES: usize = 40;
/// How many times the greatest clearance of the first state contacts are wide at first.
const FIRST_WIDTH: f64 = 2.0;
/// By how much contacts stay wider than the clearance that is left, so that they are still felt.
const REACH: f64 = 1.25;
/// Searches on the way end early.
const TOLERANCE: f64 = 1e-5;
const ITERATIONS: usize = 60;

/// The controls of a plan whose contacts were first wider and softer than they are, starting from those in
/// `plan.trajectory`: the width begins at twice the greatest clearance of the first state and is then halved, but kept
/// above 5/4 of the clearance that the plan still leaves, until it is below half of the least smoothing. None where
/// nothing is far enough to be approached, or no plan was found on the way.
pub(crate) fn approach(
    (task, phi): (&Task, &[f64]),
    settings: &PlanSettings,
    found: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Option<Matrices> {
    let wide = task.system.widened()?;
    let states = |x: &[f64]| task.system.contact_states(x, phi);
    let first = states(found.trajectory.states.vector(0));
    let smoothing = first.iter().map(|contact| contact.smoothing).fold(f64::INFINITY, f64::min);
    let far = |contact: &ContactState| contact.clearance.max(0.0);
    let clearance = first.iter().map(far).fold(0.0, f64::max);
    if clearance <= smoothing || !clearance.is_finite() {
        return None;
    }
    let loose = PlanSettings {
        tolerance: settings.tolerance.max(TOLERANCE),
        max_iterations: settings.max_iterations.min(ITERATIONS),
        ..settings.clone()
    };
    let mut width = FIRST_WIDTH * clearance;
    let mut controls = None;
    for _ in 0..STAGES {
        let phi: Vec<f64> = phi.iter().copied().chain([width]).collect();
        let problem = NominalProblem { system: wide, phi: &phi, bounds: task.control_bounds.as_ref() };
        if plan(problem, &loose, found, work, scratch).is_err() {
            return controls;
        }
        controls = Some(found.trajectory.controls.clone());
        if width <= 0.5 * smoothing {
            break;
        }
        let left = REACH * clearance_left(&found.trajectory, states);
        width = left.clamp(0.5 * width, 0.9 * width);
    }
    controls
}

/// The greatest clearance that any contact keeps all along a trajectory, m; 0 where all of them touch.
fn clearance_left(trajectory: &Trajectory, states: impl Fn(&[f64]) -> Vec<ContactState>) -> f64 {
    let mut least: Vec<f64> = Vec::new();
    for t in 0..=trajectory.steps() {
        let now = states(trajectory.states.vector(t));
        least.resize(now.len(), f64::INFINITY);
        least.iter_mut().zip(&now).for_each(|(least, contact)| *least = least.min(contact.clearance));
    }
    least.into_iter().fold(0.0, f64::max)
}
