//! Exchange of plans between starts: a branch search that found no cheaper plan at the end of one start may have missed the
//! one on which another start ended (theory, section D).

use std::cmp::Ordering;

use rayon::prelude::*;
use supple_kernels::Matrices;

use super::StartSummary;
use super::rounds::Rounds;
use super::searcher::Searcher;
use crate::branches::{AROUND, is_cheaper};
use crate::continuation::{Continuation, Neighbour, Scaling, largest_difference};
use crate::pipeline::TaskState;
use crate::problem::Task;

/// A search that was resumed.
struct Resumed {
    /// The better of the old and the new result.
    summary: StartSummary,
    /// Whether the new result is the better one.
    better: bool,
}

impl Searcher<'_> {
    /// Continues the final plans of every start to the final designs of the others near it. If one is cheaper there, the
    /// search resumes from it, and the better of both ends is kept; repeated until no plan is cheaper. The result does not
    /// depend on the number of threads.
    pub(super) fn exchange_plans(&self, starts: &mut [StartSummary]) {
        let Self { settings, control, .. } = *self;
        if self.keeps_last() || settings.branch_attempts == 0 {
            return;
        }
        for _ in 0..settings.rounds {
            let given = &*starts;
            let resumed = |start: usize| (!control.is_stopped()).then(|| self.resumed(given, start)).flatten();
            let found: Vec<Option<Resumed>> = (0..given.len()).into_par_iter().map(resumed).collect();
            let mut better = false;
            for (start, found) in starts.iter_mut().zip(found) {
                let Some(found) = found else { continue };
                better |= found.better;
                *start = found.summary;
            }
            if !better {
                break;
            }
        }
    }

    /// The search from a start, resumed from cheaper plans of the others, and the better of both ends; `None` if no plan is
    /// cheaper.
    fn resumed(&self, starts: &[StartSummary], start: usize) -> Option<Resumed> {
        let known = &starts[start];
        let controls = self.cheaper_plans(starts, start)?;
        let mut summary = StartSummary::new(known.to.clone());
        let outcome = Rounds { searcher: *self, start, summary: &mut summary }.run(Some(Neighbour::of_each(&controls)));
        // What was found before an error remains valid, and counts only if it is better.
        summary.error = outcome.err().or(summary.error);
        let better = self.rank(&summary).partial_cmp(&self.rank(known)) == Some(Ordering::Less);
        let (evaluations, without_contact) = (summary.evaluations, summary.without_contact);
        let best = if better { StartSummary { from: known.from.clone(), ..summary } } else { known.clone() };
        let summary = StartSummary {
            evaluations: known.evaluations + evaluations,
            without_contact: known.without_contact + without_contact,
            ..best
        };
        Some(Resumed { summary, better })
    }

    /// The plan of every task at the end of a start, or that of another start where it is cheaper; `None` if no other is.
    fn cheaper_plans(&self, starts: &[StartSummary], start: usize) -> Option<Vec<Matrices>> {
        let scaling = Scaling::of(&self.problem.parameters);
        let at = &starts[start];
        let place = scaling.scaled(&at.to);
        let distance = |other: &StartSummary| largest_difference(&scaling.scaled(&other.to), &place);
        let near = starts.iter().enumerate().filter(|&(index, other)| index != start && distance(other) <= AROUND);
        let near: Vec<&StartSummary> = near.map(|(_, other)| other).collect();
        let mut better = false;
        let tasks = self.problem.tasks.iter().enumerate().zip(at.controls.iter().zip(&at.costs));
        let controls = tasks.map(|((index, task), (controls, &cost))| {
            // Of starts that ended at the same design, one plan per branch is tried, and only if it may be cheaper.
            let mut seen = vec![(place.clone(), cost)];
            let mut best = (cost, controls.clone());
            for other in &near {
                let (Some(of), Some(&its)) = (other.controls.get(index), other.costs.get(index)) else { continue };
                let there = scaling.scaled(&other.to);
                let same = |(place, cost): &(Vec<f64>, f64)| {
                    largest_difference(place, &there) <= SAME_PLACE
                        && !is_cheaper(its, *cost)
                        && !is_cheaper(*cost, its)
                };
                if seen.iter().any(same) {
                    continue;
                }
                seen.push((there, its));
                if let Some(found) = self.continued(task, &scaling, &other.to, &at.to, of)
                    && is_cheaper(found.0, best.0)
                {
                    (best, better) = (found, true);
                }
            }
            best.1
        });
        let controls = controls.collect();
        better.then_some(controls)
    }

    /// The expected cost and the controls of a plan continued from one design to another, where it converges.
    fn continued(
        &self,
        task: &Task,
        scaling: &Scaling,
        from: &[f64],
        to: &[f64],
        controls: &Matrices,
    ) -> Option<(f64, Matrices)> {
        let mut state = TaskState::new(task);
        let line = Continuation { settings: &self.problem.planning, task, scaling, from, to, finer: 1 };
        line.plan(&Neighbour::with(controls), &mut state).ok()?;
        state.plan.status.is_converged().then(|| (state.cost.expected(), state.plan.trajectory.controls))
    }
}

/// Designs that differ by no more than this, in scaled coordinates, count as the same.
const SAME_PLACE: f64 = 1e-6;
