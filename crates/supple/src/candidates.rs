//! The best plan of a task at a design, from several guesses.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use supple_kernels::Matrices;
use supple_model::Value;

use crate::Error;
use crate::growth::explain;
use crate::pipeline::TaskState;
use crate::plan::{Asked, Patience, Plan, PlanMode, PlanSettings, PlanStatus, add_wave};
use crate::problem::{Problem, Task};
use crate::settings::RegularisationKind;
use crate::touching::misses_contact;

/// Factors by which a constant first guess is scaled when searching for the plan of least cost.
const GUESS_FACTORS: [f64; 5] = [1.0, 1.4, 2.0, 2.8, 4.0];

/// A search that has not converged after so many iterations creeps.
const MANY: usize = 100;

/// Plans a task as [`best_plan`] does, without a neighbour.
///
/// # Errors
/// Where no guess leads to a finite plan.
pub(crate) fn best_of_guesses(problem: &Problem, task: &Task, phi: &[f64], state: &mut TaskState) -> Result<(), Error> {
    best_plan(problem, task, phi, None, state)
}

/// Plans and assesses a task at a design as [`Problem::evaluate`] does: from its first guess; if that is one constant row,
/// also from multiples of it; if it has none and enforces bounds or limits, also from controls that hold the first state; if
/// there are contacts to make or friction to overcome, also from a plan that has approached them and, if the plan misses one
/// whose force a cost wants, from one that was drawn to it; if all of these creep, from the first guess with regularised
/// states; if given, from the controls of a known plan, and of a `neighbour`, such as those of the plan at a nearby design;
/// and, if a far cheaper plan exceeds limits, within limits that are narrowed from there.
///
/// Keeps the converged plan of least nominal cost, but the one from known controls only if it is on another, cheaper
/// branch, so that rounding does not decide. Leaves it in `state`, with its own iterations. A plan that is cheaper but did
/// not converge is recorded in [`Plan::passed_over`](crate::plan::Plan::passed_over).
///
/// # Errors
/// If no start leads to a finite plan, or a covariance is indefinite.
///
/// Example: [`plan_at`](crate::design::plan_at).
pub fn best_plan(
    problem: &Problem,
    task: &Task,
    phi: &[f64],
    neighbour: Option<&Matrices>,
    state: &mut TaskState,
) -> Result<(), Error> {
    let settings = &problem.planning;
    state.limit_time(settings.time_limit);
    let is_zero = |row: &Vec<Value>| row.iter().all(|value| value.is_zero());
    let constant = task.initial_control.len() == 1 && task.steps > 1 && !is_zero(&task.initial_control[0]);
    let factors = if constant { &GUESS_FACTORS[..] } else { &GUESS_FACTORS[..1] };
    let mut candidates = Candidates::default();
    let has_guess = !task.initial_control.is_empty();
    let guess = if has_guess { task.guess(phi, 1.0) } else { state.first_guess(task, phi).1 };
    // The first guess takes a sweep.
    let swept = usize::from(!has_guess);
    if let Some((controls, before)) = state.approach(task, phi, settings, &guess) {
        let before = before + swept;
        candidates.plan(problem, task, phi, Start { patience: Patience::Close, before, ..Start::of(&controls) }, state);
    }
    // Friction alone does not create branches that would justify another plan.
    if candidates.converged.is_none() || state.has_to_approach(task, phi) {
        for &factor in factors {
            let scaled = has_guess.then(|| task.guess(phi, factor));
            let controls = scaled.as_ref().unwrap_or(&guess);
            candidates.plan(problem, task, phi, Start { before: swept, ..Start::of(controls) }, state);
        }
    }
    // The law behind the first guess knows nothing of bounds and limits.
    if !has_guess && (task.control_bounds.is_some() || task.system.constraints().is_some()) {
        let controls = task.guess(phi, 1.0);
        candidates.plan(problem, task, phi, Start { margin: SAME_BRANCH, ..Start::of(&controls) }, state);
    }
    if !has_guess && candidates.converged.is_none() {
        candidates.plan(problem, task, phi, Start::of(&task.guess(phi, 0.0)), state);
    }
    // A search that lost a contact on the way to it may find it from elsewhere.
    let missed = candidates.converged.as_ref().filter(|plan| misses_contact(task, phi, &plan.trajectory));
    if let Some(controls) = missed.map(|plan| plan.trajectory.controls.clone())
        && let Some((controls, before)) = state.draw_to_contacts(task, phi, settings, &controls)
    {
        candidates.plan(problem, task, phi, Start { patience: Patience::Close, before, ..Start::of(&controls) }, state);
    }
    // A guess at which the cost has a saddle, as hanging still has where standing is wanted, leads nowhere.
    if candidates.is_indefinite() || candidates.stationary().is_some_and(|plan| state.is_saddle(task, phi, plan)) {
        for size in SHAKES {
            candidates.plan(problem, task, phi, Start::of(&shaken(&guess, size)), state);
            if candidates.has_left() {
                break;
            }
        }
        if !candidates.has_left() {
            let mut random = ChaCha8Rng::seed_from_u64(0);
            for _ in 0..WAVES {
                candidates.plan(problem, task, phi, Start::of(&waved(task, guess.clone(), &mut random)), state);
            }
        }
    }
    // Where controls that are held back creep, states that are held back may not.
    if candidates.creeps() && settings.regularisation == RegularisationKind::Control {
        let held_back = PlanSettings { regularisation: RegularisationKind::State, ..settings.clone() };
        candidates.plan(problem, task, phi, Start { settings: Some(&held_back), ..Start::of(&guess) }, state);
    }
    for controls in task.known_controls.iter().chain(neighbour) {
        candidates.plan(problem, task, phi, Start { margin: SAME_BRANCH, ..Start::of(controls) }, state);
    }
    // Where feedback that keeps the first state costs less than the plan, an unstable system ran away from the guess.
    if has_guess && neighbour.is_none() {
        let (cost, held) = state.first_guess(task, phi);
        if candidates.cost().is_some_and(|least| cost < least) {
            candidates.plan(problem, task, phi, Start { before: 1, margin: SAME_BRANCH, ..Start::of(&held) }, state);
        }
    }
    if let Some(error) = candidates.failure()
        && !matches!(explain(task, phi, error, &state.plan.trajectory), Error::TimeStep { .. })
    {
        candidates.plan(problem, task, phi, Start { fed_back: true, ..Start::of(&guess) }, state);
    }
    // Limits that a much cheaper plan exceeds may be kept beside it.
    if neighbour.is_none()
        && task.system.constraints().is_some()
        && let Some(controls) = candidates.far_cheaper().map(|plan| plan.trajectory.controls.clone())
    {
        candidates.plan(problem, task, phi, Start { narrowed: true, ..Start::of(&controls) }, state);
    }
    match candidates.choose(task) {
        Ok(kept) => {
            state.plan = kept;
            state.assess_with(task, phi, settings).map_err(|error| explain(task, phi, error, &state.plan.trajectory))
        }
        Err(error) => Err(explain(task, phi, error, &state.plan.trajectory)),
    }
}

/// Where a plan starts from.
#[derive(Clone, Copy)]
struct Start<'a> {
    controls: &'a Matrices,
    patience: Patience,
    /// Iterations already spent to find these controls.
    before: usize,
    /// How much cheaper than the others the plan must be to be kept.
    margin: f64,
    /// Whether feedback is added to them if need be.
    fed_back: bool,
    /// Whether its limits are narrowed step by step.
    narrowed: bool,
    /// Settings other than those of the problem.
    settings: Option<&'a PlanSettings>,
}

impl<'a> Start<'a> {
    fn of(controls: &'a Matrices) -> Self {
        Self {
            controls,
            patience: Patience::Full,
            before: 0,
            margin: 0.0,
            fed_back: false,
            narrowed: false,
            settings: None,
        }
    }
}

/// The best of the plans from several guesses, and the error of the first guess that led to no plan.
#[derive(Default)]
struct Candidates {
    /// The cheapest plan that converged.
    converged: Option<Plan>,
    /// The cheapest plan that did not converge.
    other: Option<Plan>,
    error: Option<Error>,
}

impl Candidates {
    /// Plans from the given controls. After the planning deadline it does
    /// so only if there is no plan yet.
    fn plan(&mut self, problem: &Problem, task: &Task, phi: &[f64], start: Start, state: &mut TaskState) {
        if state.is_late() && (self.converged.is_some() || self.other.is_some()) {
            return;
        }
        if let Err(stopped) = Error::check_stop() {
            self.error.get_or_insert(stopped);
            return;
        }
        let Start { fed_back, narrowed, patience, .. } = start;
        let settings = start.settings.unwrap_or(&problem.planning);
        let asked = Asked { fed_back, narrowed, ..Asked::of(settings, patience) };
        if let Err(error) = state.plan_with(task.at(phi), asked, start.controls) {
            self.error.get_or_insert(error);
            return;
        }
        state.plan.iterations += start.before;
        self.keep(&state.plan, start.margin);
    }

    /// Keeps a plan if it is cheaper, by the margin, than the best so far of its kind (converged or not).
    fn keep(&mut self, plan: &Plan, margin: f64) {
        let best = if plan.status.is_converged() { &mut self.converged } else { &mut self.other };
        let cost = plan.objective;
        let cheaper = |best: &Plan| cost + margin * (1.0 + best.objective.abs()) < best.objective;
        if best.as_ref().is_none_or(|best| cheaper(best) || best.objective.is_nan()) {
            *best = Some(plan.clone());
        }
    }

    /// The nominal cost of the best plan so far; `None` if there is no plan.
    fn cost(&self) -> Option<f64> {
        self.converged.as_ref().or(self.other.as_ref()).map(|plan| plan.nominal_cost)
    }

    /// Whether no plan converged, and the best one has directions in which its cost falls.
    fn is_indefinite(&self) -> bool {
        self.converged.is_none() && self.other.as_ref().is_some_and(|plan| plan.status == PlanStatus::Indefinite)
    }

    /// Whether no plan converged, and the best one still got cheaper, but slowly.
    fn creeps(&self) -> bool {
        let ends_slowly = |plan: &Plan| matches!(plan.status, PlanStatus::MaxIterations | PlanStatus::SlowProgress);
        let is_slow = |plan: &Plan| plan.iterations >= MANY && ends_slowly(plan);
        self.converged.is_none() && self.other.as_ref().is_some_and(is_slow)
    }

    /// Whether a search has led from a saddle to another plan.
    fn has_left(&self) -> bool {
        !self.is_indefinite() && self.stationary().is_none()
    }

    /// The best plan, if it is the guess that its search began from.
    fn stationary(&self) -> Option<&Plan> {
        self.converged.as_ref().filter(|plan| plan.iterations <= 1 && plan.mode == PlanMode::Nominal)
    }

    /// The error, if there is no plan at all.
    fn failure(&self) -> Option<Error> {
        self.error.clone().filter(|_| self.converged.is_none() && self.other.is_none())
    }

    /// The plan that did not converge, or exceeds limits, if it costs far less than the best that does not.
    fn far_cheaper(&self) -> Option<&Plan> {
        let least = self.converged.as_ref().map_or(f64::INFINITY, |plan| plan.objective);
        self.other.as_ref().filter(|other| other.objective < FAR_CHEAPER * least)
    }

    /// The plan to keep; it records the cost of a cheaper plan that did not converge.
    fn choose(self, task: &Task) -> Result<Plan, Error> {
        let (Some(mut kept), other) = (self.converged, &self.other) else {
            let error = self.error.unwrap_or(Error::NotFinite { what: "the first guess" });
            return self.other.ok_or(error);
        };
        let limited = task.system.constraints().is_some();
        let much_less = |other: &&Plan| {
            let less = kept.objective - CHEAPER * (1.0 + kept.objective.abs());
            // A plan on the way to limits usually costs less than one that keeps them.
            let far_less = FAR_CHEAPER * kept.objective;
            other.objective < if limited { far_less.min(less) } else { less }
        };
        kept.passed_over = other.as_ref().filter(much_less).map(|other| other.objective);
        Ok(kept)
    }
}

/// Sizes of the random changes with which searches leave a saddle, relative to 1 plus the control.
const SHAKES: [f64; 2] = [1e-3, 1e-1];

/// How many random waves are tried where such changes lead back, or nowhere.
const WAVES: usize = 4;

/// Controls with random changes of a size, always the same.
fn shaken(controls: &Matrices, size: f64) -> Matrices {
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut shaken = controls.clone();
    for t in 0..shaken.count() {
        for entry in shaken.vector_mut(t) {
            *entry += size * (1.0 + entry.abs()) * (2.0 * uniform(&mut random) - 1.0);
        }
    }
    shaken
}

/// Share of the cost of a plan that has to keep limits below which one that may exceed them is reported.
const FAR_CHEAPER: f64 = 0.25;

/// Relative cost difference from which a cheaper plan that did not converge is reported.
const CHEAPER: f64 = 1e-3;

/// Costs closer than this, relatively, belong to one branch.
pub(crate) const SAME_BRANCH: f64 = 1e-7;

/// A number in [0, 1).
pub(crate) fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Controls with a random constant and a random half wave added to each: up to half of its range, or 1 if it has none.
pub(crate) fn waved(task: &Task, mut controls: Matrices, random: &mut ChaCha8Rng) -> Matrices {
    for a in 0..controls.cols() {
        let range = task.control_bounds.as_ref().map(|bounds| bounds.upper()[a] - bounds.lower()[a]);
        let size = range.filter(|range| range.is_finite()).map_or(1.0, |range| 0.5 * range);
        for waves in [0, 1] {
            add_wave(&mut controls, a, waves, size * (2.0 * uniform(random) - 1.0));
        }
    }
    controls
}
