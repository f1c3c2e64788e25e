//! Drives: plain ones, whose control is a torque or force, position and velocity drives, and the actuators of the robot's
//! file.

use serde::Deserialize;
use supple_kernels::Scalar;
use supple_robot::{Actuator, Law};

use super::Robot;
use super::integrator::Integrator;
use crate::model::Limit;
use crate::{Channel, Point, Value, channels};

/// A drive: one control.
#[derive(Clone, Debug)]
pub(super) struct Drive {
    /// Index of the degree of freedom whose joint it drives.
    pub dof: usize,
    /// Index of the motor among the coordinates that compliance adds, if the joint is elastic.
    pub motor: Option<usize>,
    /// Joint torque per unit of drive force.
    pub gear: Value,
    /// Rotor inertia; reflected to the joint with `gear^2`.
    pub rotor: Value,
    /// The actuator; `None` if the control is the force itself.
    pub(super) actuator: Option<Servo>,
}

/// An actuator of the robot, defined by its file or by the task: `force = gain u + offset - kp l - kv l'`.
#[derive(Clone, Debug)]
pub(super) struct Servo {
    /// Index among the actuators of the robot.
    pub(super) index: usize,
    gain: Value,
    offset: f64,
    kp: Value,
    kv: Value,
}

/// The drive of a joint, or an actuator of the robot's file.
#[derive(Debug, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct DriveFile {
    /// Joint torque or force per unit of drive force; not 0; default: value in the file, or 1.
    pub(super) gear: Option<Value>,
    /// Rotor inertia, kg m²; reflected to the joint with `gear`²; at least 0.
    #[serde(default)]
    pub(super) rotor_inertia: Value,
    /// Stiffness of a position actuator, N m/rad or N/m; at least 0; default: value in the file. On a plain drive it makes
    /// the control the commanded position.
    pub(super) kp: Option<Value>,
    /// Damping of a position or velocity actuator, N m s/rad or N s/m; at least 0; default: value in the file. On a plain
    /// drive without `kp` it makes the control the commanded velocity.
    pub(super) kv: Option<Value>,
}

impl Drive {
    /// Torque or force on the joint, or on its motor, at a control, given position and rate of what it drives (theory,
    /// equation R.25).
    ///
    /// ```text
    /// tau = gear (gain u + offset - kp gear q - kv gear q')
    /// ```
    pub fn force<S: Scalar>(&self, at: &Point<S>, u: S, position: S, rate: S) -> S {
        let gear: S = at.value(self.gear);
        let Some(Servo { gain, offset, kp, kv, .. }) = &self.actuator else { return gear * u };
        let mut force = at.value(*gain) * u + *offset;
        for (coefficient, length) in [(*kp, position), (*kv, rate)] {
            if !coefficient.is_zero() {
                force -= at.value(coefficient) * gear * length;
            }
        }
        gear * force
    }
}

impl Drive {
    /// Whether its force depends on the motion that it drives, and resists it.
    pub fn resists(&self) -> bool {
        let negative = |value: &Value| matches!(value, Value::Number(number) if *number < 0.0);
        let of_motion = |servo: &Servo| !(servo.kp.is_zero() && servo.kv.is_zero());
        self.actuator.as_ref().is_some_and(|servo| of_motion(servo) && !negative(&servo.kp) && !negative(&servo.kv))
    }

    /// Decrease of its force per unit rate of the driven coordinate, with positions evaluated a time `lead`
    /// ahead: `gear^2 (kv + lead kp)`, N m s/rad or N s/m. `None` if the force does not resist motion.
    pub fn resistance<S: Scalar>(&self, at: &Point<S>, lead: S) -> Option<S> {
        let Servo { kp, kv, .. } = self.actuator.as_ref().filter(|_| self.resists())?;
        Some(at.value(self.gear).square() * (at.value(*kv) + lead * at.value(*kp)))
    }
}

impl Servo {
    /// Its control law at these parameters, in the form used by robot files.
    pub(super) fn law(&self, at: &Point<f64>) -> Law {
        let [gain, kp, kv] = [self.gain, self.kp, self.kv].map(|value| at.value(value));
        Law::new(gain, self.offset, kp, kv)
    }

    /// The actuator with this index, with the numbers that the task overrides.
    pub(super) fn new(index: usize, actuator: &Actuator, file: &DriveFile) -> Self {
        let of = |given: Option<Value>, number: f64| given.unwrap_or(Value::Number(number));
        let zero = Value::default();
        let [gain, kp, kv] = match actuator.law {
            Law::Motor { gain } => [of(None, gain), zero, zero],
            Law::Position { kp, kv } => [of(file.kp, kp), of(file.kp, kp), of(file.kv, kv)],
            Law::Velocity { kv } => [of(file.kv, kv), zero, of(file.kv, kv)],
            Law::Affine { gain, kp, kv, .. } => [of(None, gain), of(None, kp), of(None, kv)],
        };
        let offset = if let Law::Affine { offset, .. } = actuator.law { offset } else { 0.0 };
        Self { index, gain, offset, kp, kv }
    }
}

impl Robot {
    /// The actuator of a drive.
    pub(super) fn actuator_of(&self, drive: &Drive) -> Option<&Actuator> {
        self.bodies.robot.actuators.get(drive.actuator.as_ref()?.index)
    }

    /// The name of a drive: that of its joint or actuator.
    fn drive_name(&self, drive: &Drive) -> &str {
        match self.actuator_of(drive) {
            Some(actuator) => &actuator.name,
            None => &self.bodies.tree.joints()[drive.dof],
        }
    }

    /// Units of the position and the effort of a drive.
    fn units(&self, drive: &Drive) -> [&'static str; 2] {
        if self.bodies.slides(drive.dof) { ["m", "N"] } else { ["rad", "N m"] }
    }

    /// A drive with its effort limits from the effort of its joint and the force range of the actuator.
    pub(super) fn described_drive(&self, drive: &Drive) -> channels::Drive {
        let mut effort = [f64::NEG_INFINITY, f64::INFINITY];
        if let Some(actuator) = self.actuator_of(drive).filter(|actuator| !matches!(actuator.law, Law::Motor { .. })) {
            let most = self.effort_of_joint(drive);
            effort = [-most, most];
            if let Value::Number(gear) = drive.gear {
                let [a, b] = actuator.force.map(|force| force * gear);
                effort = [effort[0].max(a.min(b)), effort[1].min(a.max(b))];
            }
        }
        let channel = Channel::new(self.drive_name(drive), self.units(drive)[1]);
        channels::Drive { channel, effort, acts_at_end: self.acts_at_end(drive) }
    }

    /// Whether the force of a drive is that at the end of a step (theory, equation R.21).
    pub(super) fn acts_at_end(&self, drive: &Drive) -> bool {
        self.integrator == Integrator::Implicit && drive.resists()
    }

    /// The effort limit of a drive's joint in the robot file; infinite if it has none.
    fn effort_of_joint(&self, drive: &Drive) -> f64 {
        let effort = self.bodies.robot.joints[self.bodies.tree.joint_indices()[drive.dof]].limits.effort;
        // 0 marks a joint without a drive in the file; if the task adds a drive, its effort is unlimited.
        if effort > 0.0 { effort } else { f64::INFINITY }
    }

    /// Name and unit of the control of a drive: `tau.JOINT`, or `ctrl.ACTUATOR`.
    pub(super) fn control_channel(&self, drive: &Drive) -> Channel {
        let [length, force] = self.units(drive);
        let Some(actuator) = self.actuator_of(drive) else {
            return Channel::new(format!("tau.{}", self.bodies.tree.joints()[drive.dof]), force);
        };
        let unit = match actuator.law {
            Law::Motor { gain: 1.0 } => force.to_owned(),
            Law::Position { .. } => length.to_owned(),
            Law::Velocity { .. } => format!("{length}/s"),
            Law::Motor { .. } | Law::Affine { .. } => String::new(),
        };
        Channel::new(format!("ctrl.{}", actuator.name), unit)
    }

    /// Limits of the control of a drive: the effort of its joint, and the ranges of the actuator.
    pub(super) fn control_limits(&self, control: usize, drive: &Drive) -> Vec<Limit> {
        let joint = &self.bodies.robot.joints[self.bodies.tree.joint_indices()[drive.dof]];
        let mut limits = Vec::new();
        let actuator = self.actuator_of(drive);
        if let Some(actuator) = actuator {
            let [lower, upper] = actuator.control;
            limits.push(Limit::control(format!("control of actuator `{}`", actuator.name), control, lower, upper));
        }
        // The control of a plain drive or a motor is a multiple of its force; others have [`channels::Drive::effort`].
        let gain = match actuator.map(|actuator| actuator.law) {
            None => 1.0,
            Some(Law::Motor { gain }) => gain,
            Some(_) => return limits,
        };
        if let Some(actuator) = actuator {
            let [a, b] = actuator.force.map(|force| force / gain);
            limits.push(Limit::control(format!("force of actuator `{}`", actuator.name), control, a.min(b), a.max(b)));
        }
        if let Value::Number(gear) = drive.gear {
            let most = self.effort_of_joint(drive) / (gear * gain).abs();
            limits.push(Limit::control(format!("effort of joint `{}`", joint.name), control, -most, most));
        }
        limits
    }
}
