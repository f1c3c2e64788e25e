//! A front on the way, and what its points have in common.

use rayon::prelude::*;
use supple::design::{Aim, Control, DesignSettings, Searcher, StartSummary};
use supple::parameters::Parameters;

use crate::design::checked;
use crate::journal::Parts;
use crate::{LoadedTask, StudyError, Watch};

/// What all searches along a front share.
pub(super) struct Front<'a> {
    pub task: &'a LoadedTask,
    pub settings: DesignSettings,
    pub parts: Parts,
    pub watch: Watch<'a>,
}

impl Front<'_> {
    /// A search with an aim.
    pub fn searcher(&self, aim: Aim) -> Searcher<'_> {
        let control = Control { stop: self.watch.stop, ..Control::default() };
        // All points of a front are of one kind of information.
        Searcher::new(&self.task.problem, &self.settings, aim, control).with_one_information()
    }

    /// A search that is a part of the study, by the part's name.
    ///
    /// # Errors
    /// Those of the search and of the journal; if it is stopped, as what was stopped on its way is no point of a front.
    pub fn part(
        &self,
        name: &str,
        search: impl FnOnce() -> Result<StartSummary, supple::Error>,
    ) -> Result<StartSummary, StudyError> {
        checked(self.parts.part(name, self.watch, || Ok(search()?))?, &self.task.problem)
    }

    /// The least information at a factor of the bounds, from another design of the front.
    ///
    /// # Errors
    /// As of [`part`](Self::part).
    pub fn nearby(
        &self,
        name: &str,
        from: &StartSummary,
        factor: f64,
        number: usize,
    ) -> Result<StartSummary, StudyError> {
        let searcher = self.searcher(Aim::Information { factor });
        self.part(name, || searcher.search_from(&from.to, &from.controls, number))
    }

    /// The best of all starts of a search.
    ///
    /// # Errors
    /// As of [`part`](Self::part); where not even one start can be evaluated.
    pub fn best(&self, name: &str, searcher: &Searcher) -> Result<StartSummary, StudyError> {
        let start = |start: usize| {
            self.part(&format!("{name}, start {start}"), || searcher.search_start(&self.task.phi, start))
        };
        let starts = (0..self.settings.starts).into_par_iter().map(start).collect::<Result<_, _>>()?;
        let mut found = searcher.combine(starts, 0.0)?;
        Ok(found.starts.swap_remove(found.best))
    }
}

/// Information that differs by less than this, relatively, is the same.
pub(super) const SAME: f64 = 1e-9;

/// Design parameters at an end of their range.
pub(super) fn at_ends(parameters: &Parameters, summary: &StartSummary) -> Vec<String> {
    let is_at_end = |&index: &usize| {
        let parameter = parameters.get(index);
        parameter.bounds.into_iter().any(|end| parameter.is_at(end, summary.to[index]))
    };
    parameters.design().into_iter().filter(is_at_end).map(|index| parameters.get(index).name.clone()).collect()
}
