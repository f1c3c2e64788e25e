//! A search for designs: a problem, settings, an aim and an optimiser.

use std::cmp::Reverse;

use super::barrier::Barrier;
use super::cobyla::Cobyla;
use super::sqp::Sqp;
use super::{Aim, Control, DesignSettings, DesignStatus, GradientKind, Method, Optimiser, StartSummary};
use crate::Error;
use crate::problem::Problem;

/// Searches for designs of one problem with one aim.
///
/// Example: [`Optimiser`].
#[derive(Clone, Copy)]
pub struct Searcher<'a> {
    /// The problem whose parameters are designed.
    pub problem: &'a Problem,
    /// Search settings. The barrier method supports no aim other than the least information.
    pub settings: &'a DesignSettings,
    /// The aim of the search.
    pub aim: Aim,
    /// How the search is observed and stopped.
    pub control: Control<'a>,
    /// Whether a search continues with the next kind of information once the minimised kind reaches zero.
    pub(super) goes_on: bool,
    /// The optimiser, if not the one in the settings.
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

    /// The same, but keeps to the kind of information in the settings even when it reaches zero, so that results
    /// are comparable.
    #[must_use]
    pub fn with_one_information(self) -> Self {
        Self { goes_on: false, ..self }
    }

    /// The same with another optimiser.
    #[must_use]
    pub fn with_optimiser(self, optimiser: &'a dyn Optimiser) -> Self {
        Self { optimiser: Some(optimiser), ..self }
    }

    /// Ranks the result of a search, smaller is better: first whether it is unusable, then how many kinds of information
    /// it has reduced to zero (more is better), then what is minimised.
    #[must_use]
    pub fn rank(&self, summary: &StartSummary) -> (bool, Reverse<usize>, f64) {
        let met = summary.status != DesignStatus::BoundViolated;
        let excess = summary.violation.max(summary.overspent);
        let value = match (met, self.aim) {
            (true, Aim::Information { .. }) => summary.objective,
            (true, Aim::Cost | Aim::UnmeasuredCost) => summary.violation,
            // Infinite: its costs may be low, but its plans did not converge.
            (false, _) if excess <= self.settings.feasibility => f64::INFINITY,
            (false, _) => excess,
        };
        (!met, Reverse(summary.passed), value)
    }

    /// Whether the result of a search is the last design of its optimiser, rather than the best one.
    pub(super) fn keeps_last(&self) -> bool {
        self.optimiser.map_or_else(|| own_optimiser(self.settings).keeps_last(), Optimiser::keeps_last)
    }

    /// Checks the settings, and that the plans have the requested gradients.
    pub(super) fn check(&self) -> Result<(), Error> {
        self.settings.check().map_err(|unfit| Error::Unfit(unfit.below("design")))?;
        let mode = self.problem.planning.plan;
        match self.settings.gradient == GradientKind::Total && !mode.has_total_gradient() {
            true => Err(Error::NoTotalGradient { plan: mode.name() }),
            false => Ok(()),
        }
    }
}
