//! Horizons along plans.

use std::borrow::Cow;

use supple_lqg::bound::Spread;
use supple_lqg::{Horizon, Knots, Noise, Policy, Regularisation, least_cost_rounding, solve_riccati};

use crate::Error;
use crate::plan::{Plan, PlanMode};

/// The horizon of a plan's linearisation. A risk-sensitive plan gives its trajectory only: the prices are those of the law of
/// least expected cost along it.
///
/// # Errors
/// Where there is no such law.
pub fn horizon_of_plan(plan: &Plan, noise: &Noise) -> Result<Horizon, Error> {
    Ok(Horizon::along(&plan.knots, law_of(plan)?.as_ref(), noise, plan.nominal_cost))
}

/// The horizon of a plan whose law is proved.
pub(crate) struct ProvedHorizon {
    pub horizon: Horizon,
    /// How far the least cost and the prices may be off.
    pub spread: Spread,
    /// How far the cost is from one for which the law is optimal; why that is not proved otherwise.
    pub law: Result<f64, String>,
    /// The least cost in double precision.
    pub rounded_least: f64,
}

impl ProvedHorizon {
    /// Whether rounding led to another law in double precision.
    pub fn is_other_law(&self) -> bool {
        let (rounded, least) = (self.rounded_least, self.horizon.base_cost);
        (rounded - least).abs() > SAME_LEAST * rounded.abs().max(least.abs())
    }

    /// What to know where it did.
    pub fn remark(&self) -> Option<String> {
        self.is_other_law().then(|| {
            format!(
                "rounding affects this design's control law: the least cost computed along its plan is {:.7}, and the proved \
                 one {:.7}; bounds and the information needed hold for the proved one, and the cost and information of this \
                 design may be inaccurate",
                self.rounded_least, self.horizon.base_cost
            )
        })
    }
}

/// The horizon of a plan with a law that rounding does not change: that of the plan where it is known not to, and else the
/// proved one.
#[derive(Default)]
pub(crate) struct DespiteRounding {
    /// None where no law is known.
    pub horizon: Option<Horizon>,
    /// What to know about it, for people, where it is not that of the plan.
    pub remark: Option<String>,
}

impl DespiteRounding {
    pub fn of(plan: &Plan, noise: &Noise) -> Self {
        let Ok(law) = law_of(plan) else { return Self::default() };
        let horizon = Horizon::along(&plan.knots, &law, noise, plan.nominal_cost);
        let (least, off) = (horizon.base_cost, least_cost_rounding(&plan.knots, &law, noise));
        if off <= SAME_LEAST * least.abs() {
            return Self { horizon: Some(horizon), remark: None };
        }
        let proved = proved_along(plan, &law, horizon, noise);
        match &proved.law {
            Err(reason) if off > UNSURE * least.abs() => {
                let remark = format!(
                    "rounding may change the least cost along the plan, {least:.7}, by about {off:.1e}, and with it this \
                     design's control law: {reason}. Give every control a price"
                );
                Self { horizon: None, remark: Some(remark) }
            }
            _ => Self { remark: proved.remark(), horizon: Some(proved.horizon) },
        }
    }
}

/// Least costs that rounding may change by more than this, relatively, and that are not proved are doubtful.
const UNSURE: f64 = 1e-6;

/// Least costs closer than this, relatively, are of the same law.
const SAME_LEAST: f64 = 1e-9;

/// The same with the law of least expected cost, computed and proved in as many digits as it takes. Plans in belief space
/// keep their own law, which remarks name.
///
/// # Errors
/// Where there is no law.
pub(crate) fn proved_horizon(plan: &Plan, noise: &Noise) -> Result<ProvedHorizon, Error> {
    let law = law_of(plan)?;
    let rounded = Horizon::along(&plan.knots, &law, noise, plan.nominal_cost);
    Ok(proved_along(plan, &law, rounded, noise))
}

/// The same, given the law and its horizon in double precision.
fn proved_along(plan: &Plan, law: &Policy, rounded: Horizon, noise: &Noise) -> ProvedHorizon {
    let rounded_least = rounded.base_cost;
    let unproved = |law| ProvedHorizon { horizon: rounded, spread: Spread::default(), law, rounded_least };
    if plan.mode == PlanMode::Belief {
        return unproved(Ok(0.0));
    }
    match Horizon::proved(&plan.knots, law, noise, plan.nominal_cost) {
        Err(reason) => unproved(Err(reason)),
        Ok((horizon, spread)) => ProvedHorizon { law: Ok(spread.distance), horizon, spread, rounded_least },
    }
}

/// The law of least expected cost along a plan.
fn law_of(plan: &Plan) -> Result<Cow<'_, Policy>, Error> {
    if plan.mode != PlanMode::Risk {
        return Ok(Cow::Borrowed(&plan.policy));
    }
    let Knots { dimensions, dynamics, cost, .. } = &plan.knots;
    let mut law = Policy::zeros(*dimensions, plan.knots.steps());
    solve_riccati(dynamics, cost, Regularisation::default(), &mut law)
        .map_err(|step| Error::NotPositiveDefinite { what: "the control's curvature", step })?;
    Ok(Cow::Owned(law))
}
