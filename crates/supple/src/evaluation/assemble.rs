//! Assembles reports from the results of a task at a design.

use supple_kernels::{Matrices, Scratch};
use supple_lqg::bound::Needed;
use supple_lqg::{Horizon, control_information, entropy_form, noise_cost, paper_form};
use supple_model::{Channels, time_of};

use super::curves::{CostCurve, contact_curves, quantity_curves};
use super::report::{CostReport, InformationReport, NeededInformation, TrajectoryReport, UsedInformation};
use super::sensing::measurements;
use super::terms::cost_terms;
use crate::Error;
use crate::film::film;
use crate::pipeline::TaskState;
use crate::plan::PlanMode;
use crate::problem::{Task, TaskAt};
use crate::simulate::{Rollouts, SampleId, sample, sample_number};

pub(super) fn cost_report(
    TaskAt { task, phi }: TaskAt,
    state: &TaskState,
    second_order: Option<f64>,
    curves: &[CostCurve],
) -> CostReport {
    let xi = &state.plan.policy.value_of_information;
    let n = xi.rows();
    let traces = (0..task.steps).map(|t| {
        let sigma = state.belief.corrected.at(t);
        0.5 * xi.at(t).iter().zip(sigma).map(|(xi, sigma)| xi * sigma).sum::<f64>()
    });
    CostReport {
        expected: state.cost.expected(),
        parts: state.cost,
        terms: cost_terms(task.at(phi), &state.plan.trajectory, curves),
        second_order,
        bound: task.bound.as_ref().map(|bound| bound.resolve(phi)),
        belief_per_step: traces.collect(),
        value_of_information_per_step: (0..task.steps).map(|t| (0..n).map(|i| xi.get(t, i, i)).sum()).collect(),
    }
}

/// The expected cost to second order (theory, equation J.4), where the plan is a free minimum of the nominal cost.
pub(super) fn second_order(TaskAt { task, phi }: TaskAt, state: &TaskState) -> Option<f64> {
    let plan = &state.plan;
    if plan.mode != PlanMode::Nominal || !plan.status.is_converged() || plan.is_at_limits() {
        return None;
    }
    let mut hessians = Matrices::zeros(plan.knots.cost.count(), plan.knots.cost.rows(), plan.knots.cost.cols());
    let at = plan.trajectory.points();
    task.system.lagrangian_quadratics(at, phi, &plan.costates, &mut hessians, &mut Scratch::new());
    let noise = noise_cost(&plan.knots, &plan.policy, &state.belief, &hessians).ok()?;
    Some(plan.nominal_cost + noise).filter(|cost| cost.is_finite())
}

pub(super) fn information_report(task: &Task, phi: &[f64], state: &TaskState) -> Result<InformationReport, Error> {
    let nats = state.information.total;
    let bits = nats / std::f64::consts::LN_2;
    let bits_per_step = bits / (task.steps + 1) as f64;
    Ok(InformationReport {
        total_nats: nats,
        total_bits: bits,
        bits_per_step,
        bits_per_second: bits_per_step / task.time_step.resolve::<f64>(phi),
        entropy_form_nats: entropy_form(&state.belief),
        paper_form_nats: paper_form(&state.belief),
        per_step_nats: state.information.per_step.clone(),
        needed: None,
        needed_takes_long: false,
        needed_not_found: None,
        used: Some(used_report(state)?),
    })
}

/// Adds the minimum information over a plan's horizon, or why it was not found: for plans that are not optima, or if
/// rounding prevents it. It is also skipped if it would take long, unless it is part of the objective.
pub(super) fn add_needed(
    TaskAt { task, phi }: TaskAt,
    counts: bool,
    horizon: &Horizon,
    state: &mut TaskState,
    information: &mut InformationReport,
) {
    let bound = task.bound.as_ref().map(|bound| bound.resolve::<f64>(phi));
    let limit_out_of_reach = bound.is_some_and(|bound| bound <= horizon.base_cost);
    let cost = bound.filter(|_| !limit_out_of_reach).unwrap_or(state.cost.expected());
    let found = if counts {
        Needed::of(horizon, cost, &mut state.nearby).map(Some)
    } else {
        Needed::soon(horizon, cost, &mut state.nearby)
    };
    information.needed_takes_long = matches!(found, Ok(None));
    information.needed_not_found = found.as_ref().err().map(ToString::to_string);
    information.needed = found.ok().flatten().map(|found| NeededInformation {
        total_nats: found.nats,
        total_bits: found.nats / std::f64::consts::LN_2,
        lower_bits: found.lower_nats / std::f64::consts::LN_2,
        cost,
        limit_out_of_reach,
    });
}

fn used_report(state: &TaskState) -> Result<UsedInformation, Error> {
    let per_step_nats = control_information(&state.plan.knots, &state.plan.policy, &state.belief, &state.noise)?;
    let total_nats: f64 = per_step_nats.iter().sum();
    let total_bits = total_nats / std::f64::consts::LN_2;
    let bits_per_step = total_bits / per_step_nats.len() as f64;
    Ok(UsedInformation { total_nats, total_bits, bits_per_step, per_step_nats })
}

/// Maximum number of runs kept in addition to the first one, and maximum count of their state values in all.
const MOST_THREADS: usize = 20;
const MOST_NUMBERS: usize = 60_000;

pub(super) fn trajectory_report(
    task: &Task,
    phi: &[f64],
    state: &TaskState,
    curves: &[CostCurve],
    Rollouts { count: rollouts, seed }: Rollouts,
) -> Result<TrajectoryReport, Error> {
    let dt = task.time_step.resolve::<f64>(phi);
    let sigma = &state.belief.corrected;
    let feedback = &state.plan.policy.feedback;
    let gains = |t: usize| {
        let row = |a: usize| (0..feedback.cols()).map(|i| feedback.get(t, a, i)).collect();
        (0..feedback.rows()).map(row).collect()
    };
    let Channels { states, controls, .. } = task.system.channels();
    let [(state_names, state_units), (control_names, control_units)] =
        [states, controls].map(|list| list.into_iter().map(|channel| (channel.name, channel.unit)).unzip());
    let run = sample(task, phi, &state.plan, &state.noise, seed)?;
    let size = task.system.dimensions();
    let count = MOST_THREADS.min(rollouts).min(MOST_NUMBERS / (size.states * (task.steps + 1)));
    let thread = |index| sample_number(task, phi, &state.plan, &state.noise, SampleId { seed, number: index as u64 });
    let threads = (1..=count).map(thread).map(|run| Ok(run?.states)).collect::<Result<_, Error>>()?;
    Ok(TrajectoryReport {
        state_names,
        state_units,
        control_names,
        control_units,
        time: (0..=task.steps).map(|t| time_of(t, dt)).collect(),
        states: state.plan.trajectory.states.to_rows(),
        deviations: (0..=task.steps)
            .map(|t| (0..sigma.rows()).map(|i| sigma.get(t, i, i).max(0.0).sqrt()).collect())
            .collect(),
        controls: state.plan.trajectory.controls.to_rows(),
        feedforward: state.plan.policy.feedforward.to_rows(),
        feedback: (0..task.steps).map(gains).collect(),
        measurements: measurements(task, state),
        threads,
        contacts: contact_curves(task, phi, &state.plan.trajectory, &run),
        costs: curves.to_vec(),
        quantities: quantity_curves(task, phi, &state.plan.trajectory, &run),
        sample: run,
        scene: film(task, phi, &state.plan.trajectory, sigma),
    })
}
