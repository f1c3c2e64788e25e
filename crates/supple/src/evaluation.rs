//! One design, evaluated: what `supple evaluate` prints and files hold.

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use supple_kernels::Matrices;

use crate::design::{best_of_guesses, search_branches};
use crate::gradient::{FrozenGradient, Functional, recursion_radius};
use crate::information::{entropy_form, paper_form};
use crate::limits::{LimitViolation, limits_violated};
use crate::parameters::Parameters;
use crate::pipeline::TaskState;
use crate::plan::PlanStatus;
use crate::problem::{Problem, Task};
use crate::simulate::{MonteCarlo, monte_carlo};
use crate::stability::{Stability, stability};
use crate::{CostParts, Error};

/// What to find beside information and cost.
#[derive(Clone, Debug, Default)]
pub struct EvaluateOptions {
    /// Gradients with everything moving.
    pub total_gradient: bool,
    /// Gradients with the trajectory frozen, and the spectral radius of their recursion.
    pub frozen_gradient: bool,
    /// Closed-loop roll-outs.
    pub rollouts: usize,
    /// Seed of roll-outs and branch searches.
    pub seed: u64,
    /// Attempts to find a plan of lower cost on another branch, by continuation from designs around.
    pub branches: usize,
    /// Controls to start each task's plan from, instead of its first guess.
    pub controls: Option<Vec<Matrices>>,
    /// Whether to keep the trajectories.
    pub trajectories: bool,
}

/// Values by parameter name, in the order of declaration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Named(pub Vec<(String, f64)>);

impl Named {
    /// Names with their values.
    pub fn new(parameters: &Parameters, values: &[f64]) -> Self {
        Self(parameters.iter().map(|p| p.name.clone()).zip(values.iter().copied()).collect())
    }

    /// The value of `name`.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.0.iter().find(|(other, _)| other == name).map(|&(_, value)| value)
    }
}

impl Serialize for Named {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value) in &self.0 {
            map.serialize_entry(name, value)?;
        }
        map.end()
    }
}

/// One design, evaluated.
#[derive(Clone, Debug, Serialize)]
pub struct Evaluation {
    /// All parameters.
    pub parameters: Named,
    /// What designs minimise.
    pub objective: Objective,
    /// Whether every plan converged and every task meets its bound, to 1e-6 of it.
    pub feasible: bool,
    /// Each task.
    pub tasks: Vec<TaskEvaluation>,
}

/// What designs minimise: the weighted sum of the tasks' information.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Objective {
    /// In nats.
    pub information_nats: f64,
    /// In bits.
    pub information_bits: f64,
}

/// One task at one design.
#[derive(Clone, Debug, Serialize)]
pub struct TaskEvaluation {
    /// Its name.
    pub name: String,
    /// How its plan ended.
    pub status: PlanStatus,
    /// Iterations of its plan, over all guesses that were tried.
    pub iterations: usize,
    /// The largest gradient of the Hamiltonian by a control, `|l_u + B' lambda|`.
    pub stationarity: f64,
    /// The same, relative to 1 plus the largest `|l_u|`.
    pub relative_stationarity: f64,
    /// Iterations that had to raise the regularisation.
    pub regularised_iterations: usize,
    /// How often rounding in the belief had to be mended.
    pub belief_repairs: usize,
    /// Different local minima of the plan seen, where they were searched for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub branches: Option<usize>,
    /// Limits of the model that its plan violates.
    pub limits_violated: Vec<LimitViolation>,
    /// Whether the time step is short enough.
    pub stability: Stability,
    /// Its expected cost.
    pub cost: CostReport,
    /// Its directed information.
    pub information: InformationReport,
    /// Its gradients.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gradient: Option<GradientReport>,
    /// Its cost in closed loop.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub monte_carlo: Option<MonteCarlo>,
    /// Its trajectory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<TrajectoryReport>,
}

/// The expected cost of a task.
#[derive(Clone, Debug, Serialize)]
pub struct CostReport {
    /// The sum of the four parts.
    pub expected: f64,
    /// The parts.
    #[serde(flatten)]
    pub parts: CostParts,
    /// The bound.
    pub bound: Option<f64>,
    /// `1/2 Tr(Xi_t Sigma_t)` per step: the value of information times what is not known.
    pub belief_per_step: Vec<f64>,
    /// `Tr(Xi_t)` per step.
    pub value_of_information_per_step: Vec<f64>,
}

/// The directed information of a task.
#[derive(Clone, Debug, Serialize)]
pub struct InformationReport {
    /// Over the whole task, nats.
    pub total_nats: f64,
    /// The same in bits.
    pub total_bits: f64,
    /// Bits per measurement: the total over N + 1.
    pub bits_per_step: f64,
    /// Bits per measurement and time step.
    pub bits_per_second: f64,
    /// The entropy form, for comparison; none where a covariance is singular.
    pub entropy_form_nats: Option<f64>,
    /// The paper's printed form, for comparison; none where a covariance is singular.
    pub paper_form_nats: Option<f64>,
    /// Nats at each measurement.
    pub per_step_nats: Vec<f64>,
}

/// Gradients of a task by the parameters.
#[derive(Clone, Debug, Default, Serialize)]
pub struct GradientReport {
    /// With everything moving.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub total: Option<TotalReport>,
    /// With the trajectory frozen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frozen: Option<FrozenReport>,
}

/// Gradients with everything moving.
#[derive(Clone, Debug, Serialize)]
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
}

/// Gradients with the trajectory frozen.
#[derive(Clone, Debug, Serialize)]
pub struct FrozenReport {
    /// Of the directed information, nats.
    pub information_nats: Named,
    /// Of the belief part of the expected cost.
    pub belief_cost: Named,
    /// The largest spectral radius of the paper's recursion matrix over all steps: its recursion is stable below 1.
    pub recursion_spectral_radius: Option<f64>,
}

/// A plan's trajectory.
#[derive(Clone, Debug, Serialize)]
pub struct TrajectoryReport {
    /// Names of the states.
    pub state_names: Vec<String>,
    /// Time of each state, s.
    pub time: Vec<f64>,
    /// States, one row per time.
    pub states: Vec<Vec<f64>>,
    /// Standard deviation of the belief, one row per time.
    pub deviations: Vec<Vec<f64>>,
    /// Controls, one row per step.
    pub controls: Vec<Vec<f64>>,
    /// Feedback gains, one m x n matrix per step.
    pub feedback: Vec<Vec<Vec<f64>>>,
}

/// A gradient counts as valid when the plan's relative stationarity is at most this.
pub const VALID_STATIONARITY: f64 = 1e-8;

/// How far above its bound an expected cost may be for the task to count as met, relative to the bound.
pub const FEASIBILITY: f64 = 1e-6;

impl Problem {
    /// Evaluates a design: all its parameters in the order of declaration.
    ///
    /// # Errors
    /// Where something is not finite or a covariance is indefinite.
    pub fn evaluate(&self, phi: &[f64], options: &EvaluateOptions) -> Result<Evaluation, Error> {
        let tasks = self.tasks.iter().enumerate();
        let tasks = tasks.map(|(index, task)| {
            let mut state = TaskState::new(task);
            let controls = options.controls.as_ref().and_then(|controls| controls.get(index));
            evaluate_task((self, task), phi, options, controls, &mut state)
        });
        let tasks = tasks.collect::<Result<Vec<_>, _>>()?;
        let nats: f64 =
            tasks.iter().zip(&self.tasks).map(|(e, t)| t.information_weight * e.information.total_nats).sum();
        let meets = |task: &TaskEvaluation| {
            let bound = task.cost.bound.unwrap_or(f64::INFINITY);
            task.status.is_converged() && task.cost.expected <= bound + FEASIBILITY * bound.abs()
        };
        Ok(Evaluation {
            parameters: Named::new(&self.parameters, phi),
            objective: Objective { information_nats: nats, information_bits: nats / std::f64::consts::LN_2 },
            feasible: tasks.iter().all(meets),
            tasks,
        })
    }
}

fn evaluate_task(
    (problem, task): (&Problem, &Task),
    phi: &[f64],
    options: &EvaluateOptions,
    controls: Option<&Matrices>,
    state: &mut TaskState,
) -> Result<TaskEvaluation, Error> {
    match controls {
        Some(controls) => state.evaluate(task, phi, &problem.planning, Some(controls))?,
        None => best_of_guesses(problem, task, phi, state)?,
    }
    let mut branches = None;
    if options.branches > 0 {
        let given = (&state.plan.trajectory.controls, state.cost.expected());
        let found = search_branches((problem, task), phi, given, (options.seed, options.branches));
        branches = Some(found.count);
        state.evaluate(task, phi, &problem.planning, Some(&found.controls))?;
    }
    let gradient = gradients(problem, task, phi, options, state)?;
    let monte_carlo = match options.rollouts {
        0 => None,
        rollouts => {
            let (plan, predicted) = ((&state.plan, &state.noise), state.cost.expected());
            Some(monte_carlo(task, phi, plan, predicted, (rollouts, options.seed))?)
        }
    };
    Ok(TaskEvaluation {
        name: task.name.clone(),
        status: state.plan.status,
        iterations: state.plan.iterations,
        stationarity: state.plan.stationarity,
        relative_stationarity: state.plan.relative_stationarity,
        regularised_iterations: state.plan.regularised,
        belief_repairs: state.belief.repairs,
        branches,
        limits_violated: limits_violated(&task.system.limits(), &state.plan.trajectory),
        stability: stability(task, phi, &state.plan.trajectory, &state.plan.knots),
        cost: cost_report(task, phi, state),
        information: information_report(task, phi, state),
        gradient,
        monte_carlo,
        trajectory: options.trajectories.then(|| trajectory_report(task, phi, state)),
    })
}

fn gradients(
    problem: &Problem,
    task: &Task,
    phi: &[f64],
    options: &EvaluateOptions,
    state: &mut TaskState,
) -> Result<Option<GradientReport>, Error> {
    if !options.total_gradient && !options.frozen_gradient {
        return Ok(None);
    }
    let named = |values: &[f64]| Named::new(&problem.parameters, values);
    let mut report = GradientReport::default();
    if options.total_gradient {
        let mut parts = [const { Vec::new() }; 5];
        let functionals = [Functional::INFORMATION, Functional::BELIEF, Functional::PROCESS, Functional::INITIAL];
        for (functional, out) in functionals.into_iter().zip(&mut parts) {
            state.total_gradient(task, phi, functional, out)?;
        }
        state.nominal_gradient(task, phi, &mut parts[4]);
        let [information, belief, process, initial, nominal] = parts;
        let expected: Vec<f64> = (0..phi.len()).map(|i| nominal[i] + belief[i] + process[i] + initial[i]).collect();
        report.total = Some(TotalReport {
            valid: state.plan.relative_stationarity <= VALID_STATIONARITY,
            information_nats: named(&information),
            expected_cost: named(&expected),
            nominal_cost: named(&nominal),
            belief_cost: named(&belief),
            process_cost: named(&process),
            initial_cost: named(&initial),
        });
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
    Ok(Some(report))
}

fn cost_report(task: &Task, phi: &[f64], state: &TaskState) -> CostReport {
    let xi = &state.plan.policy.value_of_information;
    let n = xi.rows();
    let traces = (0..task.steps).map(|t| {
        let sigma = state.belief.corrected.at(t);
        0.5 * xi.at(t).iter().zip(sigma).map(|(xi, sigma)| xi * sigma).sum::<f64>()
    });
    CostReport {
        expected: state.cost.expected(),
        parts: state.cost,
        bound: task.bound.map(|bound| bound.resolve(phi)),
        belief_per_step: traces.collect(),
        value_of_information_per_step: (0..task.steps).map(|t| (0..n).map(|i| xi.get(t, i, i)).sum()).collect(),
    }
}

fn information_report(task: &Task, phi: &[f64], state: &TaskState) -> InformationReport {
    let nats = state.information.total;
    let bits = nats / std::f64::consts::LN_2;
    let bits_per_step = bits / (task.steps + 1) as f64;
    InformationReport {
        total_nats: nats,
        total_bits: bits,
        bits_per_step,
        bits_per_second: bits_per_step / task.time_step.resolve::<f64>(phi),
        entropy_form_nats: entropy_form(&state.belief),
        paper_form_nats: paper_form(&state.belief),
        per_step_nats: state.information.per_step.clone(),
    }
}

fn trajectory_report(task: &Task, phi: &[f64], state: &TaskState) -> TrajectoryReport {
    let dt = task.time_step.resolve::<f64>(phi);
    let rows = |matrices: &Matrices| (0..matrices.count()).map(|t| matrices.vector(t).to_vec()).collect();
    let sigma = &state.belief.corrected;
    let feedback = &state.plan.policy.feedback;
    let gains = |t: usize| {
        let row = |a: usize| (0..feedback.cols()).map(|i| feedback.get(t, a, i)).collect();
        (0..feedback.rows()).map(row).collect()
    };
    TrajectoryReport {
        state_names: task.system.state_names(),
        time: (0..=task.steps).map(|t| t as f64 * dt).collect(),
        states: rows(&state.plan.trajectory.states),
        deviations: (0..=task.steps)
            .map(|t| (0..sigma.rows()).map(|i| sigma.get(t, i, i).max(0.0).sqrt()).collect())
            .collect(),
        controls: rows(&state.plan.trajectory.controls),
        feedback: (0..task.steps).map(gains).collect(),
    }
}
