//! Roll-outs on a plant that differs from the task's model, alongside roll-outs on the model itself.

use serde::Serialize;
use supple_model::ContactReport;

use crate::branches::{Attempts, plan_at};
use crate::linearisation::Rows;
use crate::pipeline::TaskState;
use crate::plan::PlanStatus;
use crate::problem::{Problem, Task, TaskAt, check_rollouts};
use crate::simulate::{
    BATCH, ClosedLoop, LoopSetting, MonteCarlo, Motion, NoiseFactors, Plant, Rollouts, Truth, Watch, World, in_batches,
};
use crate::{Error, contact_reports};

/// Roll-outs of one plan, with the result of each.
///
/// Example: [`Elsewhere`].
#[derive(Clone, Debug, Serialize)]
pub struct Runs {
    /// Statistics of all of them.
    #[serde(flatten)]
    pub together: MonteCarlo,
    /// Cost of each; infinite where it diverged.
    pub costs: Vec<f64>,
    /// Last true state of each, vectors of length n; meaningless if it diverged.
    pub last_states: Rows,
}

/// A plan in closed loop on a plant and, under the same noise, on the task's own model.
///
/// ```
/// use supple::simulate::Rollouts;
/// use supple::{Matrices, Other};
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
///
/// // A plant with a steeper hill: x'' = 1.2 x + u.
/// let plant = |_: usize, states: &Matrices, controls: &Matrices, next: &mut Matrices| {
///     for i in 0..states.count() {
///         let (x, u) = (states.vector(i), controls.vector(i));
///         let to = next.vector_mut(i);
///         (to[0], to[1]) = (x[0] + 0.1 * x[1], 0.12 * x[0] + x[1] + 0.1 * u[0]);
///     }
/// };
/// let other = Other { task, phi: &phi, plant: &plant };
/// let found = problem.roll_out_elsewhere(&phi, "balance", other, Rollouts { count: 50, seed: 1 })?;
/// assert_eq!((found.own.costs.len(), found.plant.costs.len()), (50, 50));
/// assert!(found.plant.together.cost_mean > found.own.together.cost_mean);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Elsewhere {
    /// How the plan ended.
    pub status: PlanStatus,
    /// Its predicted expected cost.
    pub predicted_cost: f64,
    /// The cost limit of the task, if it has one.
    pub limit: Option<f64>,
    /// Its predicted information, in bits.
    pub predicted_bits: f64,
    /// Its contacts.
    pub contacts: Vec<ContactReport>,
    /// On the task's own model.
    pub own: Runs,
    /// On the plant.
    pub plant: Runs,
}

/// The true system elsewhere: measurements, costs and contacts from a task with the same states, controls, measurements
/// and contacts; motion from a plant.
///
/// Example: [`Elsewhere`].
#[derive(Clone, Copy)]
pub struct Other<'a> {
    /// The task; its noise and the targets of its costs are those of the rolled-out task unless they were changed.
    pub task: &'a Task,
    /// All its parameters.
    pub phi: &'a [f64],
    /// The dynamics: the next state.
    pub plant: Plant<'a>,
}

impl Problem {
    /// Plans the named task at a design, and runs the plan with an extended Kalman filter on its own model and elsewhere,
    /// under the noise of the design. Sample i draws from stream i of the seed. The plant is called on one thread, with
    /// all samples at once.
    ///
    /// # Errors
    /// If there is no such task, the other task has a different size, a number is not finite, or a covariance is indefinite.
    pub fn roll_out_elsewhere(
        &self,
        phi: &[f64],
        name: &str,
        other: Other,
        rollouts: Rollouts,
    ) -> Result<Elsewhere, Error> {
        self.check_design(phi)?;
        check_rollouts(rollouts.count)?;
        let task = self.task(name)?;
        let (found, expected) = (other.task.system.dimensions().states, task.system.dimensions().states);
        if found != expected {
            return Err(Error::shape("the state of the plant".to_owned(), found, expected));
        }
        let mut state = TaskState::new(task);
        plan_at(self, task, phi, None, Attempts::default(), &mut state)?;
        let noise = World { phi, noise: &state.noise }.fixed_noise(task)?;
        let factors = NoiseFactors::of(&noise)?;
        let believed = World { phi, noise: &noise };
        let own = Truth::of(task, phi);
        let there = Truth { system: &*other.task.system, phi: other.phi, motion: Motion::Plant(other.plant) };
        let predicted = state.cost.expected();
        let plan = &state.plan;
        // What is planned is planned by the task's own model.
        let planned = Watch::of(task.at(phi), &plan.trajectory);
        let runs = |truth: Truth, task_there: TaskAt, batch: usize| {
            let watch = Watch::of(task_there, &plan.trajectory).planned_by(&planned);
            let factors = &factors;
            let setting = LoopSetting { task, plan, believed, truth, factors, along: None, watch: Some(&watch) };
            Runs::of(setting, predicted, rollouts, batch)
        };
        Ok(Elsewhere {
            own: runs(own, task.at(phi), BATCH)?,
            plant: runs(there, other.task.at(other.phi), rollouts.count.max(1))?,
            status: state.plan.status,
            predicted_cost: predicted,
            limit: task.bound.as_ref().map(|bound| bound.resolve(phi)),
            predicted_bits: state.information.total / std::f64::consts::LN_2,
            contacts: contact_reports(task, phi, &state.plan.trajectory),
        })
    }
}

impl Runs {
    fn of(setting: LoopSetting, predicted: f64, rollouts: Rollouts, batch: usize) -> Result<Self, Error> {
        let kept = |closed: ClosedLoop| (closed.outcomes, closed.states.to_rows());
        let (outcomes, last_states): (Vec<_>, Vec<_>) = in_batches(setting, rollouts, batch, kept)?.into_iter().unzip();
        let mut together = MonteCarlo::of(setting, outcomes.concat(), predicted, rollouts.seed);
        let costs = std::mem::take(&mut together.costs);
        Ok(Self { together, costs, last_states: last_states.concat() })
    }
}
