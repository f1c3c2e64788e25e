//! Drives: plain ones, whose control is a torque or force, position and velocity drives, and the actuators of the robot's
//! file.

use std::collections::BTreeMap;

use serde::Deserialize;
use supple_kernels::Scalar;
use supple_robot::{Actuator, Law};
use supple_text::FileError;

use super::Robot;
use super::compliance::{Element, find};
use super::file::Build;
use crate::document::Place;
use crate::model::Limit;
use crate::quantity::Unfit;
use crate::{Channel, Point, Value};

/// A drive: one control.
#[derive(Clone, Debug)]
pub(super) struct Drive {
    /// Index of the degree of freedom whose joint it drives.
    pub dof: usize,
    /// Place of the motor among what compliance adds, where the joint is elastic.
    pub motor: Option<usize>,
    /// Torque on the joint for a unit of force.
    pub gear: Value,
    /// Inertia of the rotor, felt `gear^2` times at the joint.
    pub rotor: Value,
    /// The actuator; none where the control is the force.
    pub(super) actuator: Option<Servo>,
}

/// An actuator of the robot, of its file or of the task: `force = gain u + offset - kp l - kv l'`.
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
#[derive(Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct DriveFile {
    /// Joint torque or force per unit of drive force; not 0; default: value in the file, or 1.
    gear: Option<Value>,
    /// Rotor inertia, kg m²; reflected to the joint with `gear`²; at least 0.
    #[serde(default)]
    rotor_inertia: Value,
    /// Stiffness of a position actuator, N m/rad or N/m; at least 0; default: value in the file. On a plain drive it makes
    /// the control the commanded position.
    kp: Option<Value>,
    /// Damping of a position or velocity actuator, N m s/rad or N s/m; at least 0; default: value in the file. On a plain
    /// drive without `kp` it makes the control the commanded velocity.
    kv: Option<Value>,
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
    /// By how much its force falls for a unit of the rate of what it drives, where positions are taken a time `lead`
    /// ahead: `gear^2 (kv + lead kp)`, N m s/rad or N s/m. None where the force does not resist motion.
    pub fn resistance<S: Scalar>(&self, at: &Point<S>, lead: S) -> Option<S> {
        let Servo { kp, kv, .. } = self.actuator.as_ref()?;
        let negative = |value: &Value| matches!(value, Value::Number(number) if *number < 0.0);
        if negative(kp) || negative(kv) {
            return None;
        }
        Some(at.value(self.gear).square() * (at.value(*kv) + lead * at.value(*kp)))
    }
}

impl Servo {
    /// Its law at these parameters, as a robot file writes it.
    pub(super) fn law(&self, at: &Point<f64>) -> Law {
        let [gain, kp, kv] = [self.gain, self.kp, self.kv].map(|value| at.value(value));
        Law::new(gain, self.offset, kp, kv)
    }

    /// The actuator with this index, with the numbers that the task says anew.
    fn new(index: usize, actuator: &Actuator, file: &DriveFile) -> Self {
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
    /// The actuator that a drive is.
    pub(super) fn actuator_of(&self, drive: &Drive) -> Option<&Actuator> {
        self.robot.actuators.get(drive.actuator.as_ref()?.index)
    }

    /// Name and unit of the control of a drive: `tau.JOINT`, or `ctrl.ACTUATOR`.
    pub(super) fn control_channel(&self, drive: &Drive) -> Channel {
        let [length, force] = if self.slides(drive.dof) { ["m", "N"] } else { ["rad", "N m"] };
        let Some(actuator) = self.actuator_of(drive) else {
            return Channel::new(format!("tau.{}", self.tree.joints()[drive.dof]), force);
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
        let joint = &self.robot.joints[self.tree.joint_indices()[drive.dof]];
        let mut limits = Vec::new();
        let actuator = self.actuator_of(drive);
        if let Some(actuator) = actuator {
            let [lower, upper] = actuator.control;
            limits.push(Limit::control(format!("control of actuator `{}`", actuator.name), control, lower, upper));
        }
        // The control of a plain drive or a motor is a multiple of its force; that of others is none.
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
            let most = joint.limits.effort / (gear * gain).abs();
            limits.push(Limit::control(format!("effort of joint `{}`", joint.name), control, -most, most));
        }
        limits
    }
}

impl Build<'_> {
    /// The drives: those that `actuated` names, or the actuators of the file, or all joints that move. Joints whose drive
    /// the task gives a stiffness or damping get an actuator.
    pub(super) fn drives(
        &mut self,
        actuated: Option<Vec<String>>,
        from_file: bool,
        mut files: BTreeMap<String, DriveFile>,
        compliance: &[Element],
    ) -> Result<Vec<Drive>, FileError> {
        if !from_file {
            self.robot.actuators.clear();
            self.robot.keys.iter_mut().for_each(|key| key.controls.clear());
        }
        let actuators = self.robot.actuators.clone();
        let own = || actuators.iter().filter(|actuator| self.dof_of(actuator).is_some());
        let names = match actuated {
            Some(names) => names,
            None if own().next().is_some() => own().map(|actuator| actuator.name.clone()).collect(),
            None => {
                let passive: Vec<&str> = self.passive_joints().collect();
                self.joints.iter().filter(|joint| !passive.contains(&joint.as_str())).cloned().collect()
            }
        };
        let mut drives: Vec<Drive> = Vec::new();
        for (place, name) in names.iter().enumerate() {
            if names[..place].contains(name) {
                let what = if actuators.iter().any(|actuator| actuator.name == *name) { "actuator" } else { "joint" };
                return Err(self.error(&["actuated".into()], format!("{what} `{name}` occurs twice")));
            }
            let file = files.remove(name).unwrap_or_default();
            let mut index = actuators.iter().position(|actuator| actuator.name == *name);
            let dof = match index.and_then(|index| self.dof_of(&actuators[index])) {
                Some(dof) => dof,
                None => self.driven_joint(name, from_file)?,
            };
            if index.is_none() {
                index = self.add_actuator(name, dof, &file);
            }
            let actuator = index.map(|index| (index, &self.robot.actuators[index]));
            let mut drive = self.drive(name, dof, actuator, &file)?;
            let motor = compliance.iter().find(|element| element.kind.is_motor_of(dof));
            drive.motor = motor.map(|element| element.coordinate);
            drives.push(drive);
        }
        if drives.is_empty() {
            return Err(self.error(&["actuated".into()], "name at least one joint: there must be a control"));
        }
        if let Some((name, _)) = files.pop_first() {
            let keys = ["drives".into(), Place::Key(&name)];
            let is_actuator = actuators.iter().any(|actuator| actuator.name == name);
            if !is_actuator {
                find("", "moving joint", &name, &self.joints)
                    .map_err(|Unfit { message, help, .. }| FileError { help, ..self.error(&keys, message) })?;
            }
            let what = if is_actuator { "actuator" } else { "joint" };
            let message = format!("{what} `{name}` is not actuated: actuated are {}", supple_text::quoted(&names));
            return Err(self.error(&keys, message));
        }
        Ok(drives)
    }

    /// The actuator of a joint whose drive the task gives a stiffness or a damping: its index among those of the robot.
    fn add_actuator(&mut self, name: &str, dof: usize, file: &DriveFile) -> Option<usize> {
        let initial = |value: Option<Value>| {
            let phi = self.parameters.initial();
            let at = Point { x: &[], u: &[], phi: &phi, time_step: 0.0, w: &[] };
            at.value(value.unwrap_or_default())
        };
        let law = match (file.kp, file.kv) {
            (None, None) => return None,
            (None, kv) => Law::Velocity { kv: initial(kv) },
            (kp, kv) => Law::Position { kp: initial(kp), kv: initial(kv) },
        };
        let any = [f64::NEG_INFINITY, f64::INFINITY];
        let joint = self.tree.joint_indices()[dof];
        let actuator = Actuator { name: name.to_owned(), joint, gear: 1.0, law, control: any, force: any, line: 0 };
        self.robot.actuators.push(actuator);
        self.robot.keys.iter_mut().for_each(|key| key.controls.push(0.0));
        Some(self.robot.actuators.len() - 1)
    }

    /// The degree of freedom that an actuator drives; none where its joint does not move.
    fn dof_of(&self, actuator: &Actuator) -> Option<usize> {
        self.tree.joint_indices().iter().position(|&joint| joint == actuator.joint)
    }

    /// The degree of freedom of a joint that `actuated` names.
    fn driven_joint(&self, name: &str, from_file: bool) -> Result<usize, FileError> {
        let found = self.names().joint("actuated", name);
        found.map_err(|unfit| {
            let omitted = self.robot.omitted.iter().find(|omitted| omitted.what == "actuator" && omitted.name == name);
            let error = self.unfit(&[], unfit);
            match omitted {
                Some(omitted) => {
                    let message = format!(
                        "actuator `{name}` of the robot's file (line {}) is not supported: {}",
                        omitted.line, omitted.why
                    );
                    let help = "list the joints to be driven instead".to_owned();
                    FileError { message, help: Some(help), ..error }
                }
                None if from_file && !self.robot.actuators.is_empty() => {
                    let all: Vec<_> = self.robot.actuators.iter().map(|actuator| actuator.name.as_str()).collect();
                    let message =
                        format!("{}; its file has the actuators {}", error.message, supple_text::quoted(&all));
                    FileError { message, ..error }
                }
                None => error,
            }
        })
    }

    /// A drive of a degree of freedom whose joint is rigid, which may be an actuator of the file.
    fn drive(
        &self,
        name: &str,
        dof: usize,
        actuator: Option<(usize, &Actuator)>,
        file: &DriveFile,
    ) -> Result<Drive, FileError> {
        let keys = |key: &'static str| ["drives".into(), Place::Key(name), key.into()];
        let gear = file.gear.unwrap_or(Value::Number(actuator.map_or(1.0, |(_, actuator)| actuator.gear)));
        self.check(&keys("rotor_inertia"), file.rotor_inertia, 0.0, false)?;
        if gear.is_zero() {
            return Err(self.error(&keys("gear"), "must not be 0: the drive would have no effect"));
        }
        let law = actuator.map(|(_, actuator)| actuator.law);
        for (key, given, fits) in [
            ("kp", file.kp, matches!(law, Some(Law::Position { .. }))),
            ("kv", file.kv, matches!(law, Some(Law::Position { .. } | Law::Velocity { .. }))),
        ] {
            let Some(value) = given else { continue };
            if !fits {
                let what =
                    law.map_or_else(|| "a motor".to_owned(), |law| format!("an actuator of kind {}", law.name()));
                let valid = if key == "kp" { "position actuators" } else { "position and velocity actuators" };
                return Err(self.error(&keys(key), format!("only {valid} have it; `{name}` is {what}")));
            }
            self.check(&keys(key), value, 0.0, false)?;
        }
        let servo = actuator.map(|(index, actuator)| Servo::new(index, actuator, file));
        Ok(Drive { dof, motor: None, gear, rotor: file.rotor_inertia, actuator: servo })
    }
}
