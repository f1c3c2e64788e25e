//! Horizons along plans.

use std::borrow::Cow;

use supple_kernels::Scratch;
use supple_lqg::bound::Spread;
use supple_lqg::{Horizon, Knots, Noise, Policy, Regularisation, least_cost_rounding, solve_riccati};

use crate::Error;
use crate::plan::{Plan, PlanMode, VALID_STATIONARITY};
use crate::problem::Task;

/// The horizon of a plan's linearisation. Of a risk-sensitive plan, only the trajectory is used: the prices are those of
/// the law of least expected cost along it.
///
/// # Errors
/// Where there is no such law.
///
/// ```
/// use supple::bound::horizon_of_plan;
/// use supple::pipeline::TaskState;
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
/// let mut state = TaskState::new(task);
/// state.evaluate(task, &phi, &problem.planning, None)?;
/// let horizon = horizon_of_plan(&state.plan, &state.noise)?;
/// assert!(horizon.base_cost < state.cost.expected(), "what the estimation error costs is left out");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn horizon_of_plan(plan: &Plan, noise: &Noise) -> Result<Horizon, Error> {
    Ok(Horizon::along(&plan.knots, law_of(plan)?.as_ref(), noise, plan.nominal_cost)?)
}

/// The horizon of a plan with a proved control law.
pub(crate) struct ProvedHorizon {
    pub horizon: Horizon,
    /// How far the least cost and the prices may be off.
    pub spread: Spread,
    /// Distance of the cost from one for which the law is optimal; the reason if that is not proved.
    pub law: Result<f64, String>,
    /// The least cost in double precision.
    pub rounded_least: f64,
}

impl ProvedHorizon {
    /// Whether the law in double precision differs from it because of rounding.
    pub fn is_other_law(&self) -> bool {
        let (rounded, least) = (self.rounded_least, self.horizon.base_cost);
        (rounded - least).abs() > SAME_LEAST * rounded.abs().max(least.abs())
    }

    /// A remark for the user if rounding led to a different law.
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

/// A plan's horizon with a law unaffected by rounding: the plan's own law if it is known to be unaffected, otherwise the
/// proved one.
#[derive(Default)]
pub(crate) struct DespiteRounding {
    /// `None` if no law is known.
    pub horizon: Option<Horizon>,
    /// A remark for the user if the plan's own law is not used.
    pub remark: Option<String>,
}

impl DespiteRounding {
    pub fn of(plan: &Plan, noise: &Noise) -> Self {
        let Ok(law) = law_of(plan) else { return Self::default() };
        let Ok(horizon) = Horizon::along(&plan.knots, &law, noise, plan.nominal_cost) else { return Self::default() };
        let (least, off) = (horizon.base_cost, least_cost_rounding(&plan.knots, &law, noise));
        if off <= SAME_LEAST * least.abs() {
            return Self { horizon: Some(horizon), remark: None };
        }
        let proved = proved_along(plan, &law, horizon, noise, 0.0);
        match &proved.law {
            Err(reason) if off > UNSURE * least.abs() => {
                let remark = format!(
                    "rounding may change the least cost along the plan, {}, by about {off:.1e}, and with it this \
                     design's control law: {reason}. Give every control a price, and check that no number is of another order than meant",
                    supple_text::short(least, 7)
                );
                Self { horizon: None, remark: Some(remark) }
            }
            _ => Self { remark: proved.remark(), horizon: Some(proved.horizon) },
        }
    }
}

/// If rounding may change an unproved least cost by more than this share, it is doubtful.
const UNSURE: f64 = 1e-6;

/// Least costs closer than this, relatively, belong to the same law.
const SAME_LEAST: f64 = 1e-9;

/// A plan's horizon with the law of least expected cost, computed and proved with as many digits as necessary. Belief-space
/// plans keep their own law, as remarks state.
///
/// # Errors
/// If there is no such law.
pub(crate) fn proved_horizon(task: &Task, phi: &[f64], plan: &Plan, noise: &Noise) -> Result<ProvedHorizon, Error> {
    let law = law_of(plan)?;
    let rounded = Horizon::along(&plan.knots, &law, noise, plan.nominal_cost)?;
    Ok(proved_along(plan, &law, rounded, noise, nominal_rounding(task, phi, plan)))
}

/// How far the cost of a plan may be from the exact cost of its controls and, if it has converged, from that of the best
/// controls near it: rounding of each cost and of the sum, rounding of each trajectory step weighted by its costate, and
/// the decrease that the next step of the search would achieve.
fn nominal_rounding(task: &Task, phi: &[f64], plan: &Plan) -> f64 {
    let knots = &plan.knots;
    let (n, joint, steps) = (knots.dimensions.states, knots.dimensions.joint(), knots.steps());
    // Each number is a sum of about this many rounded terms.
    let terms = (joint + 4) as f64 * f64::EPSILON;
    let (states, controls) = (&plan.trajectory.states, &plan.trajectory.controls);
    let mut scratch = Scratch::new();
    let (mut sum, mut lost, mut off) = (0.0, 0.0, 0.0);
    for t in 0..=steps {
        let (x, u) = (states.at(t), if t < steps { controls.at(t) } else { &[][..] });
        let cost = match t < steps {
            true => task.system.stage_cost(t, &x[..n], &u[..joint - n], phi, &mut scratch),
            false => task.system.final_cost(&x[..n], phi, &mut scratch),
        };
        // Knuth's two-sum: it yields the rounding error of each addition.
        let next = sum + cost;
        let part = next - sum;
        lost += (sum - (next - part)) + (cost - part);
        sum = next;
        let z = |i: usize| if i < n { x[i].abs() } else { u[i - n].abs() };
        let counted = if t < steps { joint } else { n };
        let mut size = cost.abs();
        for i in 0..counted {
            let curved: f64 = (0..counted).map(|j| knots.cost.get(t, i, j).abs() * z(j)).sum();
            size += z(i) * (knots.cost.get(t, i, joint).abs() + 0.5 * curved);
        }
        off += terms * size;
        if t == steps {
            break;
        }
        for i in 0..n {
            let carried: f64 = (0..joint).map(|j| knots.dynamics.get(t, i, j).abs() * z(j)).sum();
            off += terms * plan.costates.at(t + 1)[i].abs() * (carried + states.at(t + 1)[i].abs());
        }
        let saved = (n..joint).map(|i| {
            let carried: f64 = (0..n).map(|k| knots.dynamics.get(t, k, i) * plan.policy.slope.at(t + 1)[k]).sum();
            -0.5 * (knots.cost.get(t, i, joint) + carried) * plan.policy.feedforward.at(t)[i - n]
        });
        if plan.relative_stationarity <= VALID_STATIONARITY {
            off += saved.sum::<f64>().abs();
        }
    }
    off + (sum + lost - plan.nominal_cost).abs()
}

/// Like [`proved_horizon`], given the law and its horizon in double precision.
fn proved_along(plan: &Plan, law: &Policy, rounded: Horizon, noise: &Noise, nominal_rounding: f64) -> ProvedHorizon {
    let rounded_least = rounded.base_cost;
    let unproved = |law| ProvedHorizon { horizon: rounded, spread: Spread::default(), law, rounded_least };
    if plan.mode == PlanMode::Belief {
        return unproved(Ok(0.0));
    }
    match Horizon::proved(&plan.knots, law, noise, plan.nominal_cost, nominal_rounding) {
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
    solve_riccati(dynamics, cost, Regularisation::default(), &mut law)?;
    Ok(Cow::Owned(law))
}
