//! Violations of the real robot's limits by a plan.

use serde::{Deserialize, Serialize};

use crate::trajectory::Trajectory;
use crate::{Limit, Limited};

/// A limit of a state or control that a plan violates.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct LimitViolation {
    /// Description of the limited quantity for messages: ``velocity of joint `elbow` ``.
    pub name: String,
    /// The value furthest outside the limit, in the unit of the state or control.
    pub worst: f64,
    /// The limit, in the same unit: the upper one if `worst` is above it, the lower one if it is below.
    pub limit: f64,
    /// The first step at which the value is `worst`: states at 0 to N, controls at 0 to N - 1.
    pub step: usize,
    /// Number of steps at which the value is outside the limits.
    pub steps: usize,
}

/// How far outside a limit a value may be, relative to 1 plus the limit, to allow for rounding of values held at it.
pub const LIMIT_TOLERANCE: f64 = 1e-9;

/// The limits that a trajectory violates, in the order of `limits`; the upper and the lower side of one limit count as two.
#[must_use]
pub fn limits_violated(limits: &[Limit], trajectory: &Trajectory) -> Vec<LimitViolation> {
    let of_limit = |limit: &Limit| {
        let (values, index) = match limit.of {
            Limited::State(index) => (&trajectory.states, index),
            Limited::Control(index) => (&trajectory.controls, index),
        };
        let values: Vec<f64> = (0..values.count()).map(|step| values.vector(step)[index]).collect();
        violations(&limit.name, [limit.lower, limit.upper], &values)
    };
    limits.iter().flat_map(of_limit).collect()
}

/// Violations of two limits, either of which may be infinite, by numbers over time: of the upper one, then the lower one.
#[must_use]
pub fn violations(name: &str, [lower, upper]: [f64; 2], values: &[f64]) -> Vec<LimitViolation> {
    let side = |(bound, sign): (f64, f64)| {
        let tolerance = LIMIT_TOLERANCE * (1.0 + bound.abs());
        let outside = |&(_, value): &(usize, f64)| bound.is_finite() && sign * (value - bound) > tolerance;
        let all = || values.iter().copied().enumerate().filter(outside);
        let further =
            |worst: (usize, f64), next: (usize, f64)| if sign * (next.1 - worst.1) > 0.0 { next } else { worst };
        let (step, worst) = all().reduce(further)?;
        Some(LimitViolation { name: name.to_owned(), worst, limit: bound, step, steps: all().count() })
    };
    [(upper, 1.0), (lower, -1.0)].into_iter().filter_map(side).collect()
}
