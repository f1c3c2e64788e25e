//! Violations of the real robot's limits by a plan.

use serde::{Deserialize, Serialize};

use crate::channels::{Channel, Channels};
use crate::trajectory::Trajectory;
use crate::{Limit, Limited};

/// A limit of a state or control that a plan violates.
///
/// Example: [`limits_violated`].
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct LimitViolation {
    /// Description of the limited quantity for messages: ``velocity of joint `elbow` ``.
    pub name: String,
    /// Its unit; empty where there is none.
    #[serde(default)]
    pub unit: String,
    /// The value furthest outside the limit.
    pub worst: f64,
    /// The limit: the upper one if `worst` is above it, the lower one if it is below.
    pub limit: f64,
    /// The first step at which the value is `worst`: states at 0 to N, controls at 0 to N - 1.
    pub step: usize,
    /// Number of steps at which the value is outside the limits.
    pub steps: usize,
    /// Whether the task sets the limit, and not the robot's file.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_of_task: bool,
}

/// How far outside a limit a value may be, relative to 1 plus the limit, to allow for rounding of values held at it.
///
/// Example: [`violations`].
pub const LIMIT_TOLERANCE: f64 = 1e-9;

/// The limits of states and controls, which are named by `channels`, that a trajectory violates, in the order of `limits`; the upper and the lower side of one limit count as two.
///
/// ```
/// use supple_model::{Channel, Channels, Dimensions, Limit, Limited, Trajectory, limits_violated};
///
/// // A plan of two steps whose second torque is 7.5 N m.
/// let dimensions = Dimensions { states: 1, controls: 1, measurements: 1 };
/// let mut channels = Channels::plain(vec!["speed".to_owned()], dimensions);
/// channels.controls[0] = Channel::new("torque", "N m");
/// let mut plan = Trajectory::zeros(dimensions, 2);
/// plan.controls.vector_mut(1)[0] = 7.5;
/// let torque = Limit::control("torque of the motor".to_owned(), 0, -5.0, 5.0);
/// assert_eq!(torque.of, Limited::Control(0));
/// let found = limits_violated(&[torque], &channels, &plan);
/// assert_eq!((found[0].step, found[0].worst, found[0].limit, &*found[0].unit), (1, 7.5, 5.0, "N m"));
/// ```
#[must_use]
pub fn limits_violated(limits: &[Limit], channels: &Channels, trajectory: &Trajectory) -> Vec<LimitViolation> {
    let of_limit = |limit: &Limit| {
        let (values, channels, index) = match limit.of {
            Limited::State(index) => (&trajectory.states, &channels.states, index),
            Limited::Control(index) => (&trajectory.controls, &channels.controls, index),
        };
        let values: Vec<f64> = (0..values.count()).map(|step| values.vector(step)[index]).collect();
        let channel = Channel::new(limit.name.clone(), channels.get(index).map_or("", |channel| &channel.unit));
        violations(&channel, [limit.lower, limit.upper], &values)
    };
    limits.iter().flat_map(of_limit).collect()
}

/// Violations of two limits, either of which may be infinite, by numbers over time: of the upper one, then the lower one.
///
/// ```
/// use supple_model::Channel;
/// use supple_model::limits::{LIMIT_TOLERANCE, violations};
///
/// let found = violations(&Channel::new("speed", "m/s"), [-1.0, 1.0], &[0.0, -1.5, 1.0 + LIMIT_TOLERANCE]);
/// assert_eq!((found.len(), found[0].step, found[0].worst), (1, 1, -1.5));
/// ```
#[must_use]
pub fn violations(of: &Channel, [lower, upper]: [f64; 2], values: &[f64]) -> Vec<LimitViolation> {
    let side = |(bound, sign): (f64, f64)| {
        let tolerance = LIMIT_TOLERANCE * (1.0 + bound.abs());
        let outside = |&(_, value): &(usize, f64)| bound.is_finite() && sign * (value - bound) > tolerance;
        let all = || values.iter().copied().enumerate().filter(outside);
        let further =
            |worst: (usize, f64), next: (usize, f64)| if sign * (next.1 - worst.1) > 0.0 { next } else { worst };
        let (step, worst) = all().reduce(further)?;
        let Channel { name, unit } = of.clone();
        Some(LimitViolation { name, unit, worst, limit: bound, step, steps: all().count(), is_of_task: false })
    };
    [(upper, 1.0), (lower, -1.0)].into_iter().filter_map(side).collect()
}
