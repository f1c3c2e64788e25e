use serde::{Deserialize, Serialize};
use supple_model::Channel;

use crate::plan::Plan;
use crate::problem::Task;

/// A limit that a plan keeps and is held at: without it, another plan would cost less.
///
/// ```
/// use supple::EvaluateOptions;
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
/// #     limits = [{ kind = "control", lower = -3.0, enforce = true }]
/// # "#;
///
/// // The task of the front page with `limits = [{ kind = "control", lower = -3.0, enforce = true }]`.
/// let problem = supple_file::parse(task, "balance.toml")?;
/// let found = problem.evaluate(&problem.parameters.initial(), &EvaluateOptions::default())?;
/// let reached = &found.tasks[0].limits_reached[0];
/// assert_eq!((reached.step, reached.limit, reached.upper), (0, -3.0, false));
/// assert!(reached.price > 0.0, "without the limit, the plan would begin with a control of about -3.9");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct LimitReached {
    /// What is limited.
    pub name: String,
    /// Its unit; empty where there is none.
    #[serde(default)]
    pub unit: String,
    /// The limit.
    pub limit: f64,
    /// Whether it is an upper limit; otherwise it is a lower one.
    pub upper: bool,
    /// The first step at which the plan is held there.
    pub step: usize,
    /// Number of steps at which the plan is held there.
    pub steps: usize,
    /// Decrease in nominal cost per unit by which the limit is widened: the sum of its multipliers.
    pub price: f64,
}

/// The limits that a plan is held at, in their order: bounds of the controls, then limits of quantities.
pub(super) fn limits_reached(task: &Task, phi: &[f64], plan: &Plan) -> Vec<LimitReached> {
    let mut reached = bounds_reached(task, plan);
    reached.extend(quantities_reached(task, phi, plan));
    reached
}

fn bounds_reached(task: &Task, plan: &Plan) -> Vec<LimitReached> {
    let Some(bounds) = &task.control_bounds else { return Vec::new() };
    let channels = task.system.channels().controls;
    let sides = channels.iter().enumerate().flat_map(|(a, channel)| [(a, channel, false), (a, channel, true)]);
    let reached = sides.filter_map(|(a, channel, upper)| {
        let limit = if upper { bounds.upper()[a] } else { bounds.lower()[a] };
        // The cost would fall beyond the limit.
        let price = |t: usize| if upper { -plan.control_slopes.vector(t)[a] } else { plan.control_slopes.vector(t)[a] };
        let is_held = |&t: &usize| {
            let is_there = plan.trajectory.controls.vector(t)[a] == limit;
            is_there && plan.policy.clamped[t * channels.len() + a] && price(t) > 0.0
        };
        let held: Vec<usize> = (0..task.steps).filter(is_held).collect();
        let price = held.iter().map(|&t| price(t)).sum();
        let (Channel { name, unit }, steps) = (channel.clone(), held.len());
        held.first().map(|&step| LimitReached { name, unit, limit, upper, step, steps, price })
    });
    reached.collect()
}

fn quantities_reached(task: &Task, phi: &[f64], plan: &Plan) -> Vec<LimitReached> {
    let Some(limits) = task.system.constraints().filter(|_| plan.is_at_limits()) else { return Vec::new() };
    let ends = limits.ends().into_iter().zip(limits.bounds(phi)).enumerate();
    let reached = ends.filter_map(|(index, (end, limit))| {
        let prices = (0..plan.multipliers.count()).map(|step| (step, plan.multipliers.vector(step)[index]));
        let held: Vec<(usize, f64)> = prices.filter(|(_, price)| *price > 0.0).collect();
        let (Channel { name, unit }, upper, steps) = (end.channel, end.upper, held.len());
        let price = held.iter().map(|(_, price)| price).sum();
        held.first().map(|&(step, _)| LimitReached { name, unit, limit, upper, step, steps, price })
    });
    reached.collect()
}
