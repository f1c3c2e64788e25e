//! Approaching contacts from a distance, and overcoming friction (theory, section "Finding contact").

use supple_kernels::{Matrices, Scratch};
use supple_lqg::Policy;
use supple_model::system::System;
use supple_model::{ContactState, Trajectory};

use super::descent::is_over;
use super::nominal::search_free;
use super::{NominalProblem, Patience, Plan, PlanSettings, PlanWorkspace, rollout_within};
use crate::problem::Task;

/// Maximum number of intermediate plans.
const STAGES: usize = 40;
/// Initial width of contacts, as a multiple of the greatest clearance in the first state.
const FIRST_WIDTH: f64 = 2.0;
/// Factor by which contacts stay wider than the remaining clearance, so that they still exert a force.
const REACH: f64 = 1.25;
/// Speeds by which the onset of friction is widened, rad/s or m/s, one after the other.
const SPEEDS: [f64; 5] = [1.0, 0.1, 0.03, 0.01, 0.0];
/// After a speed below this one, the next speed is 0.
const LEAST_SPEED: f64 = 1e-3;
/// Maximum number of intermediate speeds, inserted where a step was too long.
const REFINEMENTS: usize = 5;
/// Tolerance of intermediate searches, which end early unless contacts are still to be made.
const TOLERANCE: f64 = 5e-2;

/// The controls that follow a plan whose contacts were first wider and softer than they are, and whose friction set in over
/// higher speeds, starting from the controls in `found.trajectory`. The width begins at twice the greatest clearance of the
/// first state and is then halved, but kept above 5/4 of the clearance that the plan still leaves, until it is below half
/// of the least smoothing. If no plan is found at a speed, it goes halfway back, in its logarithm. `None` if
/// there is nothing to approach, or no plan was found on the way. Also returns the total number of iterations.
pub(crate) fn approach(
    (task, phi): (&Task, &[f64]),
    settings: &PlanSettings,
    found: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Option<(Matrices, usize)> {
    let wide = task.system.widened()?;
    let states = |x: &[f64]| task.system.contact_states(x, phi);
    let mut widening = Widening::of(&states(found.trajectory.states.vector(0)));
    let mut friction = Slowing::default();
    let newton = settings.newton && !(wide.has_costly_curvature() && task.control_bounds.is_some());
    let loose = PlanSettings { tolerance: settings.tolerance.max(TOLERANCE), newton, ..settings.clone() };
    let mut kept: Option<Kept> = None;
    let mut apart = false;
    let mut iterations = 0;
    for _ in 0..STAGES {
        if is_over(work.deadline) {
            break;
        }
        let phi: Vec<f64> = phi.iter().copied().chain([widening.width.unwrap_or(0.0), friction.speed(), 1.0]).collect();
        let problem = NominalProblem { system: wide, phi: &phi, bounds: task.control_bounds.as_ref() };
        let mut patience = Patience::Full;
        if let Some(kept) = &kept {
            patience = Patience::Continued;
            follow(problem, kept, found, work, scratch);
        }
        let settings = if apart { settings } else { &loose };
        let planned = search_free(problem, (settings, patience), found, work, scratch).is_ok();
        iterations += found.iterations;
        if !(planned && found.status.is_converged()) && friction.go_back() {
            continue;
        }
        if !planned {
            break;
        }
        kept = Some(Kept { trajectory: found.trajectory.clone(), policy: found.policy.clone() });
        let left = clearance_left(&found.trajectory, states);
        if left > 0.0 && !apart {
            // A contact with little force attracts a search only if the search does not end early.
            apart = true;
            continue;
        }
        apart = left > 0.0;
        let narrow = widening.narrow(left);
        if friction.slow_down(narrow) && narrow {
            break;
        }
    }
    // Along a trajectory that is unstable, rounding alone makes the same controls lead elsewhere.
    let problem = NominalProblem { system: &*task.system, phi, bounds: task.control_bounds.as_ref() };
    kept.map(|kept| {
        follow(problem, &kept, found, work, scratch);
        (found.trajectory.controls.clone(), iterations)
    })
}

/// The parts of a plan that are needed to follow it.
struct Kept {
    trajectory: Trajectory,
    policy: Policy,
}

/// Controls for a problem that differs little from that of another plan: those that track its trajectory with its feedback,
/// or the plan's own controls if that fails.
fn follow(problem: NominalProblem, kept: &Kept, found: &mut Plan, work: &mut PlanWorkspace, scratch: &mut Scratch) {
    let around = (problem.system, problem.phi, problem.bounds);
    let law = (&kept.policy, 0.0);
    let cost = rollout_within(around, &kept.trajectory, law, &mut work.candidate, scratch);
    let controls = if cost.is_finite() { &work.candidate.controls } else { &kept.trajectory.controls };
    found.trajectory.controls.copy_from(controls);
}

/// The speeds by which the onset of friction is widened.
struct Slowing {
    /// Speeds to come, the next one last.
    ahead: Vec<f64>,
    /// The last speed at which a plan was found.
    reached: Option<f64>,
    refinements: usize,
}

impl Default for Slowing {
    fn default() -> Self {
        Self { ahead: SPEEDS.iter().rev().copied().collect(), reached: None, refinements: 0 }
    }
}

impl Slowing {
    fn speed(&self) -> f64 {
        self.ahead.last().copied().unwrap_or(0.0)
    }

    /// Moves to the next speed, but to the last one only if contacts are `narrow`; returns whether this one was the last.
    fn slow_down(&mut self, narrow: bool) -> bool {
        self.reached = Some(self.speed());
        match self.ahead.len() {
            0 | 1 => return true,
            2 if !narrow => {}
            _ => drop(self.ahead.pop()),
        }
        false
    }

    /// Goes part of the way back to the last speed that worked; returns false if that would not help.
    fn go_back(&mut self) -> bool {
        let speed = self.speed().max(LEAST_SPEED);
        match self.reached {
            Some(reached) if reached > 1.2 * speed && self.refinements < REFINEMENTS => {
                self.refinements += 1;
                self.ahead.push((reached * speed).sqrt());
                true
            }
            _ => false,
        }
    }
}

/// Whether contacts of a system have to be approached at `phi` from the first state `x`.
pub(crate) fn has_to_approach(system: &dyn System, x: &[f64], phi: &[f64]) -> bool {
    Widening::of(&system.contact_states(x, phi)).width.is_some()
}

/// How wide contacts are.
struct Widening {
    /// `None` if they have their true width.
    width: Option<f64>,
    /// Widths up to this are narrow enough.
    least: f64,
}

impl Widening {
    fn of(first: &[ContactState]) -> Self {
        let smoothing = first.iter().map(|contact| contact.smoothing).fold(f64::INFINITY, f64::min);
        let clearance = first.iter().map(|contact| contact.clearance.max(0.0)).fold(0.0, f64::max);
        let far = clearance > smoothing && clearance.is_finite();
        Self { width: far.then_some(FIRST_WIDTH * clearance), least: 0.5 * smoothing }
    }

    /// Makes contacts narrower, given the clearance left; returns whether they were narrow enough already.
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
