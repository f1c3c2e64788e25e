//! The objective of a design: the information needed, used and measured, and its gradient.

use supple_kernels::Matrices;
use supple_lqg::bound::{Horizon, Needed};
use supple_lqg::{Belief, Partials, add_control_partials};
use supple_model::{ParameterHandle, Value};

use crate::Error;
use crate::gradient::Functional;
use crate::horizon::horizon_of_plan;
use crate::pipeline::TaskState;
use crate::plan::Plan;
use crate::problem::{Task, TaskAt};
use crate::settings::InformationWeights;

/// Nats by which rounding may change the information used as all covariances grow by their own size, which does not change it.
const MOST_ROUNDING: f64 = 1e-3;

/// Smallest budget for needed information, as a share of the plan's estimation-error cost; used if the limit leaves less.
const LEAST_SHARE: f64 = 0.05;

/// An upper limit on an expected cost.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Limit {
    pub value: f64,
    /// Its derivative with respect to each parameter it depends on.
    pub slopes: Vec<(ParameterHandle, f64)>,
}

impl Limit {
    /// A task's bound times a factor.
    pub fn of(bound: &Value, factor: f64, phi: &[f64]) -> Self {
        let slopes = bound.slopes(phi).into_iter().map(|(parameter, slope)| (parameter, factor * slope)).collect();
        Self { value: factor * bound.resolve::<f64>(phi), slopes }
    }
}

/// Cost budget for estimation errors when computing the needed information: `D - J*`.
enum Budget {
    /// What remains below the cost limit.
    Limited,
    /// A share of the plan's own estimation-error cost.
    Share(f64),
}

/// Weighted information of an evaluated plan, in nats, and its total gradient with respect to all parameters. The needed
/// part is computed at the task's bound or, if it has none, at the plan's own expected cost (theory, section L, in designs).
///
/// # Errors
/// If the minimum was not found, or the plan is not a strict local optimum.
///
/// ```
/// use supple::aims::weighted_information;
/// use supple::pipeline::TaskState;
/// use supple::settings::InformationWeights;
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
/// state.evaluate(task, &phi, &problem.planning, None)?;
/// let mut gradient = Vec::new();
/// let nats = weighted_information(task, &phi, InformationWeights::MEASURED, &mut state, &mut gradient)?;
/// assert!((nats - state.information.total).abs() < 1e-9 && gradient[0] < 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn weighted_information(
    task: &Task,
    phi: &[f64],
    weights: InformationWeights,
    state: &mut TaskState,
    out: &mut Vec<f64>,
) -> Result<f64, Error> {
    let limit = task.bound.as_ref().map(|bound| Limit::of(bound, 1.0, phi));
    information_within(task.at(phi), weights, limit.as_ref(), state, out).map(|(nats, _)| nats)
}

/// Like [`weighted_information`], but with the given limit, and with the derivative by that limit.
///
/// # Errors
/// Same as for [`weighted_information`].
pub(crate) fn information_within(
    TaskAt { task, phi }: TaskAt,
    weights: InformationWeights,
    limit: Option<&Limit>,
    state: &mut TaskState,
    out: &mut Vec<f64>,
) -> Result<(f64, f64), Error> {
    let InformationWeights { needed, used, measured } = weights;
    let mut functional = Functional { information: measured, ..Functional::default() };
    let mut sum = if measured == 0.0 { 0.0 } else { measured * state.information.total };
    if needed == 0.0 && used == 0.0 {
        state.total_gradient(task, phi, functional, out)?;
        return Ok((sum, 0.0));
    }
    let mut partials = Partials::zeros(state.plan.knots.dimensions, task.steps);
    let (mut nominal, mut by_limit) = (0.0, 0.0);
    if used != 0.0 {
        let Plan { knots, policy, .. } = &state.plan;
        sum += used * add_control_partials(knots, policy, &state.belief, &state.noise, used, &mut partials)?;
        let Belief { predicted, corrected, .. } = &state.belief;
        let by = (partials.along_covariances(predicted, corrected, &state.noise) / used).abs();
        if by.is_nan() || by > MOST_ROUNDING {
            return Err(Error::Rounded { by });
        }
    }
    if needed != 0.0 {
        let (found, budget) = needed_information(limit, state)?;
        sum += needed * found.nats;
        if let Some(of) = &found.sensitivity {
            add_horizon(&mut partials, [&of.dynamics, &of.process, &of.initial, &of.prices], needed);
            match budget {
                Budget::Limited => {
                    by_limit = needed * of.cost;
                    // The derivative with respect to the least cost is minus the one with respect to the limit.
                    (nominal, functional.process, functional.initial) = (-by_limit, -by_limit, -by_limit);
                }
                Budget::Share(share) => functional.belief = needed * of.cost * share,
            }
        }
    }
    functional.partials = Some(&partials);
    state.total_gradient(task, phi, functional, out)?;
    if nominal != 0.0 {
        let mut by_nominal = Vec::new();
        state.nominal_gradient(task, phi, &mut by_nominal)?;
        out.iter_mut().zip(&by_nominal).for_each(|(sum, slope)| *sum += nominal * slope);
    }
    for &(parameter, slope) in limit.into_iter().flat_map(|limit| &limit.slopes) {
        out[parameter] += by_limit * slope;
    }
    Ok((sum, by_limit))
}

/// A task when nothing is ever measured.
#[derive(Clone, Debug)]
pub(crate) struct Unmeasured {
    /// Its expected cost. If that is within the limit, no information is needed.
    pub cost: f64,
    /// The total gradient of the cost with respect to all parameters.
    pub gradient: Vec<f64>,
}

/// Share of the budget for estimation errors, below that at which nothing is needed, at which the slope of needed
/// information is computed.
const BELOW: f64 = 1e-4;

/// A task when nothing is ever measured, about its plan.
///
/// # Errors
/// If no least-cost control law exists along the plan, or the plan is not a strict local optimum.
pub(crate) fn without_measurements(TaskAt { task, phi }: TaskAt, state: &mut TaskState) -> Result<Unmeasured, Error> {
    let found = horizon_of_plan(&state.plan, &state.noise)?.unmeasured();
    let mut partials = Partials::zeros(state.plan.knots.dimensions, task.steps);
    add_horizon(&mut partials, [&found.dynamics, &found.process, &found.initial, &found.prices], 1.0);
    let functional = Functional { process: 1.0, initial: 1.0, partials: Some(&partials), ..Functional::default() };
    let (mut gradient, mut by_nominal) = (Vec::new(), Vec::new());
    state.total_gradient(task, phi, functional, &mut gradient)?;
    state.nominal_gradient(task, phi, &mut by_nominal)?;
    gradient.iter_mut().zip(&by_nominal).for_each(|(sum, slope)| *sum += slope);
    Ok(Unmeasured { cost: found.cost, gradient })
}

/// The information needed per unit by which the limit is below the cost without measurements, nats, as the limit approaches
/// that cost.
///
/// # Errors
/// If no least-cost control law exists along the plan, or the minimum was not found.
pub(crate) fn first_price(cost_without: f64, state: &mut TaskState) -> Result<f64, Error> {
    let budget = cost_without - (state.cost.expected() - state.cost.belief);
    Ok(needed_beyond((1.0 - BELOW) * budget, state)?.sensitivity.map_or(0.0, |of| -of.cost))
}

/// The minimum information at the limit or, without a limit, at the plan's own expected cost.
fn needed_information(limit: Option<&Limit>, state: &mut TaskState) -> Result<(Needed, Budget), Error> {
    let own = state.cost.belief;
    let limited = limit.map(|limit| limit.value - (state.cost.expected() - own));
    let (asked, budget) = match limited {
        Some(left) if left >= LEAST_SHARE * own => (left, Budget::Limited),
        Some(_) => (LEAST_SHARE * own, Budget::Share(LEAST_SHARE)),
        None => (own, Budget::Share(1.0)),
    };
    Ok((needed_beyond(asked, state)?, budget))
}

/// The minimum information at an expected cost of `budget` above the least possible.
///
/// # Errors
/// If no least-cost control law exists along the plan, or the minimum was not found.
fn needed_beyond(budget: f64, state: &mut TaskState) -> Result<Needed, Error> {
    Ok(Needed::of(&horizon_of(state)?, budget, &mut state.nearby)?)
}

/// The horizon of a plan, with costs counted relative to the least cost.
fn horizon_of(state: &TaskState) -> Result<Horizon, Error> {
    Ok(Horizon { base_cost: 0.0, ..horizon_of_plan(&state.plan, &state.noise)? })
}

/// Adds derivatives with respect to the components of a horizon, `A`, `W`, `X_0` and `Theta`, times a weight.
fn add_horizon(partials: &mut Partials, [dynamics, process, initial, prices]: [&Matrices; 4], weight: f64) {
    add_scaled(&mut partials.dynamics, dynamics, weight);
    add_scaled(&mut partials.process, process, weight);
    add_scaled(&mut partials.initial, initial, weight);
    // Theta = Xi / 2.
    add_scaled(&mut partials.value_of_information, prices, 0.5 * weight);
}

fn add_scaled(to: &mut Matrices, from: &Matrices, weight: f64) {
    to.as_mut_slice().iter_mut().zip(from.as_slice()).for_each(|(to, from)| *to += weight * from);
}
