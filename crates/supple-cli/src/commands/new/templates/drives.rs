//! What drives the joints: position control, or torques.

use std::f64::consts::PI;
use std::fmt::Write;

use super::{Draft, Template, names, said};
use crate::commands::new::rules::{four_digits, plain};

/// Position control of a joint.
struct Servo<'a> {
    joint: &'a str,
    /// N m/rad or N/m.
    kp: f64,
    /// N m s/rad or N s/m.
    kv: f64,
    /// The command that holds the start, rad or m.
    command: f64,
}

impl Draft<'_> {
    /// Whether controls are torques: with position control, the drives use the joint positions already, and their sensors
    /// would be of little use to the task.
    pub(super) fn is_by_torque(&self) -> bool {
        self.template == Template::Reach
    }

    fn servos(&self) -> Vec<Servo<'_>> {
        let Self { limb, start, rules, .. } = self;
        let of = |dof: usize| {
            let (inertia, lever) = (start.inertia[dof], start.levers[dof]);
            let fast = inertia * (2.0 * PI * rules.bandwidth).powi(2);
            let kp = four_digits(fast.max(1e4 * rules.force / limb.reach * lever * lever));
            let kv = four_digits(2.0 * (kp * inertia).sqrt());
            let command = plain(start.q[dof] + start.held[dof] / kp);
            Servo { joint: &limb.joints()[dof], kp, kv, command }
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
             # of at least {:?} Hz, and so stiff that {:?} N move the tool by at most {:?} m each. Without this table, controls\n\
             # are torques: then adapt the target and the weight of the cost of kind \"control\" too.\n[model.drives]\n",
            rules.bandwidth,
            rules.force,
            four_digits(1e-4 * limb.reach),
        );
        for Servo { joint, kp, kv, .. } in self.servos() {
            let _ = writeln!(text, "{joint:?} = {{ kp = {kp:?}, kv = {kv:?} }}");
        }
    }
}
