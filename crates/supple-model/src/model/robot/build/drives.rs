//! The drives of a robot as its table describes them.

use std::collections::BTreeMap;

use supple_robot::{Actuator, Law, Omitted};
use supple_text::FileError;

use super::Build;
use crate::document::Place;
use crate::model::compliance::{Element, find};
use crate::model::robot::drive::{Drive, DriveFile, Servo};
use crate::quantity::Unfit;
use crate::{Point, Value};

impl Build<'_> {
    /// The drives: those listed in `actuated`, else the actuators of the file, else all moving joints. A joint whose
    /// drive has a stiffness or damping in the task gets an actuator.
    pub(super) fn drives(
        &mut self,
        actuated: Option<Vec<String>>,
        from_file: bool,
        mut files: BTreeMap<String, DriveFile>,
        compliance: &[Element],
    ) -> Result<Vec<Drive>, FileError> {
        if !from_file {
            // The ranges of the file's actuators still limit the joint efforts, even if the actuators are not used.
            let driven: Vec<usize> = self.robot.actuators.iter().map(|actuator| actuator.joint).collect();
            for joint in driven {
                let most = self.robot.greatest_effort(joint);
                self.robot.joints[joint].limits.effort = most;
            }
            self.robot.actuators.clear();
            self.robot.keys.iter_mut().for_each(|key| key.controls.clear());
        }
        let actuators = self.robot.actuators.clone();
        let own = || actuators.iter().filter(|actuator| self.dof_of(actuator).is_some());
        let names = match actuated {
            Some(names) => {
                self.doubt_passive(&names);
                names
            }
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
            let mut drive = self.drive(name, dof, actuator, file)?;
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
            let dof = self.joints.iter().position(|joint| *joint == name);
            let drives_it = |one: &&Actuator| !is_actuator && names.contains(&one.name) && self.dof_of(one) == dof;
            if let Some(by) = actuators.iter().find(drives_it) {
                let message =
                    format!("joint `{name}` is driven by the actuator `{0}`: use `[model.drives.{0}]`", by.name);
                return Err(self.error(&keys, message));
            }
            let what = if is_actuator { "actuator" } else { "joint" };
            let message = format!("{what} `{name}` is not actuated; actuated: {}", supple_text::quoted(&names));
            return Err(self.error(&keys, message));
        }
        Ok(drives)
    }

    /// That joints which the robot's file gives no effort, unlike others, are driven all the same.
    fn doubt_passive(&mut self, names: &[String]) {
        let is_passive =
            |name: &&String| self.robot.joint(name).is_some_and(|at| self.robot.joints[at].limits.effort == 0.0);
        let passive: Vec<String> = names.iter().filter(is_passive).cloned().collect();
        for name in passive {
            let message = format!(
                "drives joint `{name}`, whose effort limit in the robot's file is 0: there, it has no drive. Leave it out, or give \
                 it an effort limit in the robot's file"
            );
            let warning = self.error(&["actuated".into()], message).to_string();
            self.doubt(warning);
        }
    }

    /// Adds an actuator if the task gives the joint's drive a stiffness or damping; returns its index in the robot.
    fn add_actuator(&mut self, name: &str, dof: usize, file: &DriveFile) -> Option<usize> {
        let initial = |value: Option<&Value>| {
            let phi = self.parameters.initial();
            let at = Point { x: &[], u: &[], phi: &phi, time_step: 0.0, w: &[] };
            value.map_or(0.0, |value| at.value(value))
        };
        let law = match (file.kp.as_ref(), file.kv.as_ref()) {
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

    /// The degree of freedom that an actuator drives; `None` if its joint does not move.
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
                    let help = match omitted.why.as_str() {
                        Omitted::LOCKED => "unlock its joint, or leave it out",
                        _ => "list the joints to be driven instead",
                    };
                    FileError { message, help: Some(help.to_owned()), ..error }
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

    /// A drive of a degree of freedom with a rigid joint; it may be an actuator of the file.
    fn drive(
        &self,
        name: &str,
        dof: usize,
        actuator: Option<(usize, &Actuator)>,
        file: DriveFile,
    ) -> Result<Drive, FileError> {
        let keys = |key: &'static str| ["drives".into(), Place::Key(name), key.into()];
        let DriveFile { gear, rotor_inertia: rotor, kp, kv } = file;
        let gear = gear.unwrap_or(Value::Number(actuator.map_or(1.0, |(_, actuator)| actuator.gear)));
        self.check(&keys("rotor_inertia"), &rotor, 0.0, false)?;
        if gear.is_zero() {
            return Err(self.error(&keys("gear"), "must not be 0: the drive would have no effect"));
        }
        let law = actuator.map(|(_, actuator)| actuator.law);
        for (key, given, fits) in [
            ("kp", &kp, matches!(law, Some(Law::Position { .. }))),
            ("kv", &kv, matches!(law, Some(Law::Position { .. } | Law::Velocity { .. }))),
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
        let actuator = actuator.map(|(index, actuator)| Servo::new(index, actuator, kp, kv));
        Ok(Drive { dof, motor: None, gear, rotor, actuator })
    }
}
