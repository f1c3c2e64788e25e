//! Contacts of models, at one state and along a plan.

use serde::{Deserialize, Serialize};

use crate::lenient::or_nan;
use crate::trajectory::time_of;

/// A contact of a model.
///
/// Example: [`ContactReport`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contact {
    /// Its name.
    pub name: String,
    /// Index of its normal force among the model's signals, by which costs refer to it; `None` if it has no such signal.
    pub force_signal: Option<usize>,
    /// Indices of the components of its total force among them.
    pub component_signals: Vec<usize>,
    /// Index of its depth among them.
    pub depth_signal: Option<usize>,
}

impl Contact {
    /// The normal force, N, that a target of one of its signals asks for: a component of the force needs contact whatever its
    /// sign. `None` for signals that are not forces of it.
    #[must_use]
    pub fn force_for(&self, signal: usize, target: f64) -> Option<f64> {
        match self.force_signal == Some(signal) {
            true => Some(target),
            false => self.component_signals.contains(&signal).then_some(target.abs()),
        }
    }
}

/// A contact at one state. It does not depend on controls.
///
/// Example: [`ContactReport`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactState {
    /// Normal force, N; positive if it pushes.
    pub force: f64,
    /// Distance from the surface, m; if the body penetrates, minus the depth of penetration.
    pub clearance: f64,
    /// Distance over which the contact force builds up, m; 0 for a hard switch.
    pub smoothing: f64,
    /// Stiffness, N/m.
    pub stiffness: f64,
    /// Radius of the body that touches, m; 0 for a point.
    pub radius: f64,
    /// The total force, including friction, in the axes of the world, N.
    pub total_force: [f64; 3],
}

/// A contact touches above this fraction of `stiffness smoothing`, the force at a depth of one smoothing length.
///
/// Example: the contact in [`ContactReport`] touches, as its force exceeds this fraction.
pub const NEGLIGIBLE_FORCE: f64 = 1e-6;

impl ContactState {
    /// Whether it touches: the clearance is below one smoothing length, and the normal force exceeds
    /// [`NEGLIGIBLE_FORCE`] times `stiffness smoothing`.
    #[must_use]
    pub fn touches(&self) -> bool {
        self.clearance < self.smoothing && self.force > NEGLIGIBLE_FORCE * self.stiffness * self.smoothing
    }

    /// Whether it is separated from the surface: the clearance exceeds one smoothing length.
    #[must_use]
    pub fn is_apart(&self) -> bool {
        self.clearance > self.smoothing
    }

    fn total(&self) -> f64 {
        self.total_force.iter().map(|entry| entry * entry).sum::<f64>().sqrt()
    }
}

/// A contact force that a cost requests with a non-zero target.
///
/// ```
/// use supple_model::TwoMass;
/// use supple_model::cost::Cost;
/// use supple_model::quantity::ContactForce;
/// use supple_model::system::{Authored, System};
///
/// let model = TwoMass {
///     mass: [0.8.into(), 0.4.into()],
///     damping: [60.0.into(), 35.0.into()],
///     stiffness: [300.0.into(), 200.0.into()],
///     contact_smoothing: 0.0.into(),
/// };
/// let costs = vec![Cost::new(ContactForce::new(0), 0.05).with_targets([10.0])];
/// let wanted = Authored::new(model, costs, 0.02, 0).wanted_forces(&[]);
/// assert_eq!((wanted[0].kind, wanted[0].contact, wanted[0].target), ("contact_force", 0, 10.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WantedForce {
    /// Index of the cost among those of the task, from 0.
    pub cost: usize,
    /// Kind of the cost, as files write it.
    pub kind: &'static str,
    /// Index of the contact among those of the model.
    pub contact: usize,
    /// The target, N.
    pub target: f64,
}

/// A depth of a contact, at the surface or inside, that a cost requests.
///
/// ```
/// use supple_model::TwoMass;
/// use supple_model::cost::Cost;
/// use supple_model::quantity::Penetration;
/// use supple_model::system::{Authored, System};
///
/// let model = TwoMass {
///     mass: [0.8.into(), 0.4.into()],
///     damping: [60.0.into(), 35.0.into()],
///     stiffness: [300.0.into(), 200.0.into()],
///     contact_smoothing: 0.0.into(),
/// };
/// let costs = vec![Cost::new(Penetration::new(1), 0.05)];
/// let wanted = Authored::new(model, costs, 0.02, 0).wanted_depths(&[]);
/// assert_eq!((wanted[0].kind, wanted[0].contact, wanted[0].depth), ("penetration", 0, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WantedDepth {
    /// Index of the cost among those of the task, from 0.
    pub cost: usize,
    /// Kind of the cost, as files write it.
    pub kind: &'static str,
    /// Index of the contact among those of the model.
    pub contact: usize,
    /// The depth, m, at least 0.
    pub depth: f64,
}

/// A contact along the nominal trajectory, states 0 to N.
///
/// ```
/// use supple_model::{ContactReport, Model, Point, TwoMass};
///
/// let model = TwoMass {
///     mass: [0.8.into(), 0.4.into()],
///     damping: [60.0.into(), 35.0.into()],
///     stiffness: [300.0.into(), 200.0.into()],
///     contact_smoothing: 0.0.into(),
/// };
/// // The wall is at 0.75 m; the second mass is 0.05 m in front of it, and then 0.02 m inside.
/// let states = [0.70, 0.77].map(|x2| {
///     let at = Point { x: &[0.0, 0.0, x2, 0.0, 0.75], u: &[0.0], phi: &[], time_step: 0.02, w: &[] };
///     model.contact_states(&at)[0]
/// });
/// let report = ContactReport::of(model.contacts()[0].name.clone(), &states, 0.02);
/// assert_eq!((report.name.as_str(), report.touches, report.first_s), ("wall", true, Some(0.02)));
/// assert!((report.peak_force - 4.0).abs() < 1e-9, "200 N/m times 0.02 m");
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactReport {
    /// Its name.
    pub name: String,
    /// Whether it touches at any step: see [`ContactState::touches`].
    pub touches: bool,
    /// Time of the first step at which it touches, s; `None` if it never does.
    pub first_s: Option<f64>,
    /// Time of the last step at which it touches, s; `None` if it never does.
    pub last_s: Option<f64>,
    /// Fraction of the N + 1 steps at which it touches.
    #[serde(deserialize_with = "or_nan")]
    pub share_of_time: f64,
    /// The greatest normal force over the steps at which it touches, N; 0 if it never does.
    #[serde(rename = "peak_force_N", deserialize_with = "or_nan")]
    pub peak_force: f64,
    /// The mean normal force over the steps at which it touches, N; 0 where it never does.
    #[serde(rename = "mean_force_N", deserialize_with = "or_nan")]
    pub mean_force: f64,
    /// The least clearance, m; if the body penetrates, minus the greatest depth of penetration.
    #[serde(deserialize_with = "or_nan")]
    pub least_clearance_m: f64,
    /// The greatest norm of the total force over steps with a clearance of more than one smoothing length, N; 0 if there
    /// are none. It is 0 for contact laws without force at a distance.
    #[serde(rename = "greatest_force_apart_N", deserialize_with = "or_nan")]
    pub greatest_force_apart: f64,
}

impl ContactReport {
    /// The report for a contact whose states are given at every step, `time_step` s apart.
    pub fn of(name: String, states: &[ContactState], time_step: f64) -> Self {
        let touching = || states.iter().enumerate().filter(|(_, state)| state.touches());
        let time = |(step, _): (usize, &ContactState)| time_of(step, time_step);
        let forces = || touching().map(|(_, state)| state.force);
        let (count, all) = (touching().count(), states.len().max(1));
        let apart = states.iter().filter(|state| state.is_apart()).map(ContactState::total);
        Self {
            name,
            touches: count > 0,
            first_s: touching().next().map(time),
            last_s: touching().next_back().map(time),
            share_of_time: count as f64 / all as f64,
            peak_force: forces().fold(0.0, f64::max),
            mean_force: if count > 0 { forces().sum::<f64>() / count as f64 } else { 0.0 },
            least_clearance_m: states.iter().map(|state| state.clearance).reduce(f64::min).unwrap_or(f64::NAN),
            greatest_force_apart: apart.fold(0.0, f64::max),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// A contact of 100 N/m that sets in over 0.01 m.
    fn state(clearance: f64, force: f64) -> ContactState {
        ContactState {
            force,
            clearance,
            smoothing: 0.01,
            stiffness: 100.0,
            radius: 0.0,
            total_force: [0.0, 0.6 * force, 0.8 * force],
        }
    }

    #[test]
    fn a_contact_touches_where_it_is_near_and_pushes() {
        assert!(state(0.0099, 1.1e-6).touches());
        assert!(!state(0.0101, 1.1e-6).touches(), "a force across a gap does not count as touching");
        assert!(!state(0.0099, 0.9e-6).touches(), "1e-6 of stiffness times smoothing is negligible");
        let hard = |clearance, force| ContactState { smoothing: 0.0, ..state(clearance, force) };
        assert!(hard(-1e-6, 1e-4).touches() && !hard(1e-6, 0.0).touches() && !hard(0.0, 0.0).touches());
    }

    #[test]
    fn a_report_is_of_the_steps_that_touch() {
        let states = [state(0.2, 3.0), state(0.005, 1.0), state(-0.01, 4.0), state(0.05, 0.5), state(0.0, 2.5)];
        let report = ContactReport::of("wall".into(), &states, 0.1);
        assert!(report.touches);
        assert_eq!((report.first_s, report.last_s), (Some(0.1), Some(0.4)));
        assert_eq!((report.share_of_time, report.peak_force, report.mean_force), (0.6, 4.0, 2.5));
        assert_eq!((report.least_clearance_m, report.greatest_force_apart), (-0.01, 3.0));
    }

    #[test]
    fn a_report_without_touch_has_no_times_and_no_forces() {
        let report = ContactReport::of("wall".into(), &[state(0.3, 0.0), state(0.2, 0.0)], 0.1);
        assert!(!report.touches);
        assert_eq!((report.first_s, report.last_s), (None, None));
        assert_eq!((report.share_of_time, report.peak_force, report.mean_force), (0.0, 0.0, 0.0));
        assert_eq!((report.least_clearance_m, report.greatest_force_apart), (0.2, 0.0));
        let json = serde_json::to_value(&report).unwrap();
        assert!(json["first_s"].is_null() && json["peak_force_N"] == 0.0 && json["greatest_force_apart_N"] == 0.0);
        assert_eq!(serde_json::from_value::<ContactReport>(json).unwrap(), report);
    }
}
