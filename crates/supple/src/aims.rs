//! What designs minimise: the information needed, used and measured, and its gradient.

use supple_kernels::Matrices;
use supple_lqg::Partials;
use supple_lqg::add_control_partials;
use supple_lqg::bound::{Horizon, Needed};
use supple_model::Value;

use crate::Error;
use crate::gradient::Functional;
use crate::horizon::horizon_of_plan;
use crate::pipeline::TaskState;
use crate::plan::Plan;
use crate::problem::Task;
use crate::settings::InformationWeights;

/// The share of what a plan pays for not knowing the state that is left to keep where the limit leaves less.
const LEAST_SHARE: f64 = 0.05;

/// What an expected cost may be at most.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Limit {
    pub value: f64,
    /// Its derivative by each parameter that it depends on.
    pub slopes: Vec<(usize, f64)>,
}

impl Limit {
    /// A task's bound times a factor.
    pub fn of(bound: Value, factor: f64, phi: &[f64]) -> Self {
        let slopes = bound.slopes(phi).into_iter().map(|(parameter, slope)| (parameter, factor * slope)).collect();
        Self { value: factor * bound.resolve::<f64>(phi), slopes }
    }
}

/// What the covariances of the needed information may cost: `D - J*`.
enum Budget {
    /// What a limit leaves of it.
    Limited,
    /// A share of what the plan pays itself.
    Share(f64),
}

/// The information of an evaluated plan by its weights, nats, and its total gradient by all parameters: needed at the task's
/// bound, or at the plan's own expected cost where there is none (theory, section L, in designs).
///
/// # Errors
/// Where the minimum was not found, or the plan is no strict local optimum.
pub fn weighted_information(
    task: &Task,
    phi: &[f64],
    weights: InformationWeights,
    state: &mut TaskState,
    out: &mut Vec<f64>,
) -> Result<f64, Error> {
    let limit = task.bound.map(|bound| Limit::of(bound, 1.0, phi));
    information_within((task, phi), (weights, limit.as_ref()), state, out)
}

/// As [`weighted_information`], with a limit of its own.
///
/// # Errors
/// As those.
pub(crate) fn information_within(
    (task, phi): (&Task, &[f64]),
    (weights, limit): (InformationWeights, Option<&Limit>),
    state: &mut TaskState,
    out: &mut Vec<f64>,
) -> Result<f64, Error> {
    let InformationWeights { needed, used, measured } = weights;
    let mut functional = Functional { information: measured, ..Functional::default() };
    let mut sum = if measured == 0.0 { 0.0 } else { measured * state.information.total };
    if needed == 0.0 && used == 0.0 {
        state.total_gradient(task, phi, functional, out)?;
        return Ok(sum);
    }
    let mut partials = Partials::zeros(state.plan.knots.dimensions, task.steps);
    let (mut nominal, mut by_limit) = (0.0, 0.0);
    if used != 0.0 {
        let Plan { knots, policy, .. } = &state.plan;
        sum += used * add_control_partials(knots, policy, &state.belief, &state.noise, used, &mut partials)?;
    }
    if needed != 0.0 {
        let (found, budget) = needed_information(limit, state)?;
        sum += needed * found.nats;
        if let Some(of) = &found.sensitivity {
            add_horizon(&mut partials, [&of.dynamics, &of.process, &of.initial, &of.prices], needed);
            match budget {
                Budget::Limited => {
                    by_limit = needed * of.cost;
                    // By the least cost: the negative of that by the limit.
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
    Ok(sum)
}

/// The expected cost of a task of which nothing is ever measured, and its total gradient by all parameters: no information
/// is needed where that is within the limit.
///
/// # Errors
/// Where there is no law of least cost along the plan, or it is no strict local optimum.
pub(crate) fn cost_without_measurements(
    (task, phi): (&Task, &[f64]),
    state: &mut TaskState,
    out: &mut Vec<f64>,
) -> Result<f64, Error> {
    let found = horizon_of_plan(&state.plan, &state.noise)?.unmeasured();
    let mut partials = Partials::zeros(state.plan.knots.dimensions, task.steps);
    add_horizon(&mut partials, [&found.dynamics, &found.process, &found.initial, &found.prices], 1.0);
    let functional = Functional { process: 1.0, initial: 1.0, partials: Some(&partials), ..Functional::default() };
    state.total_gradient(task, phi, functional, out)?;
    let mut by_nominal = Vec::new();
    state.nominal_gradient(task, phi, &mut by_nominal)?;
    out.iter_mut().zip(&by_nominal).for_each(|(sum, slope)| *sum += slope);
    Ok(found.cost)
}

/// The least information at the limit, or at what the plan costs itself where there is none.
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

/// The least information at an expected cost that is so much above the least.
///
/// # Errors
/// Where there is no law of least cost along the plan, or the minimum was not found.
fn needed_beyond(budget: f64, state: &mut TaskState) -> Result<Needed, Error> {
    Ok(Needed::of(&horizon_of(state)?, budget, &mut state.nearby)?)
}

/// The horizon of a plan, whose costs count from the least.
fn horizon_of(state: &TaskState) -> Result<Horizon, Error> {
    Ok(Horizon { base_cost: 0.0, ..horizon_of_plan(&state.plan, &state.noise)? })
}

/// Adds derivatives by what a horizon is made of, `A`, `W`, `X_0` and `Theta`, times a weight.
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
