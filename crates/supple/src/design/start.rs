//! Searches from one start and from many, and the best of them.

use std::cmp::Ordering;
use std::time::Instant;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;
use supple_kernels::Matrices;

use super::rounds::Rounds;
use super::visit::Visitor;
use super::{Aim, Design, DesignStatus, Ending, Event, Searcher, StartSummary};
use crate::Error;
use crate::candidates::uniform;
use crate::continuation::{Neighbour, Scaling};

impl Searcher<'_> {
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
            // The first start is always run, so that there is a result.
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

    /// The best of given starts, in order, wherever they were run in `seconds`, after the final plans of each were tried
    /// at the final designs of the others. Starts that were stopped before they evaluated a design are left out.
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
        let rank = |summary: &StartSummary| self.rank(summary);
        let best = (0..starts.len())
            .min_by(|&a, &b| rank(&starts[a]).partial_cmp(&rank(&starts[b])).unwrap_or(Ordering::Equal))
            .unwrap_or(0);
        if let Some(nearer) = starts.get(best).and_then(|missed| self.nearer_to_limits(missed, best)) {
            starts[best] = nearer;
        }
        let seconds = seconds + clock.elapsed().as_secs_f64();
        // Of starts that ended alike, one that is known to be an optimum.
        let alike = |start: &StartSummary| {
            let ((missed, passed, value), (best_missed, best_passed, least)) = (rank(start), rank(&starts[best]));
            (missed, passed) == (best_missed, best_passed) && value - least <= ALIKE * least.abs().max(1e-3)
        };
        let is_known = |index: &usize| {
            starts.get(*index).is_some_and(|start| start.status == DesignStatus::Converged && alike(start))
        };
        let best = std::iter::once(best).chain(0..starts.len()).find(is_known).unwrap_or(best);
        let failed = starts.get(best).filter(|summary| summary.controls.is_empty());
        if let Some(error) = failed.and_then(|summary| summary.error.clone()) {
            return Err(error);
        }
        let stopped = self.control.is_stopped();
        let Some(best_status) = starts.get(best).map(|summary| summary.status) else {
            return Err(Error::shape("the list of starts".to_owned(), 0, self.settings.starts));
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
        let summary = self.run(phi.to_vec(), Some(controls), start);
        match &summary.error {
            Some(error) if summary.controls.is_empty() => Err(error.clone()),
            _ => Ok(summary),
        }
    }

    /// Assesses whether a design whose plans are known is an optimum, without a search.
    ///
    /// # Errors
    /// Where it cannot be evaluated.
    pub fn assess(&self, phi: &[f64], controls: &[Matrices]) -> Result<StartSummary, Error> {
        let mut visitor = Visitor::new(self.problem, self.settings, self.aim);
        let mut summary = StartSummary::new(phi.to_vec());
        let visit = visitor.restart(phi, &Neighbour::of_each(controls))?.clone();
        let visit = visitor.with_total_gradient(&visit)?;
        summary.evaluations = 1;
        summary.without_contact = usize::from(visit.misses_contact());
        summary.branches = 1;
        summary.record(&visit, &visitor, Ending::Converged);
        Ok(summary)
    }

    /// What a search from where another one missed the limits finds: towards the least excess and, if that is none, for the
    /// least information from there. `None` if nothing was missed, or nothing better is found.
    fn nearer_to_limits(&self, missed: &StartSummary, start: usize) -> Option<StartSummary> {
        let within_limits = matches!(self.aim, Aim::Information { factor } if factor.is_finite());
        let found_nothing = missed.controls.is_empty() || missed.status.meets_bounds();
        if !within_limits || found_nothing || self.keeps_last() || self.control.is_stopped() {
            return None;
        }
        let nearest = Self { aim: Aim::Cost, ..*self }.run(missed.to.clone(), Some(&missed.controls), start);
        let mut found = self.assess(&nearest.to, &nearest.controls).ok()?;
        let mut evaluations = [missed, &nearest, &found].map(|part| (part.evaluations, part.without_contact)).to_vec();
        if found.status.meets_bounds() {
            let least = self.run(found.to.clone(), Some(&found.controls), start);
            evaluations.push((least.evaluations, least.without_contact));
            if self.rank(&least) <= self.rank(&found) {
                found = least;
            }
        }
        let sum = |of: fn(&(usize, usize)) -> usize| evaluations.iter().map(of).sum();
        (self.rank(&found) < self.rank(missed)).then(|| StartSummary {
            from: missed.from.clone(),
            evaluations: sum(|&(evaluations, _)| evaluations),
            without_contact: sum(|&(_, without_contact)| without_contact),
            ..found
        })
    }

    /// Searches from one start, without checks of problem and settings.
    pub(super) fn run_start(&self, phi: &[f64], start: usize) -> StartSummary {
        let Self { problem, settings, control, .. } = *self;
        let scaling = Scaling::of(&problem.parameters);
        let from = if start == 0 { phi.to_vec() } else { random_start(&scaling, phi, settings.seed, start) };
        control.observer.observe(Event::StartBegan { start, of: settings.starts });
        let summary = self.run(from, None, start);
        control.observer.observe(Event::StartEnded { start });
        summary
    }

    fn run(&self, from: Vec<f64>, controls: Option<&[Matrices]>, start: usize) -> StartSummary {
        let mut summary = StartSummary::new(from);
        let mut rounds = Rounds { searcher: *self, start, summary: &mut summary };
        match rounds.run(controls.map(Neighbour::of_each)) {
            Ok(()) => {}
            Err(Error::Stopped) if !summary.controls.is_empty() => summary.stop(),
            Err(error) => {
                if matches!(error, Error::Stopped) {
                    summary.status = DesignStatus::Stopped;
                }
                summary.error = Some(error);
            }
        }
        summary.interrupted = self.control.is_stopped();
        summary
    }
}

/// Designs whose objectives differ by no more than this share are equally good.
const ALIKE: f64 = 1e-7;

/// A random point of the box, in scaled coordinates; each start has its own random stream.
fn random_start(scaling: &Scaling, phi: &[f64], seed: u64, start: usize) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream((1 << 32) + start as u64);
    let scaled: Vec<f64> = scaling.indices.iter().map(|_| uniform(&mut random)).collect();
    scaling.unscaled(phi, &scaled)
}
