//! Expected costs of a task with the precise and with the coarsest sensor, and a cost limit between them.

use supple::design::{Attempts, plan_at};
use supple::pipeline::TaskState;
use supple::{LimitViolation, Matrices, Problem, limits_violated};

use super::rules::four_digits;
use super::templates::Limit;

/// Number of stiffnesses, besides that of the stiff mount, at which costs are computed.
const SOFTER: usize = 4;

/// Expected costs over stiffnesses of the mount.
pub struct Costs {
    /// With the stiff mount and the precise sensor.
    pub stiff: f64,
    /// The least with the precise sensor.
    pub precise: f64,
    /// The stiffness at which `precise` is reached, N/m.
    pub best: f64,
    /// The least with the coarsest sensor.
    pub coarse: f64,
    /// The softest mount, N/m, and a limit of the robot that its plan exceeds, if any.
    pub softest: Option<(f64, LimitViolation)>,
}

impl Costs {
    /// Costs at several stiffnesses; infinite if no plan converges. `controls`, if given, warm-start the first plan.
    pub fn of(problem: &Problem, stiff: &[f64], controls: Option<&Matrices>) -> Self {
        let index = |name: &str| problem.parameters.iter().position(|parameter| parameter.name == name);
        let sensor = ["force_noise", "joint_noise"].into_iter().find_map(index);
        let none = f64::INFINITY;
        let mut found = Self { stiff: none, precise: none, best: f64::NAN, coarse: none, softest: None };
        let (Some(sensor), Some(k)) = (sensor, index("k")) else { return found };
        let [soft, most] = problem.parameters.get(k).bounds;
        let [precise, coarse] = problem.parameters.get(sensor).bounds;
        let task = &problem.tasks[0];
        // Noise does not change the plan, and the plan at the previous stiffness is a good warm start.
        let mut before = controls.cloned();
        let mut costs = |stiffness: f64| {
            let (mut phi, mut state) = (stiff.to_vec(), TaskState::new(task));
            (phi[k], phi[sensor]) = (stiffness, precise);
            let mut plans = |controls: Option<&Matrices>| {
                let planned = plan_at(problem, task, &phi, controls, Attempts::default(), &mut state);
                planned.is_ok() && state.plan.status.is_converged()
            };
            if !before.as_ref().is_some_and(|before| plans(Some(before))) && !plans(None) {
                return ([f64::INFINITY; 2], None);
            }
            let violated = limits_violated(&task.system.limits(), &task.system.channels(), &state.plan.trajectory)
                .into_iter()
                .next();
            before = Some(state.plan.trajectory.controls.clone());
            let with = state.cost.expected();
            phi[sensor] = coarse;
            let without = state.assess(task, &phi).map_or(f64::INFINITY, |()| state.cost.expected());
            ([with, without], violated)
        };
        for place in 0..=SOFTER {
            let stiffness = four_digits(most * (soft / most).powf(place as f64 / SOFTER as f64));
            let ([with, without], violated) = costs(stiffness);
            found.softest = violated.map(|limit| (stiffness, limit));
            if place == 0 {
                found.stiff = with;
            }
            if with < found.precise {
                (found.precise, found.best) = (with, stiffness);
            }
            found.coarse = found.coarse.min(without);
        }
        found
    }
}

/// The limit of the cost: a share of the way from the cost with the precise sensor to the cost with the coarsest one,
/// rounded up to a hundredth of the way.
pub fn limit(precise: f64, coarse: f64, margin: f64) -> Limit {
    let precise = if precise.is_finite() { precise } else { 1.0 };
    let way = if coarse.is_finite() { (coarse - precise).max(0.02 * precise) } else { precise };
    let unit = 10.0_f64.powf((0.01 * way).max(1e-12).log10().floor());
    let bound = ((precise + margin * way) / unit).ceil() * unit;
    Limit { bound: supple_text::significant(bound, 7), precise, coarse }
}
