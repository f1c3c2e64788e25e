use std::cmp::{Ordering, Reverse};
use std::time::Instant;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;
use supple_kernels::Matrices;

use super::barrier::Barrier;
use super::cobyla::Cobyla;
use super::outer::Optimiser;
use super::rounds::Rounds;
use super::sqp::Sqp;
use super::visit::Visitor;
use super::{Aim, Control, Design, DesignSettings, DesignStatus, Ending, Event, GradientKind, Method, StartSummary};
use crate::Error;
use crate::branches::uniform;
use crate::continuation::Scaling;
use crate::problem::Problem;

/// Searches for the design with the least information that meets every bound, from `phi` and from seeded random
/// starts, in parallel; then chooses from the catalogues that parameters have, see [`Searcher::choose`]. The result does not
/// depend on the number of threads.
///
/// # Errors
/// Where `phi` has the wrong length, not even the first start can be evaluated, or total gradients are asked for along
/// plans that have none.
pub fn design(problem: &Problem, phi: &[f64], settings: &DesignSettings, control: Control) -> Result<Design, Error> {
    problem.check_design(phi)?;
    let searcher = Searcher::new(problem, settings, Aim::default(), control);
    searcher.choose(searcher.search(phi)?)
}

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

    /// Searches from `phi` and from seeded random starts, in parallel; the result does not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// Where not even the first start can be evaluated, or total gradients are asked for along plans that have none.
    pub fn search(&self, phi: &[f64]) -> Result<Design, Error> {
        let Self { settings, control, .. } = *self;
        self.check()?;
        let clock = Instant::now();
        let run = |start: usize| {
            // The first start is always made: it is what there is to show.
            (start == 0 || !control.is_stopped()).then(|| self.run_start(phi, start))
        };
        let starts: Vec<StartSummary> = (0..settings.starts).into_par_iter().filter_map(run).collect();
        self.combine(starts, clock.elapsed().as_secs_f64())
    }

    /// Searches from one of the starts that [`search`](Self::search) makes from `phi`, and from no other.
    ///
    /// # Errors
    /// Where `phi` has the wrong length, or total gradients are asked for along plans that have none.
    pub fn search_start(&self, phi: &[f64], start: usize) -> Result<StartSummary, Error> {
        self.problem.check_design(phi)?;
        self.check()?;
        Ok(self.run_start(phi, start))
    }

    /// The best of starts, in their order, wherever they were searched from in `seconds`, once the plans at the end of each
    /// were tried where the others ended. Starts that were stopped before they evaluated a design are left out.
    ///
    /// # Errors
    /// Where none of them could be evaluated.
    pub fn combine(&self, mut starts: Vec<StartSummary>, seconds: f64) -> Result<Design, Error> {
        let clock = Instant::now();
        let stopped_early =
            |start: &StartSummary| start.controls.is_empty() && matches!(start.error, Some(Error::Stopped));
        let made = starts.len();
        starts.retain(|start| !stopped_early(start));
        if starts.is_empty() && made > 0 {
            return Err(Error::Stopped);
        }
        self.exchange_plans(&mut starts);
        let seconds = seconds + clock.elapsed().as_secs_f64();
        let rank = |summary: &StartSummary| self.rank(summary);
        let best = (0..starts.len())
            .min_by(|&a, &b| rank(&starts[a]).partial_cmp(&rank(&starts[b])).unwrap_or(Ordering::Equal))
            .unwrap_or(0);
        let failed = starts.get(best).filter(|summary| summary.controls.is_empty());
        if let Some(error) = failed.and_then(|summary| summary.error.clone()) {
            return Err(error);
        }
        let stopped = self.control.is_stopped();
        let Some(best_status) = starts.get(best).map(|summary| summary.status) else {
            return Err(Error::Shape {
                what: "the list of starts".to_owned(),
                found: 0,
                expected: self.settings.starts,
            });
        };
        Ok(Design {
            status: if stopped { DesignStatus::Stopped } else { best_status },
            best,
            evaluations: starts.iter().map(|summary| summary.evaluations).sum(),
            without_contact: starts.iter().map(|summary| summary.without_contact).sum(),
            starts,
            catalogue: None,
            seconds,
        })
    }

    /// Searches from one design whose plans are known, with the branch searches of the given start's number.
    ///
    /// # Errors
    /// Where that design cannot be evaluated, or total gradients are asked for along plans that have none.
    pub fn search_from(&self, phi: &[f64], controls: &[Matrices], start: usize) -> Result<StartSummary, Error> {
        self.check()?;
        let summary = self.run(phi.to_vec(), Some(controls.to_vec()), start);
        match &summary.error {
            Some(error) if summary.controls.is_empty() => Err(error.clone()),
            _ => Ok(summary),
        }
    }

    /// Says of a design whose plans are known whether it is an optimum, without a search.
    ///
    /// # Errors
    /// Where it cannot be evaluated.
    pub fn assess(&self, phi: &[f64], controls: &[Matrices]) -> Result<StartSummary, Error> {
        let mut visitor = Visitor::new(self.problem, self.settings, self.aim);
        let mut summary = StartSummary::new(phi.to_vec());
        let visit = visitor.restart(phi, controls)?.clone();
        let visit = visitor.with_total_gradient(&visit)?;
        summary.evaluations = 1;
        summary.without_contact = usize::from(visit.misses_contact());
        summary.branches = visit.tasks.len();
        summary.record(&visit, &visitor, Ending::Converged);
        Ok(summary)
    }

    /// How good an end of a search is: first whether it is of no use, then how few kinds of information it has left behind, of
    /// which it needs none, then what is minimised. The lesser is the better.
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

    fn check(&self) -> Result<(), Error> {
        let mode = self.problem.planning.plan;
        match self.settings.gradient == GradientKind::Total && !mode.has_total_gradient() {
            true => Err(Error::NoTotalGradient { plan: mode.name() }),
            false => Ok(()),
        }
    }

    fn run_start(&self, phi: &[f64], start: usize) -> StartSummary {
        let Self { problem, settings, control, .. } = *self;
        let scaling = Scaling::of(&problem.parameters);
        let from = if start == 0 { phi.to_vec() } else { random_start(&scaling, phi, settings.seed, start) };
        control.observer.observe(Event::StartBegan { start, of: settings.starts });
        let summary = self.run(from, None, start);
        control.observer.observe(Event::StartEnded { start });
        summary
    }

    fn run(&self, from: Vec<f64>, controls: Option<Vec<Matrices>>, start: usize) -> StartSummary {
        let mut summary = StartSummary::new(from);
        let mut rounds = Rounds { searcher: *self, start, summary: &mut summary };
        match rounds.run(controls) {
            Ok(()) => {}
            Err(Error::Stopped) if !summary.controls.is_empty() => summary.stop(),
            Err(error) => {
                if matches!(error, Error::Stopped) {
                    summary.status = DesignStatus::Stopped;
                }
                summary.error = Some(error);
            }
        }
        summary
    }
}

/// A random point of the box, in scaled coordinates; the stream belongs to the start.
fn random_start(scaling: &Scaling, phi: &[f64], seed: u64, start: usize) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream((1 << 32) + start as u64);
    let scaled: Vec<f64> = scaling.indices.iter().map(|_| uniform(&mut random)).collect();
    scaling.unscaled(phi, &scaled)
}
