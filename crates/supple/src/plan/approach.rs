//! Approaching contacts from a distance, and overcoming friction (theory, section "Finding contact").

use std::time::Instant;

use supple_kernels::{Matrices, Scratch};
use supple_model::system::System;
use supple_model::{ContactState, Trajectory};

use super::descent::is_over;
use super::kept::Kept;
use super::nominal::search_free;
use super::sweeps::roll_out;
use super::{Asked, NominalProblem, Patience, Plan, PlanSettings, PlanWorkspace};
use crate::problem::{Task, TaskAt};

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
/// Least number of steps of a coarse plan.
const LEAST_STEPS: usize = 250;
/// Tolerance of searches over longer steps, which cost less, as friction becomes narrower.
const COARSE_TOLERANCE: f64 = 1e-2;
/// Their tolerance once friction is as narrow as it becomes. The times when joints stop move by about one step in each
/// iteration, which is more the longer the steps are.
const LAST_COARSE_TOLERANCE: f64 = 1e-4;
/// The speed, one of [`SPEEDS`], by which friction over longer steps stays wider: if it sets in within a single step, the
/// time when a joint stops is caught between two steps.
const COARSE_SPEED: f64 = 0.01;

/// The controls that follow a plan whose contacts were first wider and softer than they are, and whose friction set in over
/// higher speeds, starting from the controls in `found.trajectory`. The width begins at twice the greatest clearance of the
/// first state and is then halved, but kept above 5/4 of the clearance that the plan still leaves, until it is below half
/// of the least smoothing. If no plan is found at a speed, it goes halfway back, in its logarithm. Over many steps,
/// the plans before the last one have fewer and longer steps where the system endures them. `None` if
/// there is nothing to approach, or no plan was found on the way. Also returns the total number of iterations.
pub(crate) fn approach(
    TaskAt { task, phi }: TaskAt,
    settings: &PlanSettings,
    found: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Option<(Matrices, usize)> {
    let mut approach = Approach { task, phi, system: task.system.widened()?, settings, iterations: 0 };
    let mut kept = approach.by_longer_steps(found, work, scratch);
    if kept.is_none() {
        kept = approach.narrow(found, work, scratch);
    }
    // Along a trajectory that is unstable, rounding alone makes the same controls lead elsewhere.
    kept.map(|kept| {
        kept.follow(task.nominal(phi), found, work, scratch);
        (found.trajectory.controls.clone(), approach.iterations)
    })
}

/// Weights by which a plan is drawn to contacts, one after the other, relative to that at which the distances of a plan that
/// misses them cost as much as the plan.
const PULLS: [f64; 4] = [10.0, 1.0, 0.1, 0.01];

/// The controls that follow a plan which was drawn to the contacts that costs want a force of (theory, section "Finding
/// contact"), starting from the controls in `found.trajectory` of one that misses one. `None` if there are no such contacts, or no
/// plan was found on the way. Also returns the total number of iterations.
pub(crate) fn draw_to_contacts(
    TaskAt { task, phi }: TaskAt,
    settings: &PlanSettings,
    found: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Option<(Matrices, usize)> {
    let (own, system) = (task.nominal(phi), task.system.drawn_to_contacts(phi)?);
    roll_out(own, found, scratch).ok()?;
    let states = &found.trajectory.states;
    let wanted = task.system.wanted_forces(phi);
    let squared = |t: usize| {
        let now = task.system.contact_states(states.vector(t), phi);
        wanted.iter().map(|wanted| now[wanted.contact].clearance.max(0.0).powi(2)).sum::<f64>()
    };
    let unit = found.nominal_cost.abs() / (0..states.count()).map(squared).sum::<f64>();
    let (mut kept, mut iterations): (Option<Kept>, usize) = (None, 0);
    for pull in PULLS {
        let phi: Vec<f64> = phi.iter().copied().chain([pull * unit]).collect();
        let problem = NominalProblem { system: &*system, phi: &phi, bounds: own.bounds };
        let mut patience = Patience::Full;
        if let Some(kept) = &kept {
            kept.follow(problem, found, work, scratch);
            patience = Patience::Close;
        }
        search_free(problem, Asked::of(settings, patience), found, work, scratch).ok()?;
        iterations += found.iterations;
        kept = Some(Kept::of(found));
    }
    kept.map(|kept| {
        kept.follow(own, found, work, scratch);
        (found.trajectory.controls.clone(), iterations)
    })
}

/// Numbers of steps of a task's coarse plans, the last one first.
fn coarse(steps: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(steps), |steps| Some(steps.div_ceil(2)))
        .skip(1)
        .take_while(|steps| *steps >= LEAST_STEPS)
}

/// A task with contacts and friction that can be wider, and time steps that can be longer.
struct Approach<'a> {
    task: &'a Task,
    phi: &'a [f64],
    system: &'a dyn System,
    settings: &'a PlanSettings,
    /// Of all plans so far.
    iterations: usize,
}

impl Approach<'_> {
    /// How many times longer steps are if there are this many.
    fn longer(&self, steps: usize) -> f64 {
        self.task.steps as f64 / steps as f64
    }

    fn parameters(&self, width: f64, speed: f64, steps: usize) -> Vec<f64> {
        self.phi.iter().copied().chain([width, speed, self.longer(steps)]).collect()
    }

    /// Settings of intermediate searches.
    fn loose(&self, tolerance: f64) -> PlanSettings {
        let bounded = self.task.control_bounds.is_some();
        let newton = self.settings.newton && !(self.system.has_costly_curvature() && bounded);
        PlanSettings { tolerance: self.settings.tolerance.max(tolerance), newton, ..self.settings.clone() }
    }

    /// Makes contacts and friction narrower plan by plan, over as many steps as `found` has, starting from its
    /// controls. Friction over fewer steps than those of the task stays wider.
    fn narrow(&mut self, found: &mut Plan, work: &mut PlanWorkspace, scratch: &mut Scratch) -> Option<Kept> {
        let steps = found.trajectory.steps();
        let states = |x: &[f64]| self.task.system.contact_states(x, self.phi);
        let mut widening = Widening::of(&states(found.trajectory.states.vector(0)));
        let is_coarse = steps < self.task.steps;
        let mut friction = Slowing::to(if is_coarse { COARSE_SPEED } else { 0.0 });
        let loose = self.loose(if is_coarse { COARSE_TOLERANCE } else { TOLERANCE });
        let mut kept: Option<Kept> = None;
        let mut apart = false;
        for _ in 0..STAGES {
            if is_over(work.deadline) {
                break;
            }
            let phi = self.parameters(widening.width.unwrap_or(0.0), friction.speed(), steps);
            let bounds = self.task.control_bounds.as_ref();
            let problem = NominalProblem { system: self.system, phi: &phi, bounds };
            let mut patience = Patience::Full;
            if let Some(kept) = &kept {
                patience = Patience::Continued;
                kept.follow(problem, found, work, scratch);
            }
            let settings = if apart { self.settings } else { &loose };
            let planned = search_free(problem, Asked::of(settings, patience), found, work, scratch).is_ok();
            self.iterations += found.iterations;
            if !(planned && found.status.is_converged()) && friction.go_back() {
                continue;
            }
            if !planned {
                break;
            }
            kept = Some(Kept::of(found));
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
        kept
    }

    /// A plan over all steps by way of plans over fewer and longer ones (theory, section "Long plans"). `None` if that is
    /// of no use, or fails.
    fn by_longer_steps(&mut self, found: &mut Plan, work: &mut PlanWorkspace, scratch: &mut Scratch) -> Option<Kept> {
        // Within control bounds plans over longer steps often lead to costlier ones.
        if self.task.control_bounds.is_some() || !self.system.endures_longer_steps() {
            return None;
        }
        let counts: Vec<usize> = coarse(self.task.steps).collect();
        let fewest = *counts.last()?;
        // Far from a plan, longer steps may lead elsewhere.
        let phi = self.parameters(0.0, SPEEDS[0], self.task.steps);
        let problem = NominalProblem { system: self.system, phi: &phi, bounds: None };
        search_free(problem, Asked::of(&self.loose(TOLERANCE), Patience::Full), found, work, scratch).ok()?;
        self.iterations += found.iterations;
        let (guess, deadline) = (&found.trajectory, work.deadline);
        let loose = self.loose(LAST_COARSE_TOLERANCE);
        let (mut plan, mut work) = self.empty(guess, fewest, deadline);
        for t in 0..fewest {
            let control = guess.controls.vector(t * guess.steps() / fewest);
            plan.trajectory.controls.vector_mut(t).copy_from_slice(control);
        }
        let mut kept = self.narrow(&mut plan, &mut work, scratch)?;
        for &steps in counts.iter().rev() {
            (plan, work) = self.empty(guess, steps, deadline);
            let phi = self.parameters(0.0, COARSE_SPEED, steps);
            let problem = NominalProblem { system: self.system, phi: &phi, bounds: None };
            kept.over(steps).follow(problem, &mut plan, &mut work, scratch);
            search_free(problem, Asked::of(&loose, Patience::Close), &mut plan, &mut work, scratch).ok()?;
            self.iterations += plan.iterations;
            kept = Kept::of(&plan);
        }
        Some(kept.over(guess.steps()))
    }

    /// A plan over some steps that starts where the guess does, and its workspace.
    fn empty(&self, guess: &Trajectory, steps: usize, deadline: Option<Instant>) -> (Plan, PlanWorkspace) {
        let size = self.system.dimensions();
        let mut plan = Plan::zeros(size, steps);
        plan.trajectory.states.vector_mut(0).copy_from_slice(guess.states.vector(0));
        (plan, PlanWorkspace { deadline, ..PlanWorkspace::new(size, steps) })
    }
}

/// The speeds by which the onset of friction is widened.
struct Slowing {
    /// Speeds to come, the next one last.
    ahead: Vec<f64>,
    /// The last speed at which a plan was found.
    reached: Option<f64>,
    refinements: usize,
}

impl Slowing {
    /// Down to this speed.
    fn to(least: f64) -> Self {
        let ahead = SPEEDS.iter().rev().copied().filter(|speed| *speed >= least).collect();
        Self { ahead, reached: None, refinements: 0 }
    }

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
