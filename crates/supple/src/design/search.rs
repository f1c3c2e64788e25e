//! One optimiser run: evaluates designs, counts them and notifies the observer.

use std::cmp::Ordering;

use super::optimality::optimality;
use super::visit::Visitor;
use super::visited::{ROUNDING, Visit};
use super::{Aim, Control, DesignSettings, Event};
use crate::Error;
use crate::problem::Problem;

/// One optimiser's run from one start on one branch.
pub(crate) struct Search<'a, 'b> {
    pub visitor: &'b mut Visitor<'a>,
    pub control: Control<'a>,
    /// The start's number, for the observer.
    pub start: usize,
    /// Evaluations made.
    pub evaluations: usize,
    /// Of these, how many have a plan that never makes a contact whose force a cost tracks.
    pub without_contact: usize,
    /// Why a design on the way could not be evaluated, if that ended the run.
    pub error: Option<Error>,
}

impl<'a> Search<'a, '_> {
    /// Makes the best visit the last one: the least objective of those that meet the bounds, or else the least violation of
    /// those whose plans converged.
    pub fn choose(&mut self) -> Option<Visit> {
        let (problem, aim) = (self.problem(), self.aim());
        let feasibility = self.settings().feasibility;
        let visits = &mut self.visitor.visits;
        let is_met = visits.iter().any(|visit| aim.is_met(visit, ROUNDING));
        let tolerance = if is_met { ROUNDING } else { feasibility };
        let merit = |index: &usize| aim.merit(&visits[*index], problem, tolerance);
        let best = (0..visits.len()).min_by(|a, b| merit(a).partial_cmp(&merit(b)).unwrap_or(Ordering::Equal))?;
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

    /// What visits are compared by, smaller is better.
    pub fn merit(&self, visit: &Visit) -> (bool, f64) {
        self.aim().merit(visit, self.problem(), self.settings().feasibility)
    }

    /// First-order optimality of a visit, and its multipliers.
    pub fn optimality(&self, at: &Visit) -> (f64, Vec<f64>) {
        optimality(at, self.visitor)
    }

    /// Visits scaled coordinates and notifies the observer.
    pub fn visit(&mut self, scaled: &[f64]) -> Result<Visit, Error> {
        let known = self.visitor.visits.len();
        let visit = self.visitor.visit(scaled)?.clone();
        if self.visitor.visits.len() > known {
            self.tell(&visit);
        }
        Ok(visit)
    }

    /// Notifies the observer of a step of the optimiser.
    pub fn step_to(&self, visit: &Visit, is_trial: bool) {
        self.control.observer.observe(Event::Stepped { start: self.start, design: &visit.phi, is_trial });
    }

    /// Counts an evaluated design and notifies the observer.
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
