//! Choices from catalogues: parameters that can only take discrete values (theory, section D).

mod choosing;
mod neighbours;

use std::time::Instant;

use super::{CatalogueDesign, CatalogueMethod, Design, DesignStatus, KeepNone, KeptCombinations, Searcher};
use crate::Error;
use choosing::Choosing;

impl CatalogueDesign {
    /// How much larger, in nats with weighted prices, the chosen design's objective is than that of the continuous one, if
    /// both meet every bound. `None` if entries have prices and prices count: the continuous design does not pay them.
    #[must_use]
    pub fn gap(&self, searcher: &Searcher) -> Option<f64> {
        let (chosen, free) = (&self.chosen().summary, &self.continuous);
        let met = [chosen, free].iter().all(|summary| !searcher.rank(summary).0);
        let Searcher { problem, settings, .. } = searcher;
        let counts = settings.budget.is_some() || settings.price_weight > 0.0;
        let priced = |place: usize| problem.parameters.get(place).catalogue.iter().any(|entry| entry.price.is_some());
        let comparable = !(counts && problem.parameters.catalogued().into_iter().any(priced));
        (met && comparable).then_some(chosen.objective - free.objective)
    }

    /// How many of the designed combinations meet every bound.
    #[must_use]
    pub fn feasible(&self, searcher: &Searcher) -> usize {
        self.designed.iter().filter(|combination| !searcher.rank(&combination.summary).0).count()
    }
}

impl Searcher<'_> {
    /// Chooses from the catalogues of the parameters that have any, given a design that ignored them (theory,
    /// equation D.7): designs every combination of entries where there are at most as many as the settings allow, or as
    /// many whose entries are within the budget, and otherwise that many, around the best ones. For each combination the
    /// other parameters are optimised anew. Without catalogues the design stays as it is.
    ///
    /// # Errors
    /// Where no combination can be evaluated.
    pub fn choose(&self, design: Design) -> Result<Design, Error> {
        self.choose_kept(design, &KeepNone)
    }

    /// [`choose`](Self::choose), with the designs of combinations that an interrupted search kept.
    ///
    /// # Errors
    /// Where no combination can be evaluated.
    pub fn choose_kept(&self, design: Design, kept: &dyn KeptCombinations) -> Result<Design, Error> {
        if self.problem.parameters.catalogued().is_empty() || design.catalogue.is_some() {
            return Ok(design);
        }
        let clock = Instant::now();
        let mut catalogue = match choose(Choosing::new(*self, &design.starts[design.best], kept)) {
            // No combination was designed: return the design without catalogues.
            Err(Error::Stopped) => return Ok(Design { status: DesignStatus::Stopped, ..design }),
            chosen => chosen?,
        };
        let summaries = || catalogue.designed.iter().map(|combination| &combination.summary);
        let mut evaluations: usize = summaries().map(|summary| summary.evaluations).sum();
        let mut without_contact: usize = summaries().map(|summary| summary.without_contact).sum();
        let chosen = &catalogue.chosen().summary;
        if self.rank(chosen) < self.rank(&catalogue.continuous) && !self.control.is_stopped() {
            // The search without catalogues missed this better region: continue that search from here.
            let further = match self.search_from(&chosen.to, &chosen.controls, 0) {
                Err(Error::Stopped) => chosen.clone(),
                further => {
                    let further = further?;
                    evaluations += further.evaluations;
                    without_contact += further.without_contact;
                    further
                }
            };
            let better = if self.rank(&further) < self.rank(chosen) { further } else { chosen.clone() };
            catalogue.continuous = better;
        }
        let stopped = design.status == DesignStatus::Stopped || self.control.is_stopped();
        let best = catalogue.chosen().summary.status;
        let status = match (stopped, best, catalogue.complete) {
            (true, ..) => DesignStatus::Stopped,
            (false, DesignStatus::Converged, false) => DesignStatus::NotConverged,
            (false, status, _) => status,
        };
        Ok(Design {
            status,
            evaluations: design.evaluations + evaluations,
            without_contact: design.without_contact + without_contact,
            seconds: design.seconds + clock.elapsed().as_secs_f64(),
            catalogue: Some(catalogue),
            ..design
        })
    }
}

/// Up to so many combinations, those within the budget are counted.
const ENUMERATED: u64 = 1_000_000;

/// Designs combinations according to the settings, and chooses the best.
fn choose(mut choosing: Choosing) -> Result<CatalogueDesign, Error> {
    let lengths = choosing.lengths();
    let combinations = lengths.iter().fold(1, |count: u64, &length| count.saturating_mul(length as u64));
    let most = choosing.searcher.settings.max_combinations;
    let within_budget = || {
        let mut all = all_combinations(&lengths);
        all.retain(|entries| choosing.is_affordable(entries));
        Some(all).filter(|all| (1..=most).contains(&all.len()))
    };
    let all = match combinations {
        few if few <= most as u64 => Some(all_combinations(&lengths)),
        // None beyond the budget has to be designed to be excluded.
        ..=ENUMERATED => within_budget(),
        _ => None,
    };
    let (method, complete) = match all {
        Some(all) => {
            let count = all.len();
            choosing.design_all(all, count);
            (CatalogueMethod::AllCombinations, choosing.tried() == count)
        }
        None => (CatalogueMethod::Neighbourhood, neighbours::explore(&mut choosing, most)),
    };
    choosing.finish(method, complete, combinations)
}

/// All combinations of one index per list, the last index varying fastest.
fn all_combinations(lengths: &[usize]) -> Vec<Vec<usize>> {
    lengths.iter().fold(vec![Vec::new()], |begun, &length| {
        let extend = |begun: &Vec<usize>| {
            let begun = begun.clone();
            (0..length).map(move |place| begun.iter().copied().chain([place]).collect())
        };
        begun.iter().flat_map(extend).collect()
    })
}
