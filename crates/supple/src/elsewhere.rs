//! Roll-outs on a plant that differs from the task's model, alongside roll-outs on the model itself.

use serde::Serialize;
use supple_model::ContactReport;

use crate::branches::{Attempts, plan_at};
use crate::linearisation::Rows;
use crate::pipeline::TaskState;
use crate::plan::PlanStatus;
use crate::problem::{Problem, Task, check_rollouts};
use crate::simulate::{
    BATCH, ClosedLoop, LoopSetting, MonteCarlo, NoiseFactors, Plant, Rollouts, Truth, World, in_batches,
};
use crate::{Error, contact_reports};

/// Roll-outs of one plan, with the result of each.
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
#[derive(Clone, Debug, Serialize)]
pub struct Elsewhere {
    /// How the plan ended.
    pub status: PlanStatus,
    /// Its predicted expected cost.
    pub predicted_cost: f64,
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
            return Err(Error::Shape { what: "the state of the plant".to_owned(), found, expected });
        }
        let mut state = TaskState::new(task);
        plan_at(self, task, phi, None, Attempts::default(), &mut state)?;
        let noise = World { phi, noise: &state.noise }.fixed_noise(task)?;
        let factors = NoiseFactors::of(&noise)?;
        let believed = World { phi, noise: &noise };
        let own = Truth::of(task, phi);
        let there = Truth { system: &*other.task.system, phi: other.phi, plant: Some(other.plant) };
        let predicted = state.cost.expected();
        let runs = |truth: Truth, batch: usize| {
            let setting = LoopSetting { task, plan: &state.plan, believed, truth, factors: &factors, along: None };
            Runs::of(setting, predicted, rollouts, batch)
        };
        Ok(Elsewhere {
            own: runs(own, BATCH)?,
            plant: runs(there, rollouts.count.max(1))?,
            status: state.plan.status,
            predicted_cost: predicted,
            predicted_bits: state.information.total / std::f64::consts::LN_2,
            contacts: contact_reports(task, phi, &state.plan.trajectory),
        })
    }
}

impl Runs {
    fn of(setting: LoopSetting, predicted: f64, rollouts: Rollouts, batch: usize) -> Result<Self, Error> {
        let kept = |closed: ClosedLoop| (closed.outcomes, closed.states.to_rows());
        let (outcomes, last_states): (Vec<_>, Vec<_>) = in_batches(setting, rollouts, batch, kept)?.into_iter().unzip();
        let mut together = MonteCarlo::of(setting.task, outcomes.concat(), predicted, rollouts.seed);
        let costs = std::mem::take(&mut together.costs);
        Ok(Self { together, costs, last_states: last_states.concat() })
    }
}
