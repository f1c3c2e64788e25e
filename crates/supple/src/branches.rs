//! Local minima of the nominal problem; contact creates many, one for each sequence of bounces.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;
use supple_kernels::{Matrices, halt, math};

use crate::Error;
use crate::candidates::{SAME_BRANCH, best_of_guesses, uniform, waved};
use crate::continuation::{Continuation, Failed, Neighbour, Scaling};
use crate::growth::explain;
use crate::pipeline::TaskState;
use crate::plan::{PlanMode, PlanSettings};
use crate::problem::{Problem, Task};

/// Attempts to find other local minima of the nominal problem; none by default.
///
/// Example: [`plan_at`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Attempts {
    /// How many plans are tried from perturbed controls.
    pub count: usize,
    /// The seed of the perturbations.
    pub seed: u64,
}

/// Plans a task at a design: from given controls, or else from the best of its first guesses; then, if there are attempts to
/// find other local minima, on the cheapest branch found. Returns the number of minima if there was such a search.
///
/// # Errors
/// Where no guess leads to a finite plan.
///
/// ```
/// use supple::design::{Attempts, best_plan, cheapest_of, minima_at, plan_at};
/// use supple::pipeline::TaskState;
/// # let task = r#"
/// #     model = { kind = "linear", A = [[1.0, 0.1], [0.1, 1.0]], B = [[0.0], [0.1]], C = [[1.0, 0.0]] }
/// #     parameters.variance = { initial = 1e-4, bounds = [1e-6, 1e-2], scale = "log", unit = "m^2" }
/// #     [[tasks]]
/// #     name = "balance"
/// #     steps = 50
/// #     time_step = 0.1
/// #     bound = 15.0
/// #     initial_state = [1.0, 0.0]
/// #     noise = { initial = [1e-2, 1e-2], process = [0.0, 1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0, 0.0], [0.0, 0.1]], R = [[0.1]] }]
/// # "#;
///
/// // The task of the front page.
/// let problem = supple_file::parse(task, "balance.toml")?;
/// let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
/// let mut state = TaskState::new(task);
/// best_plan(&problem, task, &phi, None, &mut state)?;
/// assert!(state.plan.status.is_converged());
///
/// // The same with four attempts to find another local minimum.
/// let attempts = Attempts { count: 4, seed: 1 };
/// let minima = plan_at(&problem, task, &phi, None, attempts, &mut state)?;
/// assert_eq!(minima, Some(1));
///
/// // The minima themselves, and the cheapest of them.
/// let minima = minima_at(&problem, task, &phi, None, attempts, &mut state)?;
/// let cost = state.cost.expected();
/// cheapest_of(&problem, task, &phi, &minima, &mut state)?;
/// assert!((state.cost.expected() - cost).abs() < 1e-9 * cost);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn plan_at(
    problem: &Problem,
    task: &Task,
    phi: &[f64],
    controls: Option<&Matrices>,
    attempts: Attempts,
    state: &mut TaskState,
) -> Result<Option<usize>, Error> {
    let minima = minima_at(problem, task, phi, controls, attempts, state)?;
    Ok((attempts.count > 0).then_some(minima.len()))
}

/// Plans as [`plan_at`] does; the controls of all local minima that it found, or, without attempts to find others, of the
/// plan alone.
///
/// # Errors
/// Where no guess leads to a finite plan.
///
/// Example: [`plan_at`].
pub fn minima_at(
    problem: &Problem,
    task: &Task,
    phi: &[f64],
    controls: Option<&Matrices>,
    Attempts { count: attempts, seed }: Attempts,
    state: &mut TaskState,
) -> Result<Vec<Matrices>, Error> {
    match controls {
        Some(controls) => {
            state.limit_time(problem.planning.time_limit);
            let planned = state.evaluate(task, phi, &problem.planning, Some(controls));
            planned.map_err(|error| explain(task, phi, error, &state.plan.trajectory))?;
        }
        None => best_of_guesses(problem, task, phi, state)?,
    }
    if attempts == 0 {
        return Ok(vec![state.plan.trajectory.controls.clone()]);
    }
    let given = GivenPlan::of(state);
    let (passed_over, iterations) = (state.plan.passed_over, state.plan.iterations);
    let search = BranchSearch { seed, attempts, effort: usize::MAX, stop: &|| false };
    let found = search_branches(problem, task, phi, given, search);
    let is_same = !is_cheaper(found.cost, given.cost);
    Error::check_stop()?;
    // The time of a plan is not that of the search for others.
    state.limit_time(problem.planning.time_limit);
    state.evaluate(task, phi, &problem.planning, Some(&found.controls))?;
    if is_same {
        // The same plan, from its own controls.
        state.plan.passed_over = passed_over;
        state.plan.iterations += iterations;
    }
    Ok(found.minima)
}

/// Plans a task at a design on the cheapest of several local minima, given by their controls: as of
/// [`minima_at`] where only noise differed, of which nominal plans know nothing, but the expected cost does.
///
/// # Errors
/// Where none of them leads to a finite plan.
///
/// Example: [`plan_at`].
pub fn cheapest_of(
    problem: &Problem,
    task: &Task,
    phi: &[f64],
    minima: &[Matrices],
    state: &mut TaskState,
) -> Result<(), Error> {
    let mut cost = |controls: &Matrices| {
        state.limit_time(problem.planning.time_limit);
        let planned = state.evaluate(task, phi, &problem.planning, Some(controls));
        planned.map_or(f64::INFINITY, |()| cost_of_branch(state))
    };
    let costs: Vec<f64> = minima.iter().map(&mut cost).collect();
    Error::check_stop()?;
    let best = (0..costs.len()).min_by(|one, other| costs[*one].total_cmp(&costs[*other]));
    let best = best.ok_or(Error::NotFinite { what: "the first guess" })?;
    state.limit_time(problem.planning.time_limit);
    state.evaluate(task, phi, &problem.planning, Some(&minima[best]))
}

/// The expected cost of a plan by which branches are compared: infinite if the plan did not converge, or violates a limit
/// that it has to keep, so that any plan that does not is better.
pub(crate) fn cost_of_branch(state: &TaskState) -> f64 {
    if state.plan.status.is_converged() { state.cost.expected() } else { f64::INFINITY }
}

/// The expected cost of a local minimum that is cheaper than the plan by more than a small share, if a few attempts find one
/// in less time than the plan took, about. `None` for plans that take long.
pub(crate) fn cheaper_minimum(
    problem: &Problem,
    task: &Task,
    phi: &[f64],
    seed: u64,
    state: &TaskState,
) -> Option<f64> {
    let plan = &state.plan;
    let size = task.system.dimensions().joint();
    let takes_long = task.steps.saturating_mul(size * size).saturating_mul(plan.iterations) > MOST_PROBED;
    let cost = cost_of_branch(state);
    if takes_long || plan.mode != PlanMode::Nominal || !cost.is_finite() {
        return None;
    }
    let effort = PROBES * SHARES * plan.iterations;
    let search = BranchSearch { seed, attempts: PROBES, effort, stop: &|| false };
    let found = search_branches(problem, task, phi, GivenPlan::of(state), search);
    (found.cost < cost - WORTH * cost.abs()).then_some(found.cost)
}

/// Attempts to find a minimum that is cheaper by more than this share, for plans whose iterations, steps and squared numbers
/// of states and controls multiply to no more than this.
const PROBES: usize = 2;
const WORTH: f64 = 1e-2;
const MOST_PROBED: usize = 25_000_000;

/// The plan for which a branch search looks for others.
#[derive(Clone, Copy)]
pub(crate) struct GivenPlan<'a> {
    pub controls: &'a Matrices,
    /// Its expected cost; infinite if it is no minimum.
    pub cost: f64,
}

impl<'a> GivenPlan<'a> {
    pub fn of(state: &'a TaskState) -> Self {
        Self { controls: &state.plan.trajectory.controls, cost: cost_of_branch(state) }
    }
}

/// Options of a branch search.
#[derive(Clone, Copy)]
pub(crate) struct BranchSearch<'a> {
    /// Seed of the attempts.
    pub seed: u64,
    /// Maximum number of attempts.
    pub attempts: usize,
    /// The iterations that the search may take, about; for example as many as the preceding search took. Several times as many
    /// while attempts find what is cheaper. Each attempt may take a share of them.
    pub effort: usize,
    /// Whether to stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

/// What a branch search found for one task.
pub(crate) struct Branches {
    /// Controls of the different local minima found, including the given one if it is one.
    pub minima: Vec<Matrices>,
    /// Controls of the one with the least expected cost.
    pub controls: Matrices,
    /// Its expected cost.
    pub cost: f64,
}

/// Searches for other local minima of a task's nominal problem at a design, by continuation: plans at random designs
/// from random multiples of the first guess, each continued to the design in small steps; if there are contacts to make,
/// every other attempt starts from a plan that approached them. Deterministic in the seed, whatever the number of threads.
///
/// If stopped, it returns what was found so far.
pub(crate) fn search_branches(
    problem: &Problem,
    task: &Task,
    phi: &[f64],
    given: GivenPlan,
    BranchSearch { seed, attempts, effort, stop }: BranchSearch,
) -> Branches {
    let is_stopped = || halt::is_requested() || stop();
    let allowance = (effort / SHARES).max(LEAST_ALLOWED);
    let scaling = &Scaling::of(&problem.parameters);
    let one = BranchAttempt { problem, task, phi, scaling, given: given.controls, allowance };
    let attempt = |state: &mut TaskState, attempt: usize| {
        if is_stopped() {
            return (0, None);
        }
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(attempt as u64 + 1);
        state.effort = 0;
        state.limit_time(problem.planning.time_limit);
        let found = one.run(attempt % 2 == 1, &mut random, state);
        (state.effort, found.ok().flatten())
    };
    let GivenPlan { controls, cost } = given;
    let mut branches = Branches { minima: Vec::new(), controls: controls.clone(), cost };
    let mut seen: Vec<f64> = Some(cost).filter(|cost| cost.is_finite()).into_iter().collect();
    branches.minima.extend(seen.first().map(|_| controls.clone()));
    let (mut spent, mut next) = (0, 0);
    while next < attempts && !is_stopped() {
        let batch = next..(next + BATCH).min(attempts);
        next = batch.end;
        let found: Vec<(usize, Option<(f64, Matrices)>)> =
            batch.into_par_iter().map_init(|| TaskState::new(task), attempt).collect();
        let before = branches.cost;
        for (effort, found) in found {
            spent += effort;
            let Some((cost, controls)) = found else { continue };
            if seen.iter().all(|other| (cost - other).abs() > SAME_BRANCH * (1.0 + other.abs())) {
                seen.push(cost);
                branches.minima.push(controls.clone());
            }
            if is_cheaper(cost, branches.cost) {
                branches.controls = controls;
                branches.cost = cost;
            }
        }
        let most = if branches.cost < before { effort.saturating_mul(WORTHWHILE) } else { effort };
        if spent >= most {
            break;
        }
    }
    branches
}

/// The share of the effort of a branch search that one attempt may take, and the least number of iterations it may.
const SHARES: usize = 4;
const LEAST_ALLOWED: usize = 50;
/// How many times its effort a branch search may take while it finds cheaper minima.
const WORTHWHILE: usize = 4;

/// Attempts of a branch search that are run in parallel; this does not depend on the number of threads.
const BATCH: usize = 8;

/// Width of the parameter box relative to the reach of branch searches.
const REACHES: f64 = 3.0;

/// Branch searches continue plans to a design only from designs at most this far away, in scaled coordinates.
pub(crate) const AROUND: f64 = 1.0 / REACHES;

/// Whether a cost is so far below another that it belongs to another branch.
pub(crate) fn is_cheaper(cost: f64, than: f64) -> bool {
    if than == f64::INFINITY { cost < than } else { cost < than - SAME_BRANCH * (1.0 + than.abs()) }
}

/// What the attempts of a branch search have in common.
struct BranchAttempt<'a> {
    problem: &'a Problem,
    task: &'a Task,
    phi: &'a [f64],
    scaling: &'a Scaling,
    /// Controls of the given plan.
    given: &'a Matrices,
    /// The iterations that an attempt may take.
    allowance: usize,
}

impl BranchAttempt<'_> {
    /// The expected cost and the controls of the minimum that one attempt finds; `approach` says whether it starts from
    /// a plan that approached the contacts.
    fn run(
        &self,
        approach: bool,
        random: &mut ChaCha8Rng,
        state: &mut TaskState,
    ) -> Result<Option<(f64, Matrices)>, Error> {
        let &Self { problem, task, phi, scaling, given, allowance } = self;
        // A design up to `AROUND` away from this one, in scaled coordinates.
        let source: Vec<f64> =
            scaling.scaled(phi).iter().map(|s| (s + (uniform(random) - 0.5) * 2.0 / REACHES).clamp(0.0, 1.0)).collect();
        let source = scaling.unscaled(phi, &source);
        let mut guess = disturbed_guess(task, phi, given, &source, random);
        if approach && let Some((controls, _)) = state.approach(task, &source, &problem.planning, &guess) {
            guess = controls;
        }
        let left = |state: &TaskState| {
            let settings = &problem.planning;
            let most = settings.max_iterations.min(allowance.saturating_sub(state.effort)).max(1);
            PlanSettings { max_iterations: most, ..settings.clone() }
        };
        state.plan_only(task, &source, &left(state), Some(&guess))?;
        Error::check_stop()?;
        if !state.plan.status.is_converged() && state.effort >= allowance {
            return Ok(None);
        }
        let neighbour = Neighbour::of(&state.plan);
        let settings = &left(state);
        let line = Continuation { settings, task, scaling, from: &source, to: phi, finer: 1 };
        line.plan(&neighbour, state).map_err(Failed::error)?;
        let converged = state.plan.status.is_converged();
        Ok(converged.then(|| (state.cost.expected(), state.plan.trajectory.controls.clone())))
    }
}

/// Controls to plan from at a design, chosen at random: multiples of the first guess of a task; if it has none,
/// the controls that hold the first state, plus multiples of the deviation of a given plan at another design from
/// its own holding controls. Such controls may be positions, and multiples of positions would be far away. Random waves are
/// added where these multiples are of nothing.
fn disturbed_guess(task: &Task, phi: &[f64], given: &Matrices, source: &[f64], random: &mut ChaCha8Rng) -> Matrices {
    let number = uniform(random);
    if !task.initial_control.is_empty() {
        let guess = task.guess(source, math::exp(number * 1.8));
        let is_zero = (0..task.steps).all(|t| guess.vector(t).iter().all(|u| *u == 0.0));
        return if is_zero { waved(task, guess, random) } else { guess };
    }
    let (held, mut guess) = (task.guess(phi, 1.0), task.guess(source, 1.0));
    for t in 0..task.steps {
        for (i, to) in guess.vector_mut(t).iter_mut().enumerate() {
            *to += 2.0 * number * (given.vector(t)[i] - held.vector(t)[i]);
        }
    }
    let is_held = (0..task.steps).all(|t| given.vector(t) == held.vector(t));
    if is_held { waved(task, guess, random) } else { guess }
}
