use std::fmt::Write;

use supple_kernels::{Matrices, Scratch};
use supple_model::Trajectory;
use supple_model::limits::LIMIT_TOLERANCE;
use supple_model::system::{KeptEnd, holding_controls};
use supple_text::{count, digits, short};

use crate::pipeline::TaskState;
use crate::plan::{Plan, PlanStatus};
use crate::problem::{Task, TaskAt};
use crate::simulate::MonteCarlo;

/// Up to this relative stationarity a plan counts as stationary.
const LEVEL: f64 = 1e-6;
/// A state that moves by no more than this in a step, relative to it, stays.
const HELD: f64 = 1e-9;

/// Why a plan should not be trusted, in words: if it did not converge, how its search ended, with the step and the
/// control where the cost still falls and the state that moves fastest; and whether a cheaper plan was passed over.
///
/// ```
/// use supple::pipeline::TaskState;
/// use supple::settings::PlanSettings;
/// use supple::{number_warnings, plan_warnings};
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
/// let problem = supple_file::load(file)?;
/// let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
/// let mut state = TaskState::new(task);
/// state.evaluate(task, &phi, &PlanSettings { max_iterations: 1, ..problem.planning.clone() }, None)?;
/// assert_eq!(plan_warnings(task, &phi, &state.plan).len(), 1, "it did not converge");
/// assert!(number_warnings(task, &state, None).is_empty(), "its numbers are finite");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn plan_warnings(task: &Task, phi: &[f64], plan: &Plan) -> Vec<String> {
    let mut warnings = Vec::new();
    if !plan.status.is_converged() {
        let exceeded = (plan.status == PlanStatus::LimitsExceeded).then(|| exceeded(task, phi, plan)).flatten();
        let mut warning = exceeded.unwrap_or_else(|| unconverged(task, phi, plan));
        if let Some(why) = beyond_at_rest(task, phi) {
            let _ = write!(warning, "; {why}");
        }
        warnings.push(warning);
    }
    if let Some(cost) = plan.passed_over {
        warnings.push(format!(
            "task `{}`: a plan of cost {} did not converge, or exceeds limits, and was discarded; the plan in use costs {}. Raise \
             `planning.max_iterations`, or start from another `initial_control`",
            task.name,
            short(cost, 8),
            short(plan.objective, 8)
        ));
    }
    warnings.extend(cut_off(task, plan));
    warnings
}

/// Share of the steps from which a control that lies at its bound is worth a warning.
const MANY: f64 = 0.05;

/// That the feedback of a control is cut off on one side at many steps: it lies at a bound that the plan does not press against,
/// so that its law counts as free.
fn cut_off(task: &Task, plan: &Plan) -> Option<String> {
    let bounds = task.control_bounds.as_ref()?;
    let names = task.system.channels().controls;
    let (controls, policy) = (&plan.trajectory.controls, &plan.policy);
    let lies_there = |t: usize, a: usize| {
        let u = controls.vector(t)[a];
        let has_feedback = (0..policy.feedback.cols()).any(|i| policy.feedback.get(t, a, i) != 0.0);
        let is_free = has_feedback && !policy.clamped[t * names.len() + a];
        is_free && (u == bounds.lower()[a] || u == bounds.upper()[a])
    };
    let steps = |a: usize| (0..task.steps).filter(|&t| lies_there(t, a)).count();
    let (most, control) = (0..names.len()).map(|a| (steps(a), a)).max()?;
    (most as f64 > MANY * task.steps as f64).then(|| {
        format!(
            "task `{}`: the planned `{}` lies at its bound at {} of {}, and the plan does not press against it: feedback beyond \
             the bound is cut off, but information and cost of noise are those without the bound. Only roll-outs tell what it does",
            task.name,
            names[control].name,
            most,
            count(task.steps, "step"),
        )
    })
}

/// That a measurement has no derivative, but different values along the plan: it jumps, so that it counts for nothing.
pub(super) fn jump_warning(TaskAt { task, phi }: TaskAt, state: &TaskState) -> Option<String> {
    // A model that knows of jumps has said so.
    if !task.doubtful_derivatives.is_empty() {
        return None;
    }
    let (measurement, states) = (&state.plan.knots.measurement, &state.plan.trajectory.states);
    let is_flat = |row: &usize| {
        (0..measurement.count()).all(|t| (0..measurement.cols()).all(|column| measurement.get(t, *row, column) == 0.0))
    };
    let flat: Vec<usize> = (0..measurement.rows()).filter(is_flat).collect();
    let read = |t: usize| {
        let mut values = vec![0.0; measurement.rows()];
        // As in the first step, so that offsets that change with time do not count.
        task.system.observe(0, states.vector(t), phi, &mut values);
        values
    };
    let first = if flat.is_empty() { return None } else { read(0) };
    let row = flat.into_iter().find(|&row| (1..states.count()).any(|t| read(t)[row] != first[row]))?;
    let names = task.system.channels().measurements;
    let name = names.get(row).map_or_else(|| format!("{}", row + 1), |channel| channel.name.clone());
    Some(format!(
        "task `{}`: measurement `{name}` has the derivative 0 along the whole plan, although its value changes: it jumps, as rounded \
         readings do, and counts for nothing. Replace rounding by noise, with a variance of a twelfth of the squared resolution",
        task.name
    ))
}

/// That another local minimum was found which costs less.
pub(super) fn cheaper_warning(task: &Task, found: f64, cost: f64) -> String {
    format!(
        "task `{}`: another plan costs {}, less than this one's {}. Look for the cheapest with more `branches`, or start from another \
         `initial_control`",
        task.name,
        short(found, 6),
        short(cost, 6),
    )
}

/// Why the numbers of a task are unusable: information or a part of the expected cost is not finite, or roll-outs
/// diverged.
///
/// Example: [`plan_warnings`].
#[must_use]
pub fn number_warnings(task: &Task, state: &TaskState, sampled: Option<&MonteCarlo>) -> Vec<String> {
    let cost = &state.cost;
    let numbers = [
        ("information", state.information.total),
        ("nominal cost", cost.nominal),
        ("cost of estimation error", cost.belief),
        ("cost of process noise", cost.process),
        ("cost of initial uncertainty", cost.initial),
        ("expected cost", cost.expected()),
    ];
    let broken = numbers.into_iter().find(|(_, value)| !value.is_finite());
    let lowered = state.lowered().map(|part| {
        format!(
            "task `{}`: noise would lower the cost, by {}: the cost is not convex along the plan, so expected cost \
             and information are not valid. Use `curvature = \"gauss_newton\"` in [planning], relax the active limits of the plan, \
             or reduce the costs that act against them",
            task.name,
            short(part, 3)
        )
    });
    let mut warnings: Vec<String> = broken
        .map(|(what, value)| {
            format!(
                "task `{}`: the {what} is {value}, so the results are not valid. Look for variances, weights or feedback \
                 gains that overflow",
                task.name
            )
        })
        .into_iter()
        .chain(lowered)
        .collect();
    if let Some(sampled) = sampled.filter(|sampled| sampled.diverged > 0) {
        warnings.push(format!(
            "task `{}`: {} of {} roll-outs diverged, so the sampled cost is infinite: with this noise the controller does not track the plan. Reduce the noise or the time step",
            task.name, sampled.diverged, sampled.rollouts
        ));
    }
    warnings
}

/// Which enforced limit a plan exceeds the most, relative to the limit, or the first state, which no plan can change; `None` if
/// it exceeds none.
fn exceeded(task: &Task, phi: &[f64], plan: &Plan) -> Option<String> {
    let limits = task.system.constraints()?;
    let (at, bounds) = (plan.trajectory.points(), limits.bounds(phi));
    let mut excesses = Matrices::vectors(at.count(), bounds.len());
    limits.excesses(at, phi, &mut excesses, &mut Scratch::default());
    let size = |end: usize| 1.0 + bounds[end].abs();
    let all =
        (0..at.count()).flat_map(|step| excesses.vector(step).iter().copied().enumerate().map(move |it| (step, it)));
    let is_given = |step: usize, end: usize| step == 0 && !limits.of_control()[end];
    let beyond = |(step, (end, excess)): &(usize, (usize, f64))| (is_given(*step, *end), excess / size(*end));
    let (step, (end, excess)) = all.filter(|(_, (_, excess))| *excess > 0.0).max_by(|one, other| {
        let ((given, size), (other_given, other_size)) = (beyond(one), beyond(other));
        given.cmp(&other_given).then(size.total_cmp(&other_size))
    })?;
    let KeptEnd { channel, upper } = limits.ends().swap_remove(end);
    let (side, which) = if upper { ("above", "upper") } else { ("below", "lower") };
    let given = if is_given(step, end) { ": the initial state exceeds it" } else { "" };
    Some(format!(
        "task `{}`: the plan exceeds an enforced limit ({}): at step {step} ({:.4} s) `{}` is {} {} {side} its {which} \
         limit, {}{given}",
        task.name,
        count(plan.iterations, "iteration"),
        step as f64 * task.time_step.resolve::<f64>(phi),
        channel.name,
        short(excess, 6),
        channel.unit,
        digits(bounds[end]),
    ))
}

/// The enforced limit that is exceeded the most, relative to it, by what holds the first state; `None` if that exceeds none.
fn beyond_at_rest(task: &Task, phi: &[f64]) -> Option<String> {
    let limits = task.system.constraints()?;
    let (mut first, x) = (Trajectory::zeros(task.system.dimensions(), 1), task.first_state(phi));
    [0, 1].into_iter().for_each(|t| first.states.vector_mut(t).copy_from_slice(&x));
    first.controls.vector_mut(0).copy_from_slice(&holding_controls(&*task.system, &x, phi));
    let mut next = vec![0.0; x.len()];
    task.system.step(0, &x, first.controls.vector(0), phi, &mut next);
    // With fewer drives than joints, nothing may hold it.
    let is_held = |(next, x): (&f64, &f64)| (next - x).abs() <= HELD * (1.0 + x.abs());
    if !next.iter().zip(&x).all(is_held) {
        return None;
    }
    let bounds = limits.bounds(phi);
    let mut excesses = Matrices::vectors(2, bounds.len());
    limits.excesses(first.points(), phi, &mut excesses, &mut Scratch::default());
    let share = |end: &usize| excesses.vector(0)[*end] / (1.0 + bounds[*end].abs());
    let beyond = (0..bounds.len()).filter(|end| limits.of_control()[*end] && share(end) > LIMIT_TOLERANCE);
    let end = beyond.max_by(|one, other| share(one).total_cmp(&share(other)))?;
    let KeptEnd { channel, upper } = limits.ends().swap_remove(end);
    let excess = excesses.vector(0)[end];
    Some(format!(
        "holding the initial state takes {} {} of `{}`, whose enforced limit is {}",
        short(if upper { bounds[end] + excess } else { bounds[end] - excess }, 4),
        channel.unit,
        channel.name,
        digits(bounds[end]),
    ))
}

fn unconverged(task: &Task, phi: &[f64], plan: &Plan) -> String {
    let time_step: f64 = task.time_step.resolve(phi);
    let when = |step: usize| format!("step {step} ({:.4} s)", step as f64 * time_step);
    let channels = task.system.channels();
    let name = |list: &[supple_model::Channel], index: usize, what: &str| {
        list.get(index).map_or_else(|| format!("{what} {}", index + 1), |channel| channel.name.clone())
    };
    let unit = |index: usize| channels.states.get(index).map_or("", |channel| channel.unit.as_str());
    if plan.status == PlanStatus::Indefinite && plan.relative_stationarity <= LEVEL {
        return format!(
            "task `{}`: the plan is stationary ({} iterations), but no strict minimum: the second derivative of the cost in the \
             controls, R + B'SB of the control law, is not positive definite, so that the cost does not determine every \
             control. Give every control a weight, or leave out controls that do the same as others, or nothing",
            task.name, plan.iterations
        );
    }
    let (step, control) = plan.steepest;
    let mut text = format!(
        "task `{}`: the plan did not converge ({}, {}): at {} the cost still changes by {} per unit of `{}`",
        task.name,
        plan.status,
        count(plan.iterations, "iteration"),
        when(step),
        short(plan.stationarity, 4),
        name(&channels.controls, control, "control"),
    );
    if let Some((step, state, change)) = fastest(plan) {
        let rate = change / time_step;
        text += &format!(
            "; the state that changes fastest is `{}`, by {} {}/s at {}",
            name(&channels.states, state, "state"),
            short(rate, 6),
            unit(state),
            when(step)
        );
    }
    text
}

/// The step and the state of the largest change from one step to the next, relative to how large that state becomes.
fn fastest(plan: &Plan) -> Option<(usize, usize, f64)> {
    let states = &plan.trajectory.states;
    let mut largest: Option<(f64, (usize, usize, f64))> = None;
    for state in 0..states.cols() {
        let at = |t: usize| states.vector(t)[state];
        let size = (0..states.count()).fold(0.0, |size: f64, t| size.max(at(t).abs()));
        for t in 0..plan.trajectory.steps() {
            let change = at(t + 1) - at(t);
            let share = change.abs() / (1.0 + size);
            if largest.is_none_or(|(most, _)| share > most) {
                largest = Some((share, (t, state, change)));
            }
        }
    }
    largest.map(|(_, found)| found)
}
