use super::optimality::OPTIMAL;
use super::outer::{Ending, Optimiser, OuterProblem};
use super::search::Search;
use super::searcher::{Searcher, own_optimiser};
use super::visit::Visitor;
use super::visited::{Visit, plans_of};
use super::{Event, StartSummary};
use crate::Error;
use crate::branches::{BranchSearch, GivenPlan, search_branches};
use crate::candidates::best_of_guesses;
use crate::continuation::{Neighbour, largest_difference};
use crate::pipeline::TaskState;

/// Information below this counts as zero, nats.
const NOTHING: f64 = 1e-9;

/// Rounds of optimiser and branch search from one start.
pub(super) struct Rounds<'a, 's> {
    pub searcher: Searcher<'a>,
    /// The start's number.
    pub start: usize,
    /// The result; its starting point is already set.
    pub summary: &'s mut StartSummary,
}

impl Rounds<'_, '_> {
    /// Runs the rounds, from given plans or from those of the tasks' first guesses.
    pub fn run(&mut self, plans: Option<Vec<Neighbour>>) -> Result<(), Error> {
        let Searcher { problem, settings, aim, control, .. } = self.searcher;
        let own = own_optimiser(settings);
        let optimiser = self.searcher.optimiser.unwrap_or(&*own);
        let mut visitor = Visitor::new(problem, settings, aim);
        let mut plans = match plans {
            Some(plans) => plans,
            None => self.first_plans()?,
        };
        let mut phi = self.summary.from.clone();
        let mut round = 0;
        while round < settings.rounds {
            visitor.stay_nowhere();
            let first = visitor.restart(&phi, &plans)?.clone();
            let visitor = &mut visitor;
            let mut search =
                Search { visitor, control, start: self.start, evaluations: 0, without_contact: 0, error: None };
            search.tell(&first);
            let ending = run_optimiser(&mut search, optimiser, true);
            self.summary.evaluations += search.evaluations;
            self.summary.without_contact += search.without_contact;
            self.summary.error = search.error.take();
            let Some(last) = visitor.visits.last().cloned() else { break };
            let assessed = match visitor.with_total_gradient(&last) {
                Err(Error::Stopped) => last.clone(),
                assessed => assessed?,
            };
            self.summary.record(&assessed, visitor, ending);
            if ending == Ending::Stopped || control.is_stopped() || optimiser.keeps_last() {
                break;
            }
            // If the minimised information has reached zero, minimise the next kind of information.
            if self.searcher.goes_on
                && self.summary.status.meets_bounds()
                && last.information(problem) <= NOTHING
                && let Some(next) = visitor.weighed.weights.next()
            {
                if visitor.weighed.weights.needed > 0.0 {
                    visitor.weighed.needs_nothing.fill(true);
                }
                visitor.weighed.weights = next;
                self.summary.passed += 1;
                (phi, plans) = (last.phi.clone(), plans_of(&last));
                continue;
            }
            let effort = visitor.effort();
            let Some(better) = self.better_branches(&last, round, effort) else { break };
            (phi, plans) = (last.phi, better);
            round += 1;
        }
        Ok(())
    }

    /// The plans at the start, each the best of the task's first guesses.
    fn first_plans(&self) -> Result<Vec<Neighbour>, Error> {
        let problem = self.searcher.problem;
        let plan = |task| {
            let mut state = TaskState::new(task);
            best_of_guesses(problem, task, &self.summary.from, &mut state)?;
            Ok(Neighbour::of(&state.plan))
        };
        problem.tasks.iter().map(plan).collect()
    }

    /// Searches for cheaper branches at a design, with as many iterations as the search before took; the plans to continue
    /// from, if there are any.
    fn better_branches(&mut self, at: &Visit, round: usize, effort: usize) -> Option<Vec<Neighbour>> {
        self.summary.branches = 1;
        let Searcher { problem, settings, control, .. } = self.searcher;
        if settings.branch_attempts == 0 {
            return None;
        }
        control.observer.observe(Event::SearchingBranches { start: self.start });
        let mut better = false;
        let mut count = 1;
        let tasks = problem.tasks.iter().zip(&at.tasks).enumerate();
        let plans = tasks.map(|(index, (task, visit))| {
            let stream = (self.start * 1000 + round * 100 + index) as u64;
            let seed = settings.seed ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let given = GivenPlan { controls: &visit.plan.controls, cost: visit.cost };
            let search = BranchSearch {
                seed,
                attempts: settings.branch_attempts,
                effort: effort / at.tasks.len(),
                stop: &|| control.is_stopped(),
            };
            let found = search_branches(problem, task, &at.phi, given, search);
            better |= found.cost < visit.cost;
            count = count.max(found.minima.len());
            Neighbour::with(&found.controls)
        });
        let plans = plans.collect();
        self.summary.branches = count;
        better.then_some(plans)
    }
}

/// How often an optimiser that finds nothing better begins again, closer to where it began.
const NEARER: usize = 6;

/// Runs an optimiser from the last design of a search, and leaves the design that it found as the last one.
///
/// An objective with needed information has a kink where a task begins to need information, and gradients say nothing across
/// it: if `stays`, a search that ends there without an optimum continues among designs for which that task needs none.
fn run_optimiser(search: &mut Search, optimiser: &dyn Optimiser, stays: bool) -> Ending {
    let mut ending = Ending::Stalled;
    let mut left = None;
    let (mut runs, mut nearer, mut radius) = (optimiser.runs(), NEARER, f64::INFINITY);
    while runs > 0 {
        let Some(first) = search.visitor.visits.last().cloned() else { break };
        let mut problem = OuterProblem::new(search, optimiser, first.clone()).within(radius);
        ending = optimiser.minimise(&mut problem);
        search.error = problem.into_error();
        if optimiser.keeps_last() {
            // Its last design is its result, unless it is worse than where it began.
            if search.visitor.visits.last().is_some_and(|last| search.merit(last) > search.merit(&first)) {
                search.choose();
            }
            break;
        }
        let last = search.visitor.visits.last().cloned();
        let Some(best) = search.choose() else { break };
        if ending == Ending::Stopped || search.error.is_some() || search.optimality(&best).0 <= OPTIMAL {
            break;
        }
        if stays && let Ok(Some(before)) = search.visitor.stay_where_nothing_is_needed(&best) {
            left.get_or_insert((best, before));
            (runs, radius) = (runs - 1, f64::INFINITY);
            continue;
        }
        // It only moved to worse points, such as one beyond a limit where all slopes are 0: stay nearer.
        if best.scaled == first.scaled {
            let moved = last.map_or(0.0, |last| largest_difference(&last.scaled, &first.scaled)).min(radius);
            if optimiser.runs() < 2 || nearer == 0 || moved < 1e-9 {
                break;
            }
            (nearer, radius) = (nearer - 1, 0.5 * moved);
            continue;
        }
        (runs, radius) = (runs - 1, f64::INFINITY);
    }
    let Some((best, (weighed, visits))) = left else { return ending };
    let is_worse = |last: &Visit| search.merit(last) > search.merit(&best);
    if !search.visitor.visits.last().is_none_or(is_worse) {
        return ending;
    }
    (search.visitor.weighed, search.visitor.visits) = (weighed, visits);
    if ending == Ending::Stopped { ending } else { run_optimiser(search, optimiser, false) }
}
