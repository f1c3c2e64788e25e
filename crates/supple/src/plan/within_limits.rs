//! Nominal plans, which keep limits of quantities by the method of multipliers (theory, equations P.20 to P.22).

use supple_kernels::{Matrices, Scratch};
use supple_model::limits::LIMIT_TOLERANCE;
use supple_model::system::{Constraints, RollOut, System};

use super::augmented::{Augmented, excesses_beyond};
use super::held::GROWTH;
use super::nominal::search_free;
use super::search::{Asked, Patience, minimise};
use super::sweeps::{finish, set_curvature};
use super::{Held, NominalProblem, Plan, PlanSettings, PlanStatus, PlanWorkspace};
use crate::Error;

/// Maximum number of rounds.
const MOST_ROUNDS: usize = 60;
/// Stationarity to which the first round is solved, and the factor by which each round tightens it.
const FIRST_TOLERANCE: f64 = 1e-3;
const TIGHTER: f64 = 30.0;
/// The same for the first round from a plan that was held at the same limits.
const HELD_TOLERANCE: f64 = 1e-5;
/// Factors by which a round should reduce excesses, far from keeping limits and close to that (in tolerances), or else
/// penalties grow. Far away, stiff penalties cost more iterations than they save rounds.
const ENOUGH: f64 = 0.2;
const ENOUGH_CLOSE: f64 = 0.02;
const CLOSE: f64 = 1e7;
/// After so many rounds in a row that reduced excesses by less than half, limits cannot be kept from where the search is.
const MOST_STUCK: usize = 6;
/// Maximum number of penalty growths: beyond that, rounding hides the rest of the cost.
const MOST_GROWTHS: usize = 9;
/// The first step by which limits are narrowed, relative to how far a plan without them exceeds them; the factor from a step
/// that succeeded to the next; the shortest one; and how many growths of penalties are kept from step to step.
const FIRST_NARROWING: f64 = 0.5;
const LONGER_NARROWING: f64 = 1.5;
const LEAST_NARROWING: f64 = 1.0 / 64.0;
const MOST_GROWN: usize = 4;
/// Tolerance of plans within limits that are still to be narrowed.
const LOOSE: f64 = 1e-4;
/// Distance from a limit, relative to it, within which a guess counts as being at that limit.
const NEAR: f64 = 0.05;
/// The share of a limit's tolerance to which plans are solved.
const SHARE: f64 = 0.3;
/// Excesses up to this, in tolerances, change costs by no more than rounding: searches over designs compare them.
const SETTLED: f64 = 1e-2;
/// Number of rounding errors that stationarity may be off by, and the largest stationarity that they may leave.
const ROUNDINGS: f64 = 4.0;
const MOST_ROUNDING: f64 = 1e-10;

/// Finds the nominal plan of partially observed iLQG by line search and regularisation (theory, section P).
///
/// Starts from the first state and the controls in `plan.trajectory`, and leaves the whole plan in `plan`. Bounds are
/// left out of the search at first, unless the controls are within them and at some, as those of an earlier plan are.
/// Limits of the system that plans keep are kept. Allocates nothing once workspace and scratch have been used, but for
/// such limits.
///
/// # Errors
/// Where the first guess already leads to a cost or derivative that is not finite.
///
/// ```
/// use supple::Scratch;
/// use supple::plan::{Plan, PlanWorkspace, VALID_STATIONARITY, plan};
/// use supple::system::RollOut;
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
/// let size = task.system.dimensions();
/// let (mut found, mut work) = (Plan::zeros(size, task.steps), PlanWorkspace::new(size, task.steps));
/// let mut scratch = Scratch::new();
/// task.write_guess(&phi, None, &mut found.trajectory);
/// plan(task.nominal(&phi), &problem.planning, &mut found, &mut work, &mut scratch)?;
/// assert!(found.status.is_converged() && found.relative_stationarity <= VALID_STATIONARITY);
///
/// // Its controls, and its control law, lead along the same trajectory.
/// let mut again = found.trajectory.clone();
/// let cost = task.system.roll_out(RollOut::Controls, &phi, &mut again, &mut scratch);
/// assert!((cost - found.nominal_cost).abs() < 1e-9);
/// let law = RollOut::Law { reference: &found.trajectory, policy: &found.policy, step: 1.0, bounds: None };
/// let cost = task.system.roll_out(law, &phi, &mut again, &mut scratch);
/// assert!((cost - found.nominal_cost).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn plan(
    problem: NominalProblem,
    settings: &PlanSettings,
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    search(problem, Asked::of(settings, Patience::Full), plan, work, scratch)
}

/// Finds a nominal plan that keeps the limits of its system: first without them, then, if that plan does not keep
/// them, with the augmented Lagrangian round by round. Same as [`search_free`] if there are none to keep.
///
/// # Errors
/// As those of [`search_free`].
pub(crate) fn search(
    problem: NominalProblem,
    asked: Asked,
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    let Some(limits) = problem.system.constraints() else {
        return search_free(problem, asked, plan, work, scratch);
    };
    let bounds = limits.bounds(problem.phi);
    // Limits of an earlier plan wrote entries that the cost itself leaves 0.
    plan.knots.cost.clear();
    let guess = plan.trajectory.controls.clone();
    let mut before = 0;
    if let Some(held) = asked.held.filter(|held| held.fits(plan.trajectory.steps() + 1, bounds.len())) {
        let rounds = Rounds::of(problem, limits, bounds.clone());
        if rounds.stay(asked.settings, held, plan, work, scratch)? {
            return Ok(());
        }
        before = plan.iterations;
        plan.trajectory.controls.copy_from(&guess);
    }
    plan.multipliers = Matrices::vectors(plan.trajectory.steps() + 1, bounds.len());
    search_free(problem, asked, plan, work, scratch)?;
    plan.iterations += before;
    let begins_outside = begins_outside(problem, limits, &bounds, plan, scratch);
    // A plan that cannot keep its limits at first need not try to keep them later.
    if begins_outside {
        if plan.status != PlanStatus::TimeLimit {
            plan.status = PlanStatus::LimitsExceeded;
        }
        return Ok(());
    }
    let rounds = Rounds::from_free(problem, limits, bounds, plan, scratch);
    match asked.narrowed {
        true => rounds.narrow(asked.settings, plan, work, scratch),
        false => rounds.run(asked.settings, &guess, plan, work, scratch),
    }
}

/// Whether the first state, which no plan can change, exceeds a limit.
fn begins_outside(
    problem: NominalProblem,
    limits: &dyn Constraints,
    bounds: &[f64],
    plan: &Plan,
    scratch: &mut Scratch,
) -> bool {
    let excesses = limits.excesses_of_first(plan.trajectory.points(), problem.phi, scratch);
    excesses.iter().zip(bounds).any(|(excess, bound)| *excess > LIMIT_TOLERANCE * (1.0 + bound.abs()))
}

/// The search's state between rounds.
struct Rounds<'a> {
    problem: NominalProblem<'a>,
    limits: &'a dyn Constraints,
    bounds: Vec<f64>,
    /// The cost of the plan without limits, where the rounds start from it.
    cost: f64,
    /// How far beyond each end a number may be.
    tolerances: Vec<f64>,
    penalties: Vec<f64>,
    /// How far limits are widened for now; empty for not at all.
    widened: Vec<f64>,
    /// How often penalties grew.
    growths: usize,
    /// Iterations so far.
    iterations: usize,
    regularised: usize,
}

impl<'a> Rounds<'a> {
    /// Rounds without penalties.
    fn of(problem: NominalProblem<'a>, limits: &'a dyn Constraints, bounds: Vec<f64>) -> Self {
        let tolerances = bounds.iter().map(|bound| SHARE * LIMIT_TOLERANCE * (1.0 + bound.abs())).collect();
        let (penalties, widened, growths) = (Vec::new(), Vec::new(), 0);
        let (iterations, regularised) = (0, 0);
        Self { problem, limits, bounds, cost: 0.0, tolerances, penalties, widened, growths, iterations, regularised }
    }

    /// Rounds that start from a plan without limits.
    fn from_free(
        problem: NominalProblem<'a>,
        limits: &'a dyn Constraints,
        bounds: Vec<f64>,
        plan: &Plan,
        scratch: &mut Scratch,
    ) -> Self {
        let mut rounds = Self::of(problem, limits, bounds);
        rounds.cost = plan.nominal_cost.abs().max(f64::MIN_POSITIVE.sqrt());
        rounds.penalties = rounds.first_penalties(plan, scratch);
        (rounds.iterations, rounds.regularised) = (plan.iterations, plan.regularised);
        rounds
    }

    /// Continues the rounds of another plan, from the controls in `plan`; returns whether limits are kept. A plan that is
    /// held there changes little from one problem to the next, and is far from one without limits.
    fn stay(
        mut self,
        settings: &PlanSettings,
        held: &Held,
        plan: &mut Plan,
        work: &mut PlanWorkspace,
        scratch: &mut Scratch,
    ) -> Result<bool, Error> {
        if let Some(bounds) = self.problem.bounds {
            bounds.clamp_all(&mut plan.trajectory.controls);
        }
        let cost = self.problem.system.roll_out(RollOut::Controls, self.problem.phi, &mut plan.trajectory, scratch);
        if !cost.is_finite() {
            plan.iterations = 0;
            return Ok(false);
        }
        plan.multipliers = held.multipliers.clone();
        (self.penalties, self.growths) = (held.penalties.clone(), held.growths);
        let missed = self.missed(plan, scratch);
        let asked = Asked::of(settings, Patience::CloseOrNever);
        let status = self.rounds(asked, missed, HELD_TOLERANCE, plan, work, scratch);
        plan.iterations = self.iterations;
        let ends = status == PlanStatus::TimeLimit || status.is_converged() && self.is_kept(plan, scratch);
        if ends {
            self.finish(plan, settings, status, scratch)?;
        }
        Ok(ends)
    }

    /// Penalties under which each end's excess along the trajectory, or a tenth of its bound, costs twice what the plan
    /// without limits does.
    fn first_penalties(&self, plan: &Plan, scratch: &mut Scratch) -> Vec<f64> {
        let excesses = self.excesses(plan, scratch);
        let of_end = |(end, bound): (usize, &f64)| {
            let beyond = |t: usize| excesses.vector(t)[end].max(0.0).powi(2);
            let size = (0..excesses.count()).map(beyond).sum::<f64>().max((0.1 * bound).powi(2));
            2.0 * self.cost / if size > 0.0 { size } else { 1.0 }
        };
        self.bounds.iter().enumerate().map(of_end).collect()
    }

    fn excesses(&self, plan: &Plan, scratch: &mut Scratch) -> Matrices {
        let at = plan.trajectory.points();
        excesses_beyond(self.limits, &self.widened, at, self.problem.phi, self.bounds.len(), scratch)
    }

    /// How far the plan is from meeting its limits, and its multipliers from being 0 where limits are inactive, in
    /// tolerances.
    fn missed(&self, plan: &Plan, scratch: &mut Scratch) -> f64 {
        let excesses = self.excesses(plan, scratch);
        let mut most: f64 = 0.0;
        for t in 0..excesses.count() {
            let parts = self.tolerances.iter().zip(&self.penalties);
            let ends = excesses.vector(t).iter().zip(plan.multipliers.vector(t)).zip(parts);
            for ((&excess, &multiplier), (&tolerance, &rho)) in ends {
                most = most.max(excess.max(-multiplier / rho).abs() / tolerance);
            }
        }
        most
    }

    fn run(
        mut self,
        settings: &PlanSettings,
        guess: &Matrices,
        plan: &mut Plan,
        work: &mut PlanWorkspace,
        scratch: &mut Scratch,
    ) -> Result<(), Error> {
        let missed = self.missed(plan, scratch);
        if missed <= 1.0 {
            return Ok(());
        }
        let exceeds = |excess: f64, bound: f64| excess > NEAR * bound.abs();
        let (free, by_little) = (plan.trajectory.controls.clone(), !self.is_any(plan, scratch, exceeds));
        let from_guess = !by_little && self.start_from_better(guess, plan, scratch);
        let asked = Asked::of(settings, Patience::Close);
        let mut status = self.rounds(asked, missed, FIRST_TOLERANCE, plan, work, scratch);
        let is_last = matches!(status, PlanStatus::TimeLimit | PlanStatus::MaxIterations)
            || status.is_converged() && self.is_kept(plan, scratch);
        if !is_last && (from_guess || by_little) {
            // Retry from the other starting point, if there is one.
            let ended = (plan.trajectory.controls.clone(), plan.multipliers.clone());
            let stiffness = (self.penalties.clone(), self.growths);
            plan.trajectory.controls = free;
            plan.nominal_cost =
                self.problem.system.roll_out(RollOut::Controls, self.problem.phi, &mut plan.trajectory, scratch);
            plan.multipliers.as_mut_slice().fill(0.0);
            self.penalties = self.first_penalties(plan, scratch);
            self.growths = 0;
            if from_guess || self.start_from_better(guess, plan, scratch) {
                status = self.rounds(asked, missed, FIRST_TOLERANCE, plan, work, scratch);
            } else {
                (plan.trajectory.controls, plan.multipliers) = ended;
                (self.penalties, self.growths) = stiffness;
            }
        }
        self.finish(plan, settings, status, scratch)
    }

    /// Rounds from the plan without limits, within limits that begin where it is, and are narrowed to the given ones step by
    /// step: less far where they could not be kept.
    fn narrow(
        mut self,
        settings: &PlanSettings,
        plan: &mut Plan,
        work: &mut PlanWorkspace,
        scratch: &mut Scratch,
    ) -> Result<(), Error> {
        let excesses = self.excesses(plan, scratch);
        let most = |end| (0..excesses.count()).map(|t| excesses.vector(t)[end]).fold(0.0, f64::max);
        let widest: Vec<f64> = (0..self.bounds.len()).map(most).collect();
        let loose = settings.to_tolerance(settings.tolerance.max(LOOSE));
        let free = self.iterations;
        let mut status = PlanStatus::LimitsExceeded;
        let (mut share, mut step) = (1.0, FIRST_NARROWING);
        while share > 0.0 && step >= LEAST_NARROWING {
            let controls = plan.trajectory.controls.clone();
            let (multipliers, penalties, growths) = (plan.multipliers.clone(), self.penalties.clone(), self.growths);
            let next: f64 = if step < share { share - step } else { 0.0 };
            self.widened = widest.iter().map(|widest| next * widest).collect();
            let settings = if next > 0.0 { &loose } else { settings };
            let missed = self.missed(plan, scratch);
            let asked = Asked::of(settings, Patience::Close);
            status = self.rounds(asked, missed, FIRST_TOLERANCE, plan, work, scratch);
            let is_late = status == PlanStatus::TimeLimit || self.iterations - free > settings.max_iterations;
            if status.is_converged() && self.is_kept(plan, scratch) {
                (share, step) = (next, step * LONGER_NARROWING);
                self.soften(MOST_GROWN);
            } else if !is_late {
                step *= 0.5;
                plan.trajectory.controls = controls;
                (plan.multipliers, self.penalties, self.growths) = (multipliers, penalties, growths);
                self.problem.system.roll_out(RollOut::Controls, self.problem.phi, &mut plan.trajectory, scratch);
            }
            if is_late {
                break;
            }
        }
        self.widened.clear();
        let status = if share > 0.0 && status.is_converged() { PlanStatus::LimitsExceeded } else { status };
        self.finish(plan, settings, status, scratch)
    }

    /// Takes back all but so many growths of the penalties.
    fn soften(&mut self, growths: usize) {
        while self.growths > growths {
            self.growths -= 1;
            self.penalties.iter_mut().for_each(|rho| *rho /= GROWTH);
        }
    }

    /// Rounds until limits are kept and the plan is stationary, or what ended them, given by how much they were missed before.
    fn rounds(
        &mut self,
        asked: Asked,
        mut missed: f64,
        mut tolerance: f64,
        plan: &mut Plan,
        work: &mut PlanWorkspace,
        scratch: &mut Scratch,
    ) -> PlanStatus {
        let Asked { settings, patience, .. } = asked;
        let mut stuck = 0;
        let mut status = PlanStatus::LimitsExceeded;
        for _ in 0..MOST_ROUNDS {
            // Once limits are met, only the final tolerance remains.
            let last = settings.tolerance.max(self.rounding(plan));
            tolerance = if missed <= 1.0 { last } else { (tolerance / TIGHTER).max(last) };
            let tighter = settings.to_tolerance(tolerance);
            status = self.round(Asked { settings: &tighter, ..asked }, missed, plan, work, scratch);
            let is_lost = patience == Patience::CloseOrNever && !status.is_converged();
            if is_lost || matches!(status, PlanStatus::TimeLimit | PlanStatus::MaxIterations) {
                break;
            }
            let left = self.missed(plan, scratch);
            let is_final = tolerance <= last || left <= SETTLED && plan.relative_stationarity <= last;
            if left <= 1.0 && is_final {
                break;
            }
            stuck = if left > 1.0 && left > 0.5 * missed { stuck + 1 } else { 0 };
            let enough = if missed < CLOSE { ENOUGH_CLOSE } else { ENOUGH };
            if left > 1.0 && left > enough * missed {
                if self.growths == MOST_GROWTHS || stuck == MOST_STUCK {
                    break;
                }
                self.growths += 1;
                self.penalties.iter_mut().for_each(|rho| *rho *= GROWTH);
            }
            missed = left;
        }
        status
    }

    /// The stationarity that the rounding of excesses leaves, as penalties multiply it: relative to the largest multiplier.
    fn rounding(&self, plan: &Plan) -> f64 {
        let largest = plan.multipliers.as_slice().iter().copied().fold(0.0, f64::max);
        let errors = self.penalties.iter().zip(&self.bounds).map(|(rho, bound)| rho * bound.abs() * f64::EPSILON);
        let error = errors.fold(0.0, f64::max) / largest;
        if error.is_finite() { (ROUNDINGS * error).min(MOST_ROUNDING) } else { 0.0 }
    }

    /// Whether the limits are met within their tolerances.
    fn is_kept(&self, plan: &Plan, scratch: &mut Scratch) -> bool {
        self.missed(plan, scratch) <= 1.0 / SHARE
    }

    /// Starts from the guess where it is at a limit and its augmented Lagrangian is less than that of the plan without
    /// limits, as it is for plans of problems that differ little; then with penalties that keep it where it is. Returns
    /// whether it does.
    fn start_from_better(&mut self, guess: &Matrices, plan: &mut Plan, scratch: &mut Scratch) -> bool {
        let system = self.augmented(&plan.multipliers);
        let free = plan.nominal_cost + system.penalties_of(&plan.trajectory, self.problem.phi, scratch);
        let found = plan.trajectory.controls.clone();
        plan.trajectory.controls.copy_from(guess);
        if let Some(bounds) = self.problem.bounds {
            bounds.clamp_all(&mut plan.trajectory.controls);
        }
        let given = system.roll_out(RollOut::Controls, self.problem.phi, &mut plan.trajectory, scratch);
        let is_better = !given.is_nan() && given < free && self.is_near_limits(plan, scratch);
        if is_better {
            self.penalties = self.first_penalties(plan, scratch);
        } else {
            plan.trajectory.controls = found;
        }
        is_better
    }

    /// Whether any number along a trajectory is near an end of its limits, or beyond it.
    fn is_near_limits(&self, plan: &Plan, scratch: &mut Scratch) -> bool {
        self.is_any(plan, scratch, |excess, bound| excess >= -NEAR * bound.abs())
    }

    /// Whether any excess along a trajectory is such, given the bound.
    fn is_any(&self, plan: &Plan, scratch: &mut Scratch, such: impl Fn(f64, f64) -> bool) -> bool {
        let excesses = self.excesses(plan, scratch);
        (0..excesses.count())
            .any(|t| excesses.vector(t).iter().zip(&self.bounds).any(|(&excess, &bound)| such(excess, bound)))
    }

    fn augmented<'b>(&'b self, multipliers: &'b Matrices) -> Augmented<'b> {
        Augmented {
            system: self.problem.system,
            limits: self.limits,
            multipliers,
            penalties: Some(&self.penalties),
            widened: &self.widened,
        }
    }

    /// One round, given how much limits are missed before: minimises the augmented Lagrangian, and takes its slopes as the
    /// multipliers.
    fn round(
        &mut self,
        asked: Asked,
        missed: f64,
        plan: &mut Plan,
        work: &mut PlanWorkspace,
        scratch: &mut Scratch,
    ) -> PlanStatus {
        let multipliers = plan.multipliers.clone();
        let system = self.augmented(&multipliers);
        let problem = NominalProblem { system: &system, ..self.problem };
        let phi = problem.phi;
        plan.nominal_cost = system.roll_out(RollOut::Controls, phi, &mut plan.trajectory, scratch);
        (plan.iterations, plan.regularised) = (0, 0);
        let status = minimise(problem, asked, plan, work, scratch);
        // A plan that stays as it is keeps its multipliers to the last bit.
        plan.multipliers = match plan.iterations {
            0 if missed <= 1.0 => multipliers,
            _ => system.slopes(plan.trajectory.points(), phi, scratch),
        };
        self.iterations += plan.iterations;
        self.regularised += plan.regularised;
        status
    }

    /// The final sweep, of the cost with the multipliers' slopes and the cost's own curvature.
    fn finish(
        self,
        plan: &mut Plan,
        settings: &PlanSettings,
        status: PlanStatus,
        scratch: &mut Scratch,
    ) -> Result<(), Error> {
        let Self { problem, limits, .. } = self;
        let kept = self.is_kept(plan, scratch);
        plan.nominal_cost = problem.system.roll_out(RollOut::Controls, problem.phi, &mut plan.trajectory, scratch);
        (plan.iterations, plan.regularised) = (self.iterations, self.regularised);
        plan.passed_over = None;
        let multipliers = std::mem::replace(&mut plan.multipliers, Matrices::vectors(0, 0));
        let system =
            Augmented { system: problem.system, limits, multipliers: &multipliers, penalties: None, widened: &[] };
        let status = if status.is_converged() && !kept { PlanStatus::LimitsExceeded } else { status };
        let finished =
            finish(NominalProblem { system: &system, ..problem }, settings.curvature, plan, status, scratch).map(drop);
        // The knots are those of the cost itself.
        set_curvature(problem, plan.curvature, plan, scratch);
        plan.multipliers = multipliers;
        (plan.penalties, plan.growths) = (self.penalties, self.growths);
        finished
    }
}
