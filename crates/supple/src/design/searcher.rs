//! What a search for designs is: a problem, settings, an aim and an optimiser.

use std::cmp::Reverse;

use super::barrier::Barrier;
use super::cobyla::Cobyla;
use super::sqp::Sqp;
use super::{Aim, Control, DesignSettings, DesignStatus, GradientKind, Method, Optimiser, StartSummary};
use crate::Error;
use crate::problem::Problem;

/// Searches for designs of one problem with one aim.
#[derive(Clone, Copy)]
pub struct Searcher<'a> {
    /// What there is to design.
    pub problem: &'a Problem,
    /// How it is searched for. The barrier knows no other aim than the least information.
    pub settings: &'a DesignSettings,
    /// What is searched for.
    pub aim: Aim,
    /// How the search is watched and stopped.
    pub control: Control<'a>,
    /// Whether a search goes on to the next kind of information where nothing is left of what it minimised.
    pub(super) goes_on: bool,
    /// The optimiser, where it is not that of the settings.
    pub(super) optimiser: Option<&'a dyn Optimiser>,
}

/// The optimiser of the settings.
pub(super) fn own_optimiser(settings: &DesignSettings) -> Box<dyn Optimiser> {
    match settings.method {
        Method::Sqp => Box::new(Sqp),
        Method::Cobyla => Box::new(Cobyla),
        Method::Barrier => Box::new(Barrier { weight: settings.barrier_weight, margin: settings.barrier_margin }),
    }
}

impl<'a> Searcher<'a> {
    /// A search with the optimiser of the settings.
    #[must_use]
    pub fn new(problem: &'a Problem, settings: &'a DesignSettings, aim: Aim, control: Control<'a>) -> Self {
        Self { problem, settings, aim, control, goes_on: true, optimiser: None }
    }

    /// The same for the one kind of information of the settings, also where nothing is left of it: so that results
    /// compare.
    #[must_use]
    pub fn with_one_information(self) -> Self {
        Self { goes_on: false, ..self }
    }

    /// The same with another optimiser.
    #[must_use]
    pub fn with_optimiser(self, optimiser: &'a dyn Optimiser) -> Self {
        Self { optimiser: Some(optimiser), ..self }
    }

    /// How good an end of a search is: first whether it is of no use, then how few kinds of information it has left behind,
    /// of which it needs none, then what is minimised. The lesser is the better.
    #[must_use]
    pub fn rank(&self, summary: &StartSummary) -> (bool, Reverse<usize>, f64) {
        let met = summary.status != DesignStatus::BoundViolated;
        let excess = summary.violation.max(summary.overspent);
        let value = match (met, self.aim) {
            (true, Aim::Information { .. }) => summary.objective,
            (true, Aim::Cost) => summary.violation,
            // Of no use although its costs are low: they are those of plans that did not converge.
            (false, _) if excess <= self.settings.feasibility => f64::INFINITY,
            (false, _) => excess,
        };
        (!met, Reverse(summary.passed), value)
    }

    /// Whether the plans have the gradients that are asked for.
    pub(super) fn check(&self) -> Result<(), Error> {
        let mode = self.problem.planning.plan;
        match self.settings.gradient == GradientKind::Total && !mode.has_total_gradient() {
            true => Err(Error::NoTotalGradient { plan: mode.name() }),
            false => Ok(()),
        }
    }
}
