use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering as Atomic};

use rayon::prelude::*;
use supple_model::ParameterHandle;
use supple_model::parameters::{CatalogueEntry, Parameter};

use crate::Error;
use crate::branches::{BranchSearch, GivenPlan, search_branches};
use crate::candidates::best_plan;
use crate::continuation::Scaling;
use crate::design::{
    CatalogueDesign, CatalogueMethod, Combination, Control, Event, KeptCombinations, NoObserver, Searcher, StartSummary,
};
use crate::pipeline::TaskState;
use crate::problem::Problem;
use crate::violation;

/// Results so far: the outcome of each combination, which is one entry index per catalogue.
type Known = BTreeMap<Vec<usize>, Result<StartSummary, Error>>;

/// A choice from catalogues in progress.
pub(super) struct Choosing<'a> {
    pub searcher: Searcher<'a>,
    /// The problem with the parameters that have catalogues held fixed.
    held: Problem,
    /// Indices of these parameters.
    pub places: Vec<usize>,
    /// The design without catalogues.
    continuous: &'a StartSummary,
    kept: &'a dyn KeptCombinations,
    done: AtomicUsize,
    known: Known,
}

impl<'a> Choosing<'a> {
    pub fn new(searcher: Searcher<'a>, continuous: &'a StartSummary, kept: &'a dyn KeptCombinations) -> Self {
        let places = searcher.problem.parameters.catalogued();
        let parameters = searcher.problem.parameters.held(places.iter().copied().map(ParameterHandle::at));
        let held = Problem { parameters, ..searcher.problem.clone() };
        Self { searcher, held, places, continuous, kept, done: AtomicUsize::new(0), known: Known::new() }
    }

    /// How many entries each catalogue has.
    pub fn lengths(&self) -> Vec<usize> {
        self.places.iter().map(|&place| self.searcher.problem.parameters.get(place).catalogue.len()).collect()
    }

    /// The entries around the design without catalogues: for each catalogue, the nearest below and the nearest above, the
    /// nearer of the two first; the same twice at the ends. Distance is measured in the search's scaled coordinates.
    pub fn around(&self) -> Vec<[usize; 2]> {
        let parameters = &self.searcher.problem.parameters;
        let scaling = Scaling::of(parameters);
        let around = |&place: &usize| {
            let catalogue = &parameters.get(place).catalogue;
            let at = scaling.indices.iter().position(|&index| index == place).unwrap_or(0);
            let scaled = |value: f64| {
                let mut phi = self.continuous.to.clone();
                phi[place] = value;
                scaling.scaled(&phi)[at]
            };
            let value = self.continuous.to[place];
            let above = catalogue.partition_point(|entry| entry.value < value).min(catalogue.len() - 1);
            let below = if catalogue[above].value > value { above.saturating_sub(1) } else { above };
            let distance = |entry: usize| (scaled(catalogue[entry].value) - scaled(value)).abs();
            if distance(above) < distance(below) { [above, below] } else { [below, above] }
        };
        self.places.iter().map(around).collect()
    }

    /// Whether a combination may be within the budget: what its entries cost together is. Other prices come on top.
    pub fn is_affordable(&self, entries: &[usize]) -> bool {
        let Searcher { problem, settings, .. } = self.searcher;
        let price = |(&place, &entry): (&usize, &usize)| self.price(problem.parameters.get(place), entry);
        let sum: f64 = self.places.iter().zip(entries).map(price).sum();
        settings.budget.is_none_or(|budget| violation(sum, budget) <= settings.feasibility)
    }

    /// The combination of the cheapest entries.
    pub fn cheapest(&self) -> Vec<usize> {
        let cheapest = |&place: &usize| {
            let parameter = self.searcher.problem.parameters.get(place);
            let price = |entry: &usize| self.price(parameter, *entry);
            (0..parameter.catalogue.len()).min_by(|a, b| price(a).total_cmp(&price(b))).unwrap_or(0)
        };
        self.places.iter().map(cheapest).collect()
    }

    fn price(&self, parameter: &Parameter, entry: usize) -> f64 {
        let CatalogueEntry { value, price, .. } = parameter.catalogue[entry];
        price.or(parameter.price.map(|price| price.at(value))).unwrap_or(0.0)
    }

    /// The best combination so far of those that satisfy a condition.
    pub fn best_of(&self, is_asked_for: impl Fn(&Vec<usize>) -> bool) -> Option<Vec<usize>> {
        let found = self.designed().filter(|(entries, _)| is_asked_for(entries));
        found.min_by(|(_, a), (_, b)| self.compare(a, b)).map(|(entries, _)| entries.clone())
    }

    /// How many combinations were tried.
    pub fn tried(&self) -> usize {
        self.known.len()
    }

    pub fn is_known(&self, entries: &[usize]) -> bool {
        self.known.contains_key(entries)
    }

    pub fn is_stopped(&self) -> bool {
        self.searcher.control.is_stopped()
    }

    /// Designs combinations in parallel until stopped; the one nearest to the design without catalogues is always
    /// designed, so that there is a result. `of` is the total number expected, for the observer.
    pub fn design_all(&mut self, combinations: Vec<Vec<usize>>, of: usize) {
        let nearest: Vec<usize> = self.around().into_iter().map(|[nearer, _]| nearer).collect();
        let Self { searcher, done, kept, .. } = &*self;
        let design_anew = |entries: &[usize]| {
            if entries != nearest && searcher.control.is_stopped() {
                return Err(Error::Stopped);
            }
            let designed = self.design(entries)?;
            // One that was under way when the stop was requested may be incomplete.
            if !searcher.control.is_stopped() {
                kept.keep(entries, &designed);
            }
            Ok(designed)
        };
        let run = |entries: Vec<usize>| {
            let designed = kept.find(&entries).map_or_else(|| design_anew(&entries), Ok);
            if matches!(designed, Err(Error::Stopped)) {
                return None;
            }
            let done = done.fetch_add(1, Atomic::Relaxed) + 1;
            searcher.control.observer.observe(Event::Combination { done, of });
            Some((entries, designed))
        };
        let found: Vec<_> = combinations.into_par_iter().filter_map(run).collect();
        self.known.extend(found);
    }

    /// Designs one combination: plans from the first guesses and from the design without catalogues; then, on the cheapest
    /// branch found, optimises the parameters without catalogues; also from random starts, as many as the
    /// settings specify.
    fn design(&self, entries: &[usize]) -> Result<StartSummary, Error> {
        let Searcher { problem, settings, control, .. } = self.searcher;
        let mut phi = self.continuous.to.clone();
        for (&place, &entry) in self.places.iter().zip(entries) {
            phi[place] = problem.parameters.get(place).catalogue[entry].value;
        }
        let plan = |(index, task)| {
            let mut state = TaskState::new(task);
            best_plan(problem, task, &phi, self.continuous.controls.get(index), &mut state)?;
            let given = GivenPlan::of(&state);
            let stream = (index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let search = BranchSearch {
                seed: settings.seed ^ stream,
                attempts: settings.branch_attempts,
                effort: state.effort,
                stop: &|| control.is_stopped(),
            };
            Ok(search_branches(problem, task, &phi, given, search).controls)
        };
        let controls = problem.tasks.iter().enumerate().map(plan).collect::<Result<Vec<_>, Error>>()?;
        let control = Control { observer: &NoObserver, ..control };
        let searcher = Searcher { problem: &self.held, control, ..self.searcher };
        match self.held.parameters.design().is_empty() {
            true => searcher.assess(&phi, &controls),
            false => {
                let near = searcher.search_from(&phi, &controls, 0)?;
                let random = (1..settings.starts).into_par_iter().filter(|_| !control.is_stopped());
                let random: Vec<_> = random.map(|start| searcher.run_start(&phi, start)).collect();
                let starts = [near].into_iter().chain(random).collect();
                let mut found = searcher.combine(starts, 0.0)?;
                let best = found.starts.swap_remove(found.best);
                let (evaluations, without_contact) = (found.evaluations, found.without_contact);
                Ok(StartSummary { evaluations, without_contact, ..best })
            }
        }
    }

    /// Combinations that could be designed, the best first; equally good ones in the order of their entries.
    fn ranked(&self) -> Vec<(&Vec<usize>, &StartSummary)> {
        let mut ranked: Vec<_> = self.designed().collect();
        ranked.sort_by(|(_, a), (_, b)| self.compare(a, b));
        ranked
    }

    /// Combinations that could be designed, in the order of their entries.
    fn designed(&self) -> impl Iterator<Item = (&Vec<usize>, &StartSummary)> {
        self.known.iter().filter_map(|(entries, designed)| Some((entries, designed.as_ref().ok()?)))
    }

    fn compare(&self, a: &StartSummary, b: &StartSummary) -> Ordering {
        self.searcher.rank(a).partial_cmp(&self.searcher.rank(b)).unwrap_or(Ordering::Equal)
    }

    /// The resulting choice.
    pub fn finish(self, method: CatalogueMethod, complete: bool, combinations: u64) -> Result<CatalogueDesign, Error> {
        let ranked = self.ranked().into_iter();
        let designed: Vec<Combination> = ranked
            .map(|(entries, summary)| Combination { entries: entries.clone(), summary: summary.clone() })
            .collect();
        if designed.is_empty() && self.known.is_empty() && self.is_stopped() {
            return Err(Error::Stopped);
        }
        let failed = self.known.len() - designed.len();
        let first_error = self.known.into_values().find_map(Result::err);
        match (designed.is_empty(), first_error) {
            (true, Some(error)) => Err(error),
            (true, None) => Err(Error::NotFinite { what: "every combination of entries" }),
            (false, first_error) => Ok(CatalogueDesign {
                method,
                combinations,
                complete,
                designed,
                failed,
                first_error,
                continuous: self.continuous.clone(),
            }),
        }
    }
}
