//! Horizons along plans.

use supple_lqg::{Horizon, Knots, Noise, Policy, Regularisation, solve_riccati};

use crate::Error;
use crate::plan::{Plan, PlanMode};

/// The horizon of a plan's linearisation. A risk-sensitive plan gives its trajectory only: the prices are those of the law of
/// least expected cost along it.
///
/// # Errors
/// Where there is no such law.
pub fn horizon_of_plan(plan: &Plan, noise: &Noise) -> Result<Horizon, Error> {
    if plan.mode != PlanMode::Risk {
        return Ok(Horizon::along(&plan.knots, &plan.policy, noise, plan.nominal_cost));
    }
    let Knots { dimensions, dynamics, cost, .. } = &plan.knots;
    let mut law = Policy::zeros(*dimensions, plan.knots.steps());
    solve_riccati(dynamics, cost, Regularisation::default(), &mut law)
        .map_err(|step| Error::NotPositiveDefinite { what: "the control's curvature", step })?;
    Ok(Horizon::along(&plan.knots, &law, noise, plan.nominal_cost))
}
