//! What an evaluation reports.

use serde::{Deserialize, Serialize};
use supple_model::limits::LimitViolation;
use supple_model::parameters::Named;
use supple_model::scene::Scene;
use supple_model::system::Curvature;
use supple_model::{ContactReport, PriceReport};
use supple_text::{interval_95, short};

use super::controller::ControllerReport;
use super::curves::{ContactCurve, CostCurve, QuantityCurve};
use super::reached::LimitReached;
use super::sensing::MeasurementReport;
use super::terms::{CostTerm, TargetReport};
use super::trust::Trust;
use crate::plan::PlanStatus;
use crate::settings::InformationWeights;
use crate::simulate::{LimitShare, MonteCarlo, Sample};
use crate::stability::Stability;
use crate::{CostParts, FEASIBILITY, meets};

/// One design, evaluated.
///
/// ```
/// use supple::settings::InformationWeights;
/// use supple::{EvaluateOptions, Verdict};
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
/// let options = EvaluateOptions {
///     total_gradient: true,
///     frozen_gradient: true,
///     rollouts: 200,
///     trajectories: true,
///     ..EvaluateOptions::default()
/// };
/// let found = problem.evaluate(&problem.parameters.initial(), &options)?;
/// assert!((found.objective.information_bits - 33.3).abs() < 0.01);
/// let task = &found.tasks[0];
/// assert!((task.cost.expected - task.cost.parts.expected()).abs() < 1e-9);
/// assert!(!task.stability.numerically_unstable && task.controller.feedback_variation < 1.0);
///
/// // Noise of the sensor lowers its information.
/// let gradient = task.gradient.as_ref().ok_or("it was requested")?;
/// let (total, frozen) = (gradient.total.as_ref(), gradient.frozen.as_ref());
/// let minimised = total.and_then(|total| total.minimised_nats(InformationWeights::MEASURED));
/// assert_eq!(minimised.as_ref(), total.map(|total| &total.information_nats));
/// let slopes = [total.map(|total| &total.information_nats), frozen.map(|frozen| &frozen.information_nats)];
/// assert!(slopes.into_iter().flatten().all(|slopes| slopes.get("variance").is_some_and(|slope| slope < 0.0)));
///
/// // Closed-loop roll-outs do not contradict the predictions.
/// let trust = task.trust.as_ref().ok_or("there are roll-outs")?;
/// assert_ne!(trust.verdict, Verdict::Broken);
/// let trajectory = task.trajectory.as_ref().ok_or("it was requested")?;
/// assert_eq!((trajectory.states.len(), trajectory.measurements.len(), trajectory.costs.len()), (51, 1, 1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Evaluation {
    /// All parameters.
    pub parameters: Named,
    /// The objective that designs minimise.
    pub objective: Objective,
    /// Whether every plan converged, every task meets its bound and the price the budget, to a share `feasibility` of
    /// it.
    pub feasible: bool,
    /// How far above its bound an expected cost may be, and above the budget the price, relative to it.
    #[serde(default = "default_feasibility")]
    pub feasibility: f64,
    /// What the parameters cost; `None` if none has a price.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub price: Option<PriceReport>,
    /// Each task.
    pub tasks: Vec<TaskEvaluation>,
}

fn default_feasibility() -> f64 {
    FEASIBILITY
}

impl Evaluation {
    /// The bound of one of its tasks, where the expected cost does not meet it.
    #[must_use]
    pub fn missed_bound(&self, task: &TaskEvaluation) -> Option<f64> {
        task.cost.bound.filter(|&bound| !meets(task.cost.expected, Some(bound), self.feasibility))
    }

    /// The budget, where the price does not keep it.
    #[must_use]
    pub fn exceeded_budget(&self) -> Option<f64> {
        let price = self.price.as_ref()?;
        price.budget.filter(|&budget| !meets(price.total, Some(budget), self.feasibility))
    }

    /// Computes [`feasible`](Self::feasible).
    pub(super) fn is_feasible(&self) -> bool {
        let met = |task: &TaskEvaluation| {
            let finite = task.information.total_nats.is_finite();
            task.status.is_converged() && finite && meets(task.cost.expected, task.cost.bound, self.feasibility)
        };
        self.exceeded_budget().is_none() && self.tasks.iter().all(met)
    }

    /// Why its numbers cannot be trusted, over all tasks; empty if there are no warnings.
    pub fn warnings(&self) -> impl Iterator<Item = &str> {
        self.tasks.iter().flat_map(|task| &task.warnings).map(String::as_str)
    }

    /// Whether roll-outs contradict a task, so that its numbers must not be used.
    #[must_use]
    pub fn is_broken(&self) -> bool {
        self.tasks.iter().any(TaskEvaluation::is_broken)
    }
}

/// What designs minimise: the weighted sum of the tasks' information; prices are separate.
///
/// Example: [`Evaluation`].
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Objective {
    /// In nats.
    pub information_nats: f64,
    /// In bits.
    pub information_bits: f64,
}

/// One task at one design.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TaskEvaluation {
    /// Its name.
    pub name: String,
    /// The parameters that it sets for itself, whatever those of the design are.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub set: Named,
    /// How its plan ended.
    pub status: PlanStatus,
    /// Iterations of its plan, from the guess that led there.
    pub iterations: usize,
    /// The largest gradient of the Hamiltonian by a control, `|l_u + B' lambda|`.
    pub stationarity: f64,
    /// The same, relative to 1 plus the largest `|l_u|`.
    pub relative_stationarity: f64,
    /// Iterations that had to raise the regularisation.
    pub regularised_iterations: usize,
    /// Which second derivatives of the cost its control law and expected cost use.
    #[serde(default)]
    pub cost_curvature: Curvature,
    /// How often rounding errors in the belief were repaired.
    pub belief_repairs: usize,
    /// Number of local minima encountered, if a branch search was run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub branches: Option<usize>,
    /// Limits that its plan violates.
    pub limits_violated: Vec<LimitViolation>,
    /// Limits that its plan keeps and is held at.
    #[serde(default)]
    pub limits_reached: Vec<LimitReached>,
    /// What its plan touches: every contact of the model; empty in results of versions that did not report contacts.
    #[serde(default)]
    pub contacts: Vec<ContactReport>,
    /// Why its numbers cannot be trusted, for example a cost that tracks a force at a contact that the plan never makes.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// Whether the time step is short enough.
    pub stability: Stability,
    /// Its expected cost.
    pub cost: CostReport,
    /// Its directed information.
    pub information: InformationReport,
    /// How much its controller changes over time.
    pub controller: ControllerReport,
    /// Its gradients.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gradient: Option<GradientReport>,
    /// Its cost in closed loop.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub monte_carlo: Option<MonteCarlo>,
    /// Whether its predictions hold in closed loop.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trust: Option<Trust>,
    /// Its trajectory.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<TrajectoryReport>,
}

impl TaskEvaluation {
    /// Whether roll-outs contradict its plan, so that its numbers must not be used.
    #[must_use]
    pub fn is_broken(&self) -> bool {
        self.trust.as_ref().is_some_and(Trust::is_broken)
    }

    /// What roll-outs exceed although the plan keeps it, in words: the cost limit, if their 95 % interval lies above it, and
    /// limits that more than half of them leave.
    #[must_use]
    pub fn exceeded_in_rollouts(&self) -> Vec<String> {
        let Some(sampled) = &self.monte_carlo else { return Vec::new() };
        let cost = self.limit_exceeded_in_rollouts().filter(|bound| self.cost.expected <= bound * (1.0 + FEASIBILITY));
        let of_cost = cost.map(|bound| {
            let interval = sampled
                .cost_interval_95
                .map_or_else(String::new, |interval| format!(", {}", interval_95(interval, |value| short(value, 5))));
            format!("their cost, {}{interval}, is above its limit of {}", short(sampled.cost_mean, 5), short(bound, 5))
        });
        let left = sampled.limits.iter().filter(|limit| limit.is_kept_by_plan() && limit.share > 0.5);
        let of_limit = |limit: &LimitShare| {
            let LimitShare { name, unit, limit, upper, median, share, .. } = limit;
            let side = if *upper { "above" } else { "below" };
            let (share, bound, median) = (short(100.0 * share, 3), short(*limit, 4), short(*median, 4));
            let bound = format!("{bound} {unit}");
            format!("{name} is {side} {} in {share} % of them, with a median of {median}", bound.trim_end())
        };
        of_cost.into_iter().chain(left.map(of_limit)).collect()
    }

    /// The cost limit, if roll-outs exceed it significantly: their 95 % interval lies above it.
    #[must_use]
    pub fn limit_exceeded_in_rollouts(&self) -> Option<f64> {
        let [low, _] = self.monte_carlo.as_ref()?.cost_interval_95?;
        self.cost.bound.filter(|&bound| low > bound)
    }
}

/// The expected cost of a task.
///
/// Example: [`Evaluation`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CostReport {
    /// The sum of the four parts.
    pub expected: f64,
    /// The parts.
    #[serde(flatten)]
    pub parts: CostParts,
    /// The terms of the nominal cost, in the order of the task's costs: what each costs, and what became of the numbers that it
    /// weighs; empty in results of versions that did not report them.
    #[serde(default)]
    pub terms: Vec<CostTerm>,
    /// The expected cost to second order, with the second derivatives of dynamics and cost, which the parts leave out as the
    /// controller does (theory, equation J.4); none if it was not requested, or the plan is held at limits, or is not that of
    /// the nominal cost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_order: Option<f64>,
    /// The bound.
    pub bound: Option<f64>,
    /// `1/2 Tr(Xi_t Sigma_t)` per step: the value of information times the estimation error.
    pub belief_per_step: Vec<f64>,
    /// `Tr(Xi_t)` per step.
    pub value_of_information_per_step: Vec<f64>,
}

impl CostReport {
    /// The targets that the plan misses by far, with the names of their terms: numbers that the final cost weighs, which end less
    /// than half of the way from their start to their target. Targets of 0 only count if their term is more than a tenth of the
    /// nominal cost.
    ///
    /// Example: [`CostTerm`].
    pub fn missed_targets(&self) -> impl Iterator<Item = (&str, &TargetReport)> {
        let nominal = self.parts.nominal;
        self.terms.iter().flat_map(move |term| term.missed(nominal).map(|number| (term.name.as_str(), number)))
    }
}

/// The directed information of a task.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct InformationReport {
    /// Over the whole task, nats.
    pub total_nats: f64,
    /// The same in bits.
    pub total_bits: f64,
    /// Bits per measurement: the total over N + 1.
    pub bits_per_step: f64,
    /// Bits per measurement and time step.
    pub bits_per_second: f64,
    /// The entropy form, for comparison; `None` if a covariance is singular.
    pub entropy_form_nats: Option<f64>,
    /// The paper's printed form, for comparison; `None` if a covariance is singular.
    pub paper_form_nats: Option<f64>,
    /// Nats at each measurement.
    pub per_step_nats: Vec<f64>,
    /// Minimum over all sensors and controllers that meet the cost limit; `None` if it was not requested or
    /// not found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub needed: Option<NeededInformation>,
    /// Whether `needed` was skipped because it would take too long: memory grows with the fourth power of the number of
    /// states, and time with the sixth.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub needed_takes_long: bool,
    /// Why `needed` was not found, if it was requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub needed_not_found: Option<String>,
    /// The information that the controller uses, `DI(x^N -> u^N)`, nats; none in results of versions that did not find it.
    #[serde(default, alias = "control", skip_serializing_if = "Option::is_none")]
    pub used: Option<UsedInformation>,
}

impl InformationReport {
    /// Weighted sum, nats; parts that were not found count as 0.
    #[must_use]
    pub fn weighted_nats(&self, weights: InformationWeights) -> f64 {
        let part = |weight: f64, nats: Option<f64>| if weight == 0.0 { 0.0 } else { weight * nats.unwrap_or(0.0) };
        part(weights.needed, self.needed.as_ref().map(|needed| needed.total_nats))
            + part(weights.used, self.used.as_ref().map(|used| used.total_nats))
            + part(weights.measured, Some(self.total_nats))
    }
}

/// The least directed information over all sensors and controllers that keep an expected cost, along the plan's
/// linearisation.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct NeededInformation {
    /// Over the whole task, nats.
    pub total_nats: f64,
    /// The same in bits.
    pub total_bits: f64,
    /// Lower bound, bits: the value of a dual point, not protected against rounding errors (`supple bound` proves
    /// its own bound).
    pub lower_bits: f64,
    /// The expected cost that is met: the bound of the task, or the plan's own cost if there is no bound or it is out of
    /// reach.
    pub cost: f64,
    /// Whether the bound of the task is out of reach: no information achieves it along this plan.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub limit_out_of_reach: bool,
}

/// The directed information from the state to the controls, exact for the linearised closed loop.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct UsedInformation {
    /// Over the whole task, nats.
    pub total_nats: f64,
    /// The same in bits.
    pub total_bits: f64,
    /// Bits per control: the total over N.
    pub bits_per_step: f64,
    /// Nats at each control, N of them.
    pub per_step_nats: Vec<f64>,
}

/// Gradients of a task by the parameters.
///
/// Example: [`Evaluation`].
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct GradientReport {
    /// With everything moving.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub total: Option<TotalReport>,
    /// With the trajectory frozen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frozen: Option<FrozenReport>,
}

/// Gradients with everything moving.
///
/// Example: [`Evaluation`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TotalReport {
    /// Whether the plan is stationary enough for the gradient to hold.
    pub valid: bool,
    /// Of the directed information, nats.
    pub information_nats: Named,
    /// Of the expected cost.
    pub expected_cost: Named,
    /// Of its nominal part.
    pub nominal_cost: Named,
    /// Of its belief part.
    pub belief_cost: Named,
    /// Of its process noise part.
    pub process_cost: Named,
    /// Of its initial part.
    pub initial_cost: Named,
    /// Of the information that the controller uses, nats; none in results of versions that did not find it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub used_nats: Option<Named>,
    /// Of the information that any sensors and any controller need, nats; none where that was not computed, or is not the
    /// minimum at the cost limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub needed_nats: Option<Named>,
}

impl TotalReport {
    /// Of what designs minimise, nats; `None` where a part of it is not known.
    #[must_use]
    pub fn minimised_nats(&self, weights: InformationWeights) -> Option<Named> {
        let parts = [
            (weights.needed, self.needed_nats.as_ref()),
            (weights.used, self.used_nats.as_ref()),
            (weights.measured, Some(&self.information_nats)),
        ];
        let mut sum = self.information_nats.clone();
        sum.0.iter_mut().for_each(|(_, slope)| *slope = 0.0);
        for (weight, part) in parts.into_iter().filter(|(weight, _)| *weight != 0.0) {
            sum.0.iter_mut().zip(&part?.0).for_each(|((_, sum), (_, slope))| *sum += weight * slope);
        }
        Some(sum)
    }
}

/// Gradients with the trajectory frozen.
///
/// Example: [`Evaluation`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FrozenReport {
    /// Of the directed information, nats.
    pub information_nats: Named,
    /// Of the belief part of the expected cost.
    pub belief_cost: Named,
    /// The largest spectral radius of the paper's recursion matrix over all steps: its recursion is stable below 1.
    pub recursion_spectral_radius: Option<f64>,
}

/// A plan's trajectory.
///
/// Example: [`Evaluation`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TrajectoryReport {
    /// Names of the states.
    pub state_names: Vec<String>,
    /// Their units; empty where they are not known.
    pub state_units: Vec<String>,
    /// Names of the controls.
    pub control_names: Vec<String>,
    /// Their units.
    pub control_units: Vec<String>,
    /// Time of each state, s.
    pub time: Vec<f64>,
    /// States, one row per time.
    pub states: Vec<Vec<f64>>,
    /// Standard deviation of the belief, one row per time.
    pub deviations: Vec<Vec<f64>>,
    /// Controls, one row per step.
    pub controls: Vec<Vec<f64>>,
    /// Feedforward that the control law adds to the controls, one row per step: zero but for rounding where the plan is
    /// stationary. Empty in results of versions that did not store it.
    #[serde(default)]
    pub feedforward: Vec<Vec<f64>>,
    /// Feedback gains, one m x n matrix per step.
    pub feedback: Vec<Vec<Vec<f64>>>,
    /// Information from each measurement.
    pub measurements: Vec<MeasurementReport>,
    /// One run in closed loop, with noise and a filter.
    pub sample: Sample,
    /// States of further runs, where roll-outs were made: rows of each run, which ends early where it diverged.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub threads: Vec<Vec<Vec<f64>>>,
    /// Contacts over time; empty in results of versions that did not keep them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<ContactCurve>,
    /// Terms of the cost over time; empty in results of versions that did not keep them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub costs: Vec<CostCurve>,
    /// Quantities that costs weigh, limits bound or the task shows, over time; empty in results of versions that did
    /// not keep them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub quantities: Vec<QuantityCurve>,
    /// Scene to draw; none for models that cannot be drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<Scene>,
}
