//! Contacts along a plan: every contact of the model along the nominal trajectory.

use supple_model::{Contact, ContactReport, ContactState, Trajectory, WantedDepth, WantedForce};

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
///
/// ```
/// use supple::{Matrices, contact_reports, contact_warnings, misses_contact};
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
/// let problem = supple_file::load(file)?;
/// let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
///
/// // Without controls, the masses stay 0.75 m in front of the wall.
/// let still = task.simulate(&phi, None, Matrices::vectors(task.steps, 1))?;
/// let reports = contact_reports(task, &phi, &still);
/// assert!(!reports[0].touches && misses_contact(task, &phi, &still));
/// assert_eq!(contact_warnings(task, &phi, &reports).len(), 1, "a cost tracks 10 N");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn contact_reports(task: &Task, phi: &[f64], trajectory: &Trajectory) -> Vec<ContactReport> {
    let states = (0..trajectory.states.count()).map(|step| trajectory.states.vector(step));
    let time_step = task.time_step.resolve::<f64>(phi);
    let along = contacts_along(task, phi, states);
    along.into_iter().map(|(name, states)| ContactReport::of(name, &states, time_step)).collect()
}

/// Below this share of the force that a cost tracks, the wall is only grazed.
const GRAZING: f64 = 0.1;

/// A warning for each cost that tracks a force or a depth at a contact that the plan never makes, or only grazes, or that none
/// could have, given the reports of all contacts; and one for each contact that is deep inside its wall at the start.
///
/// Example: [`contact_reports`].
#[must_use]
pub fn contact_warnings(task: &Task, phi: &[f64], reports: &[ContactReport]) -> Vec<String> {
    let contacts = task.system.contacts();
    if contacts.is_empty() {
        return Vec::new();
    }
    let missed = |wanted: &WantedForce| {
        let report = reports.get(wanted.contact)?;
        let &WantedForce { cost, kind, target, .. } = wanted;
        if report.touches && target >= 0.0 {
            return (report.peak_force < GRAZING * target).then(|| {
                format!(
                    "task `{}`: cost {} ({kind}) tracks a force of {} N at `{}`, but the plan presses with at most {} N; raise the weight \
                     of this cost, or give an `initial_control` that presses",
                    task.name,
                    cost + 1,
                    short(target, 3),
                    report.name,
                    short(report.peak_force, 3),
                )
            });
        }
        if target < 0.0 {
            return Some(format!(
                "task `{}`: cost {} ({kind}) tracks a force of {} N at `{}`, but contacts only push: its target must be at least 0",
                task.name,
                cost + 1,
                short(target, 3),
                report.name,
            ));
        }
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
    let wanted = task.system.wanted_forces(phi);
    let start = task.system.contact_states(&task.first_state(phi), phi);
    let mut warnings: Vec<String> = wanted.iter().filter_map(missed).collect();
    warnings.extend(apart_warnings(task, phi, &wanted, reports));
    warnings.extend(deep_warnings(task, &contacts, &start, &wanted, reports));
    warnings.extend(sunk_warnings(task, &start, reports));
    warnings
}

/// A warning for each cost that asks for a surface, or a depth inside, which the plan never reaches; not where a cost wants a
/// force, which is told already.
fn apart_warnings(task: &Task, phi: &[f64], forces: &[WantedForce], reports: &[ContactReport]) -> Vec<String> {
    let missed = |wanted: WantedDepth| {
        if forces.iter().any(|force| force.contact == wanted.contact) {
            return None;
        }
        let report = reports.get(wanted.contact).filter(|report| !report.touches)?;
        let WantedDepth { cost, kind, depth, .. } = wanted;
        let place = if depth > 0.0 { format!("{} m inside", short(depth, 3)) } else { "at its surface".to_owned() };
        Some(format!(
            "task `{}`: the plan never makes contact with `{}`, but cost {} ({kind}) asks for a place {place}; the minimum clearance is \
             {} m; raise the weight of this cost, give the motion more time, or give an `initial_control` that reaches it",
            task.name,
            report.name,
            cost + 1,
            short(report.least_clearance_m, 3),
        ))
    };
    task.system.wanted_depths(phi).into_iter().filter_map(missed).collect()
}

/// At the start, a contact is considered a mistake if it is deeper than `DEEP` times its smoothing and its force exceeds
/// `MORE` times the force that a cost tracks there, or if its force exceeds `FAR_MORE` times that at any depth. It is none
/// if the plan keeps that force up: the contact then carries a weight.
const DEEP: f64 = 5.0;
const MORE: f64 = 2.0;
const FAR_MORE: f64 = 10.0;

/// A warning for each contact that is deep inside its wall at the start.
fn deep_warnings(
    task: &Task,
    contacts: &[Contact],
    start: &[ContactState],
    wanted: &[WantedForce],
    reports: &[ContactReport],
) -> Vec<String> {
    let deep = |(contact, state): (usize, &ContactState)| {
        let name = &contacts.get(contact)?.name;
        let targets = wanted.iter().filter(|wanted| wanted.contact == contact).map(|wanted| wanted.target);
        let target = targets.fold(0.0, f64::max);
        let kept = reports.get(contact).map_or(0.0, |report| report.mean_force * report.share_of_time);
        if target == 0.0 && state.force <= MORE * kept {
            return None;
        }
        let depth = -state.clearance;
        let is_deep = state.smoothing > 0.0 && depth > DEEP * state.smoothing && state.force > MORE * target;
        let is_strong = target > 0.0 && state.force > FAR_MORE * target;
        (is_deep || is_strong).then(|| {
            let than =
                if target > 0.0 { format!(", where a cost tracks {} N", short(target, 3)) } else { String::new() };
            if depth < 0.0 {
                return format!(
                    "task `{}`: at the start, contact `{name}` exerts {} N{than}, {} m away from its wall: its `smoothing`, {} m, is \
                     too long",
                    task.name,
                    short(state.force, 3),
                    short(-depth, 3),
                    short(state.smoothing, 3),
                );
            }
            format!(
                "task `{}`: at the start, contact `{name}` is {} m inside its wall and exerts {} N{than}; check \
                 `initial_state`, and the `point` and the direction of the `normal` of the wall",
                task.name,
                short(depth, 3),
                short(state.force, 3),
            )
        })
    };
    start.iter().enumerate().filter_map(deep).collect()
}

/// A warning for each contact whose body sinks into the wall by more than its radius along the plan: its centre is beyond the
/// surface.
fn sunk_warnings(task: &Task, start: &[ContactState], reports: &[ContactReport]) -> Vec<String> {
    let sunk = |(state, report): (&ContactState, &ContactReport)| {
        let depth = -report.least_clearance_m;
        (state.radius > 0.0 && depth > state.radius).then(|| {
            format!(
                "task `{}`: contact `{}` sinks {} m into its wall, by more than its radius of {} m; raise its `stiffness`, or check \
                 `initial_state`, and the `point` and the direction of the `normal` of the wall",
                task.name,
                report.name,
                short(depth, 3),
                short(state.radius, 3),
            )
        })
    };
    start.iter().zip(reports).filter_map(sunk).collect()
}

/// Whether a trajectory never makes some contact at which a cost tracks a force.
///
/// Example: [`contact_reports`].
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
