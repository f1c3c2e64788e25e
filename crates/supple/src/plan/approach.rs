//! Contacts found from afar, and friction overcome (theory, section "Finding contact").

use supple_kernels::{Matrices, Scratch};

use super::{NominalProblem, Plan, PlanSettings, PlanWorkspace, plan};
use crate::contacts::ContactState;
use crate::problem::Task;
use crate::system::System;
use crate::trajectory::Trajectory;

/// Plans on the way at most.
const STAGES: usize = 40;
/// How many times the greatest clearance of the first state contacts are wide at first.
const FIRST_WIDTH: f64 = 2.0;
/// By how much contacts stay wider than the clearance that is left, so that they are still felt.
const REACH: f64 = 1.25;
/// Speeds by which friction sets in later, rad/s or m/s, one after the other; the last of them stays while contacts narrow.
const SPEEDS: [f64; 7] = [1.0, 0.3, 0.1, 0.06, 0.035, 0.02, 0.01];
/// Searches on the way end early.
const TOLERANCE: f64 = 1e-3;
const ITERATIONS: usize = 30;

/// The controls of a plan whose contacts were first wider and softer than they are, and whose friction set in over higher
/// speeds, starting from the controls in `found.trajectory`. The width begins at twice the greatest clearance of the first
/// state and is then halved, but kept above 5/4 of the clearance that the plan still leaves, until it is below half of the
/// least smoothing. None where there is nothing to approach, or no plan was found on the way.
pub(crate) fn approach(
    (task, phi): (&Task, &[f64]),
    settings: &PlanSettings,
    found: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Option<Matrices> {
    let wide = task.system.widened()?;
    let states = |x: &[f64]| task.system.contact_states(x, phi);
    let mut widening = Widening::of(&states(found.trajectory.states.vector(0)));
    let loose = PlanSettings {
        tolerance: settings.tolerance.max(TOLERANCE),
        max_iterations: settings.max_iterations.min(ITERATIONS),
        ..settings.clone()
    };
    let mut controls = None;
    for stage in 0..STAGES {
        let (length, speed) = (widening.width.unwrap_or(0.0), SPEEDS[stage.min(SPEEDS.len() - 1)]);
        let phi: Vec<f64> = phi.iter().copied().chain([length, speed]).collect();
        let problem = NominalProblem { system: wide, phi: &phi, bounds: task.control_bounds.as_ref() };
        if plan(problem, &loose, found, work, scratch).is_err() {
            return controls;
        }
        controls = Some(found.trajectory.controls.clone());
        let narrow = widening.narrow(clearance_left(&found.trajectory, states));
        if narrow && stage + 1 >= SPEEDS.len() {
            break;
        }
    }
    controls
}

/// Whether contacts of a system have to be approached at `phi` from the first state `x`.
pub(crate) fn has_to_approach(system: &dyn System, x: &[f64], phi: &[f64]) -> bool {
    Widening::of(&system.contact_states(x, phi)).width.is_some()
}

/// How wide contacts are.
struct Widening {
    /// None where they are as wide as they are.
    width: Option<f64>,
    /// Below this width they are.
    least: f64,
}

impl Widening {
    fn of(first: &[ContactState]) -> Self {
        let smoothing = first.iter().map(|contact| contact.smoothing).fold(f64::INFINITY, f64::min);
        let clearance = first.iter().map(|contact| contact.clearance.max(0.0)).fold(0.0, f64::max);
        let far = clearance > smoothing && clearance.is_finite();
        Self { width: far.then_some(FIRST_WIDTH * clearance), least: 0.5 * smoothing }
    }

    /// Makes them narrower, where a clearance is left; whether they were as narrow as they need to be already.
    fn narrow(&mut self, left: f64) -> bool {
        match &mut self.width {
            Some(width) if *width > self.least => {
                *width = (REACH * left).clamp(0.5 * *width, 0.9 * *width);
                false
            }
            _ => true,
        }
    }
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
