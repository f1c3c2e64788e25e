//! The drives of a robot: their names, units, efforts and limits.

use supple_robot::{Actuator, Law};

use super::Robot;
use super::drive::Drive;
use super::integrator::Integrator;
use crate::{Channel, Limit, Value, channels};

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
            let name = match gear {
                1.0 => format!("effort of joint `{}`", joint.name),
                _ => format!("effort of the drive of joint `{}`, before its gear", joint.name),
            };
            limits.push(Limit::control(name, control, -most, most));
        }
        limits
    }
}
