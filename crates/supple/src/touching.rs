//! How a plan touches things: every contact of the model along the nominal trajectory.

use supple_model::{ContactReport, ContactState, Trajectory, WantedForce};

use crate::problem::Task;
use supple_text::short;

/// Each contact of a task at every state, in the order of the model.
pub fn contacts_along<'a>(
    task: &Task,
    phi: &[f64],
    states: impl Iterator<Item = &'a [f64]>,
) -> Vec<(String, Vec<ContactState>)> {
    let mut along: Vec<_> = task.system.contacts().into_iter().map(|contact| (contact.name, Vec::new())).collect();
    if !along.is_empty() {
        for x in states {
            let now = task.system.contact_states(x, phi);
            along.iter_mut().zip(now).for_each(|((_, list), now)| list.push(now));
        }
    }
    along
}

/// The contacts of a task along a trajectory at `phi`, in the order of the model.
#[must_use]
pub fn contact_reports(task: &Task, phi: &[f64], trajectory: &Trajectory) -> Vec<ContactReport> {
    let states = (0..trajectory.states.count()).map(|step| trajectory.states.vector(step));
    let time_step = task.time_step.resolve::<f64>(phi);
    let along = contacts_along(task, phi, states);
    along.into_iter().map(|(name, states)| ContactReport::of(name, &states, time_step)).collect()
}

/// A warning for each cost that wants a force from a contact that the plan never touches, given the reports of all
/// contacts.
#[must_use]
pub fn contact_warnings(task: &Task, phi: &[f64], reports: &[ContactReport]) -> Vec<String> {
    let missed = |wanted: WantedForce| {
        let report = reports.get(wanted.contact).filter(|report| !report.touches)?;
        let WantedForce { cost, kind, target, .. } = wanted;
        Some(format!(
            "task `{}`: the plan never makes contact with `{}`, but cost {} ({kind}) tracks a force of {} N there; the minimum clearance is {} m; raise the weight of this cost, add a `penetration` cost that pulls the plan there, or give an \
             `initial_control` that reaches it",
            task.name,
            report.name,
            cost + 1,
            short(target, 3),
            short(report.least_clearance_m, 3),
        ))
    };
    task.system.wanted_forces(phi).into_iter().filter_map(missed).collect()
}

/// Whether a trajectory never touches a contact from which a cost wants a force.
#[must_use]
pub fn misses_contact(task: &Task, phi: &[f64], trajectory: &Trajectory) -> bool {
    let mut missing: Vec<usize> = task.system.wanted_forces(phi).into_iter().map(|wanted| wanted.contact).collect();
    for step in 0..trajectory.states.count() {
        if missing.is_empty() {
            break;
        }
        let states = task.system.contact_states(trajectory.states.vector(step), phi);
        missing.retain(|&contact| !states.get(contact).is_some_and(ContactState::touches));
    }
    !missing.is_empty()
}
