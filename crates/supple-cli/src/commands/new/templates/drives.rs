//! What drives the joints: position control, or torques.

use std::f64::consts::PI;
use std::fmt::Write;

use super::{Draft, Template, names, said};
use crate::commands::new::rules::{four_digits, plain};

/// Maximum tool displacement under the contact force per joint, as a share of the reach.
const SAG: f64 = 4e-4;
/// Share of the inertia at a joint below which that of its drive does not matter.
const LEAST_ARMATURE: f64 = 0.01;

/// Position control of a joint.
struct Servo<'a> {
    joint: &'a str,
    /// N m/rad or N/m.
    kp: f64,
    /// N m s/rad or N s/m.
    kv: f64,
    /// Inertia of the drive, kg m^2 or kg; `None` if the robot's own is enough.
    armature: Option<f64>,
    /// The command that holds the start, rad or m.
    command: f64,
}

impl Draft<'_> {
    /// Whether controls are torques. Position-controlled drives already use the joint positions, so that joint sensors
    /// would be of little use to the task.
    pub(super) fn is_by_torque(&self) -> bool {
        self.template == Template::Reach
    }

    fn servos(&self) -> Vec<Servo<'_>> {
        let Self { limb, start, rules, .. } = self;
        let of = |dof: usize| {
            let (inertia, lever) = (start.inertia[dof], start.levers[dof]);
            let squared = (2.0 * PI * rules.bandwidth).powi(2);
            let stiff = SAG.recip() * rules.force / limb.reach * lever * lever;
            let kp = four_digits(stiff.max(inertia * squared));
            let more = kp / squared - inertia;
            let known = limb.planning.robot.joints[limb.planning.tree.joint_indices()[dof]].armature;
            let armature = (more > LEAST_ARMATURE * inertia).then(|| four_digits(known + more));
            let kv = four_digits(2.0 * (kp * (inertia + more.max(0.0))).sqrt());
            let command = plain(start.q[dof] + start.held[dof] / kp);
            Servo { joint: &limb.joints()[dof], kp, kv, armature, command }
        };
        self.limb.driven().into_iter().map(of).collect()
    }

    /// Controls that hold the start: commands of position control, or torques.
    pub(super) fn holding(&self) -> Vec<f64> {
        if self.is_by_torque() {
            self.limb.driven().into_iter().map(|dof| plain(self.start.held[dof])).collect()
        } else {
            self.servos().into_iter().map(|servo| servo.command).collect()
        }
    }

    /// The keys of `[model]` that say which joints have drives.
    pub(super) fn actuated(&self, text: &mut String) {
        let robot = &self.limb.planning.robot;
        if !robot.actuators.is_empty() {
            let _ = writeln!(text, "file_actuators = false           # true: the actuators of the robot file");
        }
        let driven: Vec<&String> = self.limb.driven().into_iter().map(|dof| &self.limb.joints()[dof]).collect();
        if driven.len() < self.limb.joints().len() {
            let _ =
                writeln!(text, "actuated = {}   # the robot file has no drive for the other joints", names(&driven));
        }
    }

    /// The speed over which friction of the file builds up, where its joints have any.
    pub(super) fn friction(&self, text: &mut String) {
        let Self { limb, rules, .. } = self;
        let joints = limb.planning.tree.joint_indices();
        if joints.iter().all(|&joint| limb.planning.robot.joints[joint].friction == 0.0) {
            return;
        }
        let line = format!("friction_smoothing = {:?}", rules.friction_smoothing(limb));
        said(text, &line, &format!("{}: friction builds up over this speed; 0.01 by default", limb.speed_unit()));
    }

    /// The table of drives.
    pub(super) fn drives(&self, text: &mut String) {
        let Self { limb, rules, .. } = self;
        if self.is_by_torque() {
            return;
        }
        let _ = write!(
            text,
            "\n# The joints follow position commands, as those of most robots do: each is critically damped with a natural frequency\n\
             # of {:?} Hz, and so stiff that {:?} N move the tool by at most {:?} m each. Without this table, controls\n\
             # are torques: then adapt the target and the weight of the cost of kind \"control\" too.\n[model.drives]\n",
            rules.bandwidth,
            rules.force,
            four_digits(SAG * limb.reach),
        );
        let servos = self.servos();
        for Servo { joint, kp, kv, .. } in &servos {
            let _ = writeln!(text, "{joint:?} = {{ kp = {kp:?}, kv = {kv:?} }}");
        }
        let heavy: Vec<_> = servos.iter().filter_map(|servo| Some((servo.joint, servo.armature?))).collect();
        if !heavy.is_empty() {
            text.push_str(
                "\n# Drives that stiff have rotors and gears whose inertia robot files seldom state: here, what that \
                 frequency requires.\n",
            );
        }
        for (joint, armature) in heavy {
            let unit = if limb.of_kind(true).any(|slide| slide.name == *joint) { "kg" } else { "kg m^2" };
            let _ = writeln!(text, "[model.joints.{joint:?}]");
            said(text, &format!("armature = {armature:?}"), unit);
        }
    }
}
