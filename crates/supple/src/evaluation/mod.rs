//! Evaluation of one design: what `supple evaluate` prints and result files hold.

use supple_kernels::Matrices;
use supple_lqg::recursion_radius;
use supple_model::document::Unfit;
use supple_model::limits::LimitViolation;
use supple_model::parameters::Named;
use supple_model::{ContactReport, PriceReport};

use crate::Error;
use crate::aims::weighted_information;
use crate::branches::{Attempts, cheaper_minimum, plan_at};
use crate::gradient::{FrozenGradient, Functional};
use crate::growth::stability;
use crate::horizon::DespiteRounding;
use crate::limited::LimitedNumber;
use crate::pipeline::TaskState;
use crate::plan::{PlanStatus, VALID_STATIONARITY};
use crate::problem::{Problem, Task, TaskAt, check_branches, check_rollouts};
use crate::settings::InformationWeights;
use crate::simulate::{MonteCarlo, Rollouts, World, monte_carlo, on_finer_steps};
use crate::touching::{contact_reports, contact_warnings};

mod assemble;
mod controller;
mod curves;
mod plan_check;
mod reached;
mod report;
mod sensing;
mod terms;
mod trouble;
mod trust;

use assemble::{add_needed, cost_report, information_report, second_order, trajectory_report};
pub use controller::ControllerReport;
use curves::cost_curves;
pub use curves::{ContactCurve, CostCurve, QuantityCurve};
pub use plan_check::PlanCheck;
pub use reached::LimitReached;
use reached::limits_reached;
pub use report::*;
pub use sensing::MeasurementReport;
pub use terms::{CostTerm, TargetReport};
use trouble::{cheaper_warning, jump_warning};
pub use trouble::{number_warnings, plan_warnings};
use trust::Predicted;
pub use trust::{Trust, Verdict};

/// What to compute in addition to information and cost.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, Default)]
pub struct EvaluateOptions {
    /// Total gradients: plan, feedback and filter all vary.
    pub total_gradient: bool,
    /// Gradients with the trajectory frozen, and the spectral radius of their recursion.
    pub frozen_gradient: bool,
    /// The least information that any sensors and any controller need, if that takes no more than a few seconds or
    /// is part of the objective.
    pub needed: bool,
    /// Closed-loop roll-outs.
    pub rollouts: usize,
    /// Seed of roll-outs and branch searches.
    pub seed: u64,
    /// Attempts to find a plan of lower cost on another branch, by continuation from nearby designs.
    pub branches: usize,
    /// Whether a few attempts look for such a plan where `branches` asks for none, and warn of it; the plan stays as it is.
    pub probe: bool,
    /// Controls to start each task's plan from, instead of its first guess.
    pub controls: Option<Vec<Matrices>>,
    /// Whether to keep the trajectories.
    pub trajectories: bool,
    /// The objective; default: that of the problem's design settings.
    pub information: Option<InformationWeights>,
    /// How far above its bound an expected cost may be, relative to the bound; default: that of the problem's
    /// design settings.
    pub feasibility: Option<f64>,
}

impl EvaluateOptions {
    /// The objective.
    fn weights(&self, problem: &Problem) -> InformationWeights {
        self.information.unwrap_or(problem.design.information)
    }

    fn rollouts(&self) -> Rollouts {
        Rollouts { count: self.rollouts, seed: self.seed }
    }
}

impl Problem {
    /// Evaluates a design: all its parameters in the order of declaration.
    ///
    /// # Errors
    /// Where `phi` has the wrong length, a requested number exceeds its limit, something is not finite, or a
    /// covariance is indefinite.
    pub fn evaluate(&self, phi: &[f64], options: &EvaluateOptions) -> Result<Evaluation, Error> {
        self.check_design(phi)?;
        check_rollouts(options.rollouts)?;
        check_branches(options.branches)?;
        for (task, controls) in self.tasks.iter().zip(options.controls.iter().flatten()) {
            let in_task = |message| {
                Error::Unfit(Unfit::here(format!("task `{}`: the controls to start from {message}", task.name)))
            };
            task.check_guess(controls).map_err(in_task)?;
        }
        let tasks = self.tasks.iter().enumerate();
        let tasks = tasks.map(|(index, task)| {
            let mut state = TaskState::new(task);
            let controls = options.controls.as_ref().and_then(|controls| controls.get(index));
            evaluate_task(self, task, phi, options, controls, &mut state)
        });
        let tasks = tasks.collect::<Result<Vec<_>, _>>()?;
        let weights = options.weights(self);
        let weighted = |e: &TaskEvaluation| e.information.weighted_nats(weights);
        let nats: f64 = tasks.iter().zip(&self.tasks).map(|(e, t)| t.information_weight * weighted(e)).sum();
        let price = self.parameters.have_prices().then(|| {
            let (total, weight) = (self.parameters.price(phi), self.design.price_weight);
            PriceReport {
                total,
                budget: self.design.budget,
                weight_nats_per_unit: weight,
                objective_nats: nats + weight * total,
                parameters: self.parameters.prices(phi),
            }
        });
        let mut evaluation = Evaluation {
            parameters: Named::new(&self.parameters, phi),
            objective: Objective { information_nats: nats, information_bits: nats / std::f64::consts::LN_2 },
            feasible: false,
            feasibility: options.feasibility.unwrap_or(self.design.feasibility),
            price,
            tasks,
        };
        evaluation.feasible = evaluation.is_feasible();
        Ok(evaluation)
    }
}

fn evaluate_task(
    problem: &Problem,
    task: &Task,
    phi: &[f64],
    options: &EvaluateOptions,
    controls: Option<&Matrices>,
    state: &mut TaskState,
) -> Result<TaskEvaluation, Error> {
    let attempts = Attempts { count: options.branches, seed: options.seed };
    let branches = plan_at(problem, task, phi, controls, attempts, state)?;
    // An interrupted plan is not a result.
    Error::check_stop()?;
    let cheaper = (options.probe && options.branches == 0)
        .then(|| cheaper_minimum(problem, task, phi, options.seed, state))
        .flatten()
        .map(|cost| cheaper_warning(task, cost, state.cost.expected()));
    Error::check_stop()?;
    let monte_carlo = sampled(task.at(phi), options, state)?;
    let contacts = contact_reports(task, phi, &state.plan.trajectory);
    let known = &*state;
    let told = || information_report(task, phi, known);
    let curves = cost_curves(task, phi, &known.plan.trajectory);
    let shown = || trajectory_report(task, phi, known, &curves, options.rollouts());
    let (information, trajectory) = rayon::join(told, || options.trajectories.then(shown).transpose());
    let (mut information, trajectory) = (information?, trajectory?);
    let counts = options.weights(problem).needed != 0.0;
    let mut law_remark = None;
    if options.needed || counts {
        let DespiteRounding { horizon, remark } = DespiteRounding::of(&state.plan, &state.noise);
        if let Some(horizon) = horizon {
            add_needed(task.at(phi), counts, &horizon, state, &mut information);
        }
        law_remark = remark;
    }
    Error::check_stop()?;
    let (gradient, saddle) = gradients(problem, task.at(phi), options, &information, state)?;
    let status = if saddle.is_some() { PlanStatus::Indefinite } else { state.plan.status };
    Error::check_stop()?;
    let feasibility = options.feasibility.unwrap_or(problem.design.feasibility);
    let limit = task.bound.as_ref().map(|bound| bound.resolve(phi));
    let predicted = Predicted::of(task, state, status, information.total_bits, &contacts, limit, feasibility);
    let in_full = monte_carlo.as_ref().and_then(|_| second_order(task.at(phi), state));
    let substeps = task.system.substeps();
    let trust = monte_carlo.as_ref().map(|sampled| Trust::of(&predicted, sampled, substeps));
    Ok(TaskEvaluation {
        name: task.name.clone(),
        set: task.set.clone(),
        status,
        iterations: state.plan.iterations,
        stationarity: state.plan.stationarity,
        relative_stationarity: state.plan.relative_stationarity,
        regularised_iterations: state.plan.regularised,
        cost_curvature: state.plan.curvature,
        belief_repairs: state.belief.repairs,
        branches,
        limits_violated: violations(task.at(phi), state),
        limits_reached: limits_reached(task, phi, &state.plan),
        warnings: warnings(task.at(phi), state, &contacts, monte_carlo.as_ref(), [cheaper, law_remark, saddle]),
        contacts,
        stability: stability(task, phi, &state.plan.trajectory, &state.plan.knots),
        cost: cost_report(task.at(phi), state, in_full, &curves),
        information,
        gradient,
        monte_carlo,
        trust,
        controller: ControllerReport::of(&state.plan),
        trajectory,
    })
}

/// Closed-loop roll-outs, where they are asked for.
fn sampled(
    TaskAt { task, phi }: TaskAt,
    options: &EvaluateOptions,
    state: &TaskState,
) -> Result<Option<MonteCarlo>, Error> {
    if options.rollouts == 0 {
        return Ok(None);
    }
    let expected = state.cost.expected();
    let mut sampled = monte_carlo(task, phi, &state.plan, &state.noise, expected, options.rollouts())?;
    let world = World { phi, noise: &state.noise };
    sampled.finer = on_finer_steps(task, &state.plan, world, options.seed, &sampled)?;
    Ok(Some(sampled))
}

/// Limits of states, controls and quantities that a plan violates.
fn violations(task: TaskAt, state: &TaskState) -> Vec<LimitViolation> {
    LimitedNumber::all(task, &state.plan.trajectory).iter().flat_map(LimitedNumber::violations).collect()
}

/// Why the numbers of a task cannot be trusted.
fn warnings(
    TaskAt { task, phi }: TaskAt,
    state: &TaskState,
    contacts: &[ContactReport],
    sampled: Option<&MonteCarlo>,
    others: [Option<String>; 3],
) -> Vec<String> {
    // A plan that is indefinite as noise would lower its cost has a law, and says so itself.
    let of_plan = if state.lowered().is_some() { Vec::new() } else { plan_warnings(task, phi, &state.plan) };
    [
        task.distrust(),
        of_plan,
        contact_warnings(task, phi, contacts),
        number_warnings(task, state, sampled),
        jump_warning(task.at(phi), state).into_iter().collect(),
        others.into_iter().flatten().collect(),
    ]
    .concat()
}

/// Information of one kind, and its gradient; `None` where it has none.
fn gradient_of(
    TaskAt { task, phi }: TaskAt,
    weights: InformationWeights,
    state: &mut TaskState,
) -> Option<(f64, Vec<f64>)> {
    let mut gradient = Vec::new();
    let nats = weighted_information(task, phi, weights, state, &mut gradient).ok()?;
    Some((nats, gradient))
}

/// The gradient of the needed information, where that was computed. Designs whose cost limit leaves next to nothing for
/// estimation errors minimise another minimum than that at the limit.
fn needed_gradient(task: TaskAt, information: &InformationReport, state: &mut TaskState) -> Option<Vec<f64>> {
    let needed = information.needed.as_ref().filter(|needed| !needed.limit_out_of_reach)?.total_nats;
    let (nats, gradient) = gradient_of(task, InformationWeights::NEEDED, state)?;
    ((nats - needed).abs() <= SAME_MINIMUM * (1.0 + needed)).then_some(gradient)
}

/// Relative difference between two computations of the same minimum.
const SAME_MINIMUM: f64 = 1e-6;

/// The gradients that are asked for, of a task with this information; and, if the plan is no strict minimum of the cost, and so
/// has no total gradient, a warning.
fn gradients(
    problem: &Problem,
    TaskAt { task, phi }: TaskAt,
    options: &EvaluateOptions,
    information: &InformationReport,
    state: &mut TaskState,
) -> Result<(Option<GradientReport>, Option<String>), Error> {
    if !options.total_gradient && !options.frozen_gradient {
        return Ok((None, None));
    }
    let named = |values: &[f64]| Named::new(&problem.parameters, values);
    let (mut report, mut saddle) = (GradientReport::default(), None);
    if options.total_gradient {
        match total_gradients(problem, task.at(phi), information, state) {
            Ok(total) => report.total = Some(total),
            // An indefinite plan is told of already.
            Err(Error::NoStrictMinimum { .. }) if state.plan.status == PlanStatus::Indefinite => {}
            Err(Error::NoStrictMinimum { step }) => {
                saddle = Some(format!(
                    "task `{}`: the plan is stationary, but no strict minimum: some other controls from step {step} on cost the same \
                     or less. It has no total gradient. Give every control a weight, start from another `initial_control`, or look \
                     for others with `branches`",
                    task.name
                ));
            }
            Err(error) => return Err(error),
        }
    }
    if options.frozen_gradient {
        let mut frozen = FrozenGradient::default();
        state.frozen_gradient(task, phi, &mut frozen);
        report.frozen = Some(FrozenReport {
            information_nats: named(&frozen.information),
            belief_cost: named(&frozen.belief_cost),
            recursion_spectral_radius: recursion_radius(&state.plan.knots, &state.belief),
        });
    }
    Ok((Some(report), saddle))
}

/// # Errors
/// [`Error::NoStrictMinimum`] if the plan is no strict minimum of the cost.
fn total_gradients(
    problem: &Problem,
    TaskAt { task, phi }: TaskAt,
    information: &InformationReport,
    state: &mut TaskState,
) -> Result<TotalReport, Error> {
    let named = |values: &[f64]| Named::new(&problem.parameters, values);
    let mut parts = [const { Vec::new() }; 5];
    let functionals = [Functional::INFORMATION, Functional::BELIEF, Functional::PROCESS, Functional::INITIAL];
    for (functional, out) in functionals.into_iter().zip(&mut parts) {
        Error::check_stop()?;
        state.total_gradient(task, phi, functional, out)?;
    }
    state.nominal_gradient(task, phi, &mut parts[4])?;
    let [measured, belief, process, initial, nominal] = parts;
    let expected: Vec<f64> = (0..phi.len()).map(|i| nominal[i] + belief[i] + process[i] + initial[i]).collect();
    Ok(TotalReport {
        valid: state.plan.relative_stationarity <= VALID_STATIONARITY,
        information_nats: named(&measured),
        expected_cost: named(&expected),
        nominal_cost: named(&nominal),
        belief_cost: named(&belief),
        process_cost: named(&process),
        initial_cost: named(&initial),
        used_nats: gradient_of(task.at(phi), InformationWeights::USED, state).map(|(_, used)| named(&used)),
        needed_nats: needed_gradient(task.at(phi), information, state).map(|needed| named(&needed)),
    })
}
