//! Information that a design's own sensors deliver and its controller uses.

use supple_lqg::bound::{Stationary, own_rates};
use supple_lqg::control_information;

use crate::Error;
use crate::evaluation::PlanCheck;
use crate::horizon::ProvedHorizon;
use crate::pipeline::TaskState;
use crate::plan::{PlanMode, PlanStatus};
use crate::problem::Task;

/// The design itself, with its own sensors.
pub(super) struct Own {
    /// How its plan ended.
    pub status: PlanStatus,
    /// Its expected cost; `None` if its filter has no steady state.
    pub cost: Option<f64>,
    /// The part due to uncertainty about the state; `None` if the prices belong to another control law.
    pub price: Option<f64>,
    /// Nats at each control.
    pub control: Option<Vec<f64>>,
    /// Nats at each measurement that is followed by a control.
    pub measurement: Option<Vec<f64>>,
    /// Nats of the last measurement, which no control follows.
    pub last_measurement: Option<f64>,
    /// Remarks about its plan, for the user.
    pub remarks: Vec<String>,
    /// What speaks against its plan; `None` in a steady state, which has none.
    pub check: Option<PlanCheck>,
}

impl Own {
    /// The design along its plan, given the horizon with the optimal law.
    ///
    /// # Errors
    /// Where `V` is not positive definite.
    pub fn over_horizon(
        task: &Task,
        state: &TaskState,
        proved: &ProvedHorizon,
        check: PlanCheck,
    ) -> Result<Self, Error> {
        let control = control_information(&state.plan.knots, &state.plan.policy, &state.belief, &state.noise)?;
        let (last, before) =
            state.information.per_step.split_last().map_or((None, &[][..]), |(last, before)| (Some(*last), before));
        let mut remarks = plan_remarks(state, proved);
        let held = state.plan.policy.clamped.iter().filter(|&&held| held).count();
        if held > 0 {
            let all = task.steps * state.plan.knots.dimensions.controls;
            remarks.push(format!(
                "{held} of {all} controls are at a limit along the plan; all bounds are for controllers that keep them there"
            ));
        }
        remarks.extend(proved.remark());
        let is_optimal = state.plan.mode != PlanMode::Risk && !proved.is_other_law();
        // Rounding of the least cost along the plan adds to the design's price.
        let lost = (proved.rounded_least - proved.horizon.base_cost).max(0.0);
        Ok(Self {
            status: state.plan.status,
            cost: Some(state.cost.expected()),
            price: is_optimal.then_some(state.cost.belief + lost),
            control: Some(control),
            measurement: Some(before.to_vec()),
            last_measurement: last,
            remarks,
            check: Some(check),
        })
    }

    /// The design in steady state.
    ///
    /// # Errors
    /// Where `V` is not positive definite.
    pub fn steady(problem: &Stationary, task: &Task, state: &TaskState) -> Result<Self, Error> {
        let steady = own_rates(problem, &state.plan.knots, &state.noise)?;
        let mut remarks = Vec::new();
        if task.control_bounds.is_some() {
            remarks.push("control limits are ignored: the steady state assumes unlimited controls".into());
        }
        match &steady {
            None => remarks.push(
                "the filter of the design has no steady state: the state is not detectable with its sensors".to_owned(),
            ),
            Some(steady) if steady.control_nats.is_none() => {
                remarks.push("the used information does not converge to a steady value".to_owned());
            }
            Some(_) => {}
        }
        Ok(Self {
            status: state.plan.status,
            cost: steady.as_ref().map(|steady| problem.base_cost + steady.price),
            price: steady.as_ref().map(|steady| steady.price),
            control: steady.as_ref().and_then(|steady| steady.control_nats).map(|nats| vec![nats]),
            measurement: steady.as_ref().map(|steady| vec![steady.measurement_nats]),
            last_measurement: None,
            remarks,
            check: None,
        })
    }
}

/// Remarks on a plan for which the linearisation is not a full description.
fn plan_remarks(state: &TaskState, proved: &ProvedHorizon) -> Vec<String> {
    let plan = &state.plan;
    if plan.status == PlanStatus::Indefinite {
        let what = if proved.law.is_ok() {
            "the curvature in the controls was indefinite along the plan by rounding, and was regularised: the bounds hold for \
             the optimal law, this design's cost and information for the regularised one"
        } else {
            "the curvature in the controls is indefinite along the plan and was regularised; the bounds hold for the regularised \
             law, not for the task"
        };
        return vec![what.to_owned()];
    }
    if plan.mode == PlanMode::Belief {
        let what = "the plan is one of least expected cost with this design's sensors: the bounds are for fluctuations about it, \
                    and leave out what other sensors would save by another plan";
        return vec![what.to_owned()];
    }
    if plan.mode == PlanMode::Risk {
        let what = "the plan weighs risk: the minimum is over all laws along its trajectory, and this design's own law does not aim \
                    at the least expected cost";
        return vec![what.to_owned()];
    }
    if !plan.status.is_converged() || plan.relative_stationarity > crate::plan::VALID_STATIONARITY {
        return vec![format!(
            "the plan is not stationary ({:.1e}): the bounds hold for fluctuations about it, whose expected cost leaves out what \
             a better plan would save",
            plan.relative_stationarity
        )];
    }
    Vec::new()
}
