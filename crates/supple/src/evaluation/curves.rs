//! Contact forces, clearances and cost terms over time.

use serde::{Deserialize, Serialize};
use supple_model::followed::FollowedNumber;
use supple_model::{ContactState, Trajectory};

use crate::problem::{Task, TaskAt};
use crate::simulate::Sample;
use crate::touching::contacts_along;

/// A contact over time, along a plan and along the run in closed loop. A run that diverged is shorter.
///
/// ```
/// use supple::EvaluateOptions;
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
/// let problem = supple_file::load(file)?;
/// let options = EvaluateOptions { rollouts: 32, trajectories: true, ..EvaluateOptions::default() };
/// let found = problem.evaluate(&problem.parameters.initial(), &options)?;
/// let task = &found.tasks[0];
/// let trajectory = task.trajectory.as_ref().ok_or("it was requested")?;
/// let (contact, force) = (&trajectory.contacts[0], &trajectory.quantities[0]);
/// assert_eq!((contact.name.as_str(), contact.force.len()), ("wall", 126));
/// assert!(contact.touches.contains(&true), "the plan presses on the wall");
/// assert_eq!((force.unit.as_str(), force.target), ("N", Some(10.0)));
/// let sampled = task.monte_carlo.as_ref().ok_or("there are roll-outs")?;
/// assert_eq!(sampled.touched[0].name, "wall");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ContactCurve {
    /// Its name.
    pub name: String,
    /// Normal force along the plan, N; one number per state.
    #[serde(rename = "force_N")]
    pub force: Vec<f64>,
    /// Clearance along the plan, m; negative where the body is inside.
    pub clearance_m: Vec<f64>,
    /// Whether it touches at each state: see [`ContactState::touches`].
    pub touches: Vec<bool>,
    /// Normal force along the run, N.
    #[serde(rename = "run_force_N")]
    pub run_force: Vec<f64>,
    /// Clearance along the run, m.
    pub run_clearance_m: Vec<f64>,
}

/// A term of the cost along a plan.
///
/// Example: [`Evaluation`](crate::Evaluation).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CostCurve {
    /// Its place among the task's costs, from 1, and its kind: `2 contact_force`.
    pub name: String,
    /// Its contribution at each step, N of them, and at the end.
    pub per_step: Vec<f64>,
}

/// A number over time that a cost weighs, a limit bounds or the task shows.
///
/// Example: [`ContactCurve`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct QuantityCurve {
    /// Its name.
    pub name: String,
    /// Its unit; empty where it is not known.
    pub unit: String,
    /// Where it is declared: `cost 2`, `limit 1`, `curve 3`, counted from 1.
    pub of: String,
    /// The target of a cost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<f64>,
    /// The lower limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower: Option<f64>,
    /// The upper limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper: Option<f64>,
    /// Along the plan: one number per state, or per step where it depends on the control.
    pub values: Vec<f64>,
    /// Along the run in closed loop; shorter where it diverged.
    pub run_values: Vec<f64>,
}

/// The followed numbers of a task.
pub(super) fn quantity_curves(task: &Task, phi: &[f64], plan: &Trajectory, run: &Sample) -> Vec<QuantityCurve> {
    let numbers = task.system.followed(phi);
    let planned = along_plan(task, phi, plan, &numbers);
    let states: Vec<&[f64]> = run.states.iter().map(Vec::as_slice).collect();
    let controls: Vec<&[f64]> = run.controls.iter().map(Vec::as_slice).collect();
    let ran = follow(task.at(phi), &states, &controls, &numbers);
    let finite = |limit: f64| Some(limit).filter(|limit| limit.is_finite());
    let curve = |((number, values), run_values): ((FollowedNumber, Vec<f64>), Vec<f64>)| QuantityCurve {
        name: number.channel.name,
        unit: number.channel.unit,
        of: number.of,
        target: number.target,
        lower: finite(number.limits[0]),
        upper: finite(number.limits[1]),
        values,
        run_values,
    };
    numbers.into_iter().zip(planned).zip(ran).map(curve).collect()
}

fn along_plan(task: &Task, phi: &[f64], plan: &Trajectory, numbers: &[FollowedNumber]) -> Vec<Vec<f64>> {
    let states: Vec<&[f64]> = (0..plan.states.count()).map(|step| plan.states.vector(step)).collect();
    let controls: Vec<&[f64]> = (0..plan.controls.count()).map(|step| plan.controls.vector(step)).collect();
    follow(task.at(phi), &states, &controls, numbers)
}

/// Each quantity over time; without the final state if it depends on the control.
fn follow(
    TaskAt { task, phi }: TaskAt,
    states: &[&[f64]],
    controls: &[&[f64]],
    numbers: &[FollowedNumber],
) -> Vec<Vec<f64>> {
    let mut along = vec![Vec::with_capacity(states.len()); numbers.len()];
    if numbers.is_empty() {
        return along;
    }
    let idle = vec![0.0; task.system.dimensions().controls];
    for (step, x) in states.iter().enumerate() {
        let u = controls.get(step).copied();
        let now = task.system.follow(x, u.unwrap_or(&idle), phi);
        for ((list, value), number) in along.iter_mut().zip(now).zip(numbers) {
            if u.is_some() || !number.depends_on_control {
                list.push(value);
            }
        }
    }
    along
}

/// The contacts of a task, in the order of its model.
pub(super) fn contact_curves(task: &Task, phi: &[f64], plan: &Trajectory, run: &Sample) -> Vec<ContactCurve> {
    let planned = contacts_along(task, phi, (0..plan.states.count()).map(|step| plan.states.vector(step)));
    let ran = contacts_along(task, phi, run.states.iter().map(Vec::as_slice));
    let of = |states: &[ContactState], pick: fn(&ContactState) -> f64| states.iter().map(pick).collect();
    let curve =
        |((name, planned), (_, ran)): ((String, Vec<ContactState>), (String, Vec<ContactState>))| ContactCurve {
            name,
            force: of(&planned, |state| state.force),
            clearance_m: of(&planned, |state| state.clearance),
            touches: planned.iter().map(ContactState::touches).collect(),
            run_force: of(&ran, |state| state.force),
            run_clearance_m: of(&ran, |state| state.clearance),
        };
    planned.into_iter().zip(ran).map(curve).collect()
}

/// The terms of a task's cost along its plan; empty if the system does not tell its terms.
pub(super) fn cost_curves(task: &Task, phi: &[f64], plan: &Trajectory) -> Vec<CostCurve> {
    let names = task.system.cost_names();
    let mut curves: Vec<CostCurve> = names.into_iter().map(|name| CostCurve { name, per_step: Vec::new() }).collect();
    if curves.is_empty() {
        return curves;
    }
    let (steps, idle) = (plan.steps(), vec![0.0; task.system.dimensions().controls]);
    for step in 0..=steps {
        let last = step == steps;
        let u = if last { &idle } else { plan.controls.vector(step) };
        let terms = task.system.cost_terms(plan.states.vector(step), u, phi, last);
        curves.iter_mut().zip(terms).for_each(|(curve, term)| curve.per_step.push(term));
    }
    curves
}
