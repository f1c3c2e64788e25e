use std::sync::atomic::{AtomicBool, Ordering};

use super::optimality::{OPTIMAL, optimality};
use super::outer::{Ending, Optimiser, OuterProblem};
use super::visit::Visitor;
use super::visited::Visit;
use super::{Aim, DesignSettings};
use crate::Error;
use crate::problem::Problem;

/// What happens during a long computation.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A start began; there are `of` of them.
    StartBegan {
        /// Its number, from 0.
        start: usize,
        /// How many there are.
        of: usize,
    },
    /// A design was evaluated.
    Evaluated {
        /// The start's number.
        start: usize,
        /// All its parameters.
        design: &'a [f64],
        /// The information, nats.
        information: f64,
        /// Expected cost of each task.
        costs: &'a [f64],
        /// How far the worst task is above its bound, or the price above the budget, relative to it.
        violation: f64,
    },
    /// The optimiser stepped to a design that it evaluated; other designs are trials of its line searches.
    Stepped {
        /// The start's number.
        start: usize,
        /// All its parameters.
        design: &'a [f64],
        /// Whether a step that comes next may take its place: it is the first trial of a line search.
        is_trial: bool,
    },
    /// Other local minima of the plans are being searched for.
    SearchingBranches {
        /// The start's number.
        start: usize,
    },
    /// A combination of entries of catalogues was designed.
    Combination {
        /// How many are done.
        done: usize,
        /// How many there are to be done, as far as is known.
        of: usize,
    },
    /// A start ended.
    StartEnded {
        /// Its number.
        start: usize,
    },
}

/// Sees what happens during a long computation; called from several threads.
pub trait Observer: Send + Sync {
    /// Something happened.
    fn observe(&self, event: Event);
}

/// Ignores all progress.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoObserver;

impl Observer for NoObserver {
    fn observe(&self, _: Event) {}
}

/// How a long computation is watched and stopped.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Sees what happens.
    pub observer: &'a dyn Observer,
    /// Set to stop soon, keeping what was found.
    pub stop: &'a AtomicBool,
}

impl Control<'_> {
    /// Whether to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Violations up to this, relative to the bound, are rounding.
const ROUNDING: f64 = 1e-9;

/// One optimiser's run from one start on one branch.
pub(crate) struct Search<'a, 'b> {
    pub visitor: &'b mut Visitor<'a>,
    pub control: Control<'a>,
    /// The start's number, for the observer.
    pub start: usize,
    /// Evaluations made.
    pub evaluations: usize,
    /// Of these, how many have a plan that never touches a contact from which a cost wants a force.
    pub without_contact: usize,
    /// Why a design on the way could not be evaluated, where that ended the run.
    pub error: Option<Error>,
}

impl<'a> Search<'a, '_> {
    /// Runs an optimiser from the visitor's last design, and leaves the design that it found as the last one.
    pub fn run(&mut self, optimiser: &dyn Optimiser) -> Ending {
        let mut ending = Ending::Stalled;
        for _ in 0..optimiser.runs() {
            let Some(first) = self.visitor.visits.last().cloned() else { break };
            let mut problem = OuterProblem::new(self, optimiser.units(), first.clone());
            ending = optimiser.minimise(&mut problem);
            self.error = problem.into_error();
            if optimiser.keeps_last() {
                break;
            }
            let Some(best) = self.choose() else { break };
            if ending == Ending::Stopped
                || self.error.is_some()
                || self.optimality(&best).0 <= OPTIMAL
                || best.scaled == first.scaled
            {
                break;
            }
        }
        ending
    }

    /// Makes the best visit the last one: the least objective of those that meet the bounds, or else the least violation of
    /// those whose plans converged.
    fn choose(&mut self) -> Option<Visit> {
        let (problem, aim) = (self.problem(), self.aim());
        let feasibility = self.settings().feasibility;
        let visits = &mut self.visitor.visits;
        let met = |tolerance: f64| visits.iter().any(|visit| aim.is_met(visit, tolerance));
        let tolerance = [ROUNDING, feasibility].into_iter().find(|&tolerance| met(tolerance));
        let merit = |visit: &Visit| match tolerance {
            Some(tolerance) if aim.is_met(visit, tolerance) => aim.objective(visit, problem),
            None if visit.is_planned() => visit.excess(),
            _ => f64::INFINITY,
        };
        let best = (0..visits.len()).min_by(|&a, &b| merit(&visits[a]).total_cmp(&merit(&visits[b])))?;
        let best = visits.remove(best);
        visits.push(best.clone());
        Some(best)
    }

    pub fn problem(&self) -> &'a Problem {
        self.visitor.problem
    }

    pub fn settings(&self) -> &'a DesignSettings {
        self.visitor.settings
    }

    pub fn aim(&self) -> Aim {
        self.visitor.aim
    }

    /// First-order optimality of a visit, and its multipliers.
    pub fn optimality(&self, at: &Visit) -> (f64, Vec<f64>) {
        optimality(at, self.visitor)
    }

    /// Visits scaled coordinates and tells the observer.
    pub fn visit(&mut self, scaled: &[f64]) -> Result<Visit, Error> {
        let known = self.visitor.visits.len();
        let visit = self.visitor.visit(scaled)?.clone();
        if self.visitor.visits.len() > known {
            self.tell(&visit);
        }
        Ok(visit)
    }

    /// Tells the observer of a step of the optimiser.
    pub fn step_to(&self, visit: &Visit, is_trial: bool) {
        self.control.observer.observe(Event::Stepped { start: self.start, design: &visit.phi, is_trial });
    }

    /// Counts an evaluated design and tells the observer.
    pub fn tell(&mut self, visit: &Visit) {
        self.evaluations += 1;
        self.without_contact += usize::from(visit.misses_contact());
        let costs: Vec<f64> = visit.tasks.iter().map(|task| task.cost).collect();
        self.control.observer.observe(Event::Evaluated {
            start: self.start,
            design: &visit.phi,
            information: visit.information(self.visitor.problem),
            costs: &costs,
            violation: visit.excess(),
        });
    }
}
