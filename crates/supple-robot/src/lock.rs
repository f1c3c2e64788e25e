//! Locks joints of a robot: fixes them at given positions.

use crate::pose::{dot, scale};
use crate::{Joint, JointKind, Limits, Measured, Narrowed, Omitted, Pose, Robot};
use supple_kernels::math;

/// Relative tolerance on limits: rounding of a file's digits.
const ROUNDING: f64 = 1e-9;

impl Joint {
    /// Its default initial position, rad or m: where the file draws it, which is 0 but for MJCF's `ref`; or
    /// [`Limits::neutral`] if the limits do not allow that.
    #[must_use]
    pub fn neutral(&self) -> f64 {
        if self.reference != 0.0 && self.limits.allow(self.reference) { self.reference } else { self.limits.neutral() }
    }
}

impl Limits {
    /// The default initial position of a joint: 0 if the limits allow it, else the middle of the
    /// range, or the finite limit if the other is infinite. Rad or m.
    #[must_use]
    pub fn neutral(&self) -> f64 {
        let Self { lower, upper, .. } = *self;
        match (lower.is_finite(), upper.is_finite()) {
            _ if lower <= 0.0 && upper >= 0.0 => 0.0,
            (true, true) => 0.5 * (lower + upper),
            (true, false) => lower,
            (false, true) => upper,
            (false, false) => 0.0,
        }
    }

    /// Whether a position, rad or m, lies between the limits, but for rounding of a file's digits.
    #[must_use]
    pub fn allow(&self, position: f64) -> bool {
        let Self { lower, upper, .. } = *self;
        position >= lower - ROUNDING * lower.abs() && position <= upper + ROUNDING * upper.abs()
    }
}

/// A joint that is fixed at a position.
///
/// Example: [`Actuator`](crate::Actuator).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LockedJoint {
    /// Index of the joint.
    pub joint: usize,
    /// Its position, rad or m.
    pub position: f64,
}

impl Robot {
    /// The robot with some joints locked: each of `joints` is fixed at its position, and so are those that
    /// follow it, at the resulting positions. Links, joints and frames keep their numbers. Actuators and sensors of fixed
    /// joints are moved to [`Robot::omitted`]. Indices without a joint are ignored.
    #[must_use]
    pub fn locked(&self, joints: &[LockedJoint]) -> Self {
        let mut held = vec![None; self.joints.len()];
        for &LockedJoint { joint, position } in joints {
            if let Some(held) = held.get_mut(joint) {
                *held = Some(position);
            }
        }
        let mut robot = self.clone();
        for (index, joint) in robot.joints.iter_mut().enumerate() {
            if joint.kind != JointKind::Fixed
                && let Some(position) = self.held_at(index, &held)
            {
                joint.fix(position);
            }
        }
        robot.omit_of_fixed();
        robot
    }

    /// The position at which a joint is held, directly or through a joint that it follows.
    fn held_at(&self, joint: usize, held: &[Option<f64>]) -> Option<f64> {
        let (mut at, mut ratio, mut offset) = (joint, 1.0, 0.0);
        // A chain longer than the list of joints is a cycle.
        for _ in 0..=self.joints.len() {
            if let Some(position) = held.get(at).copied().flatten() {
                return Some(ratio * position + offset);
            }
            let mimic = self.joints.get(at)?.mimic?;
            (at, ratio, offset) = (mimic.joint, ratio * mimic.ratio, ratio * mimic.offset + offset);
        }
        None
    }

    /// Moves actuators and sensors of joints that do not move to the omitted ones.
    fn omit_of_fixed(&mut self) {
        let Self { joints, actuators, sensors, keys, omitted, .. } = self;
        let moves = |joint: usize| joints.get(joint).is_some_and(|joint| joint.kind != JointKind::Fixed);
        let mut omit = |what, name: &str, line| {
            omitted.push(Omitted { what, name: name.to_owned(), why: Omitted::LOCKED.to_owned(), line });
        };
        let kept: Vec<bool> = actuators.iter().map(|actuator| moves(actuator.joint)).collect();
        for (actuator, _) in actuators.iter().zip(&kept).filter(|(_, kept)| !**kept) {
            omit("actuator", &actuator.name, actuator.line);
        }
        actuators.retain(|actuator| moves(actuator.joint));
        for key in keys {
            let mut kept = kept.iter();
            key.controls.retain(|_| kept.next().copied().unwrap_or(true));
        }
        sensors.retain(|sensor| match sensor.measures {
            Measured::JointPosition(joint) | Measured::JointVelocity(joint) | Measured::JointTorque(joint)
                if !moves(joint) =>
            {
                omit("sensor", &sensor.name, sensor.line);
                false
            }
            _ => true,
        });
    }
}

impl Joint {
    /// The pose of the moved joint frame in the joint frame, at a position, rad or m.
    fn moved(&self, position: f64) -> Pose {
        let (by, axis) = (position - self.reference, self.axis);
        if self.kind == JointKind::Prismatic {
            return Pose::at(scale(by, axis));
        }
        // R = I + sin [axis] + (1 - cos) [axis]^2
        let (sin, cos) = math::sin_cos(by);
        let [x, y, z] = axis;
        let skew = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        let mut rotation = Pose::IDENTITY.rotation;
        for (i, row) in rotation.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                let squared = dot(skew[i], [skew[0][j], skew[1][j], skew[2][j]]);
                *entry += sin * skew[i][j] + (1.0 - cos) * squared;
            }
        }
        Pose { rotation, position: [0.0; 3] }
    }

    /// Turns it into a fixed joint at a position, rad or m, absorbing the motion into the pose of its child link.
    fn fix(&mut self, position: f64) {
        self.child_pose = self.moved(position).compose(&self.child_pose);
        self.kind = JointKind::Fixed;
        self.mimic = None;
        self.axis = [1.0, 0.0, 0.0];
        (self.limits, self.narrowed) = (Limits::default(), Narrowed::default());
        (self.reference, self.rest) = (0.0, 0.0);
        (self.damping, self.friction, self.armature, self.stiffness) = (0.0, 0.0, 0.0, 0.0);
    }
}
