//! What a template follows along plans beside its costs: limits and curves.

use std::fmt::Write;

use supple_robot::JointKind;

use super::{Draft, Template, list, names, said};
use crate::commands::new::rules::plain;

impl Draft<'_> {
    pub(super) fn followed(&self, text: &mut String) {
        text.push_str(
            "\n# Limits: `evaluate` and `design` report when and by how much a plan violates them. Those of the robot file are\n\
             # always checked; they are listed here so that you can tighten them; reports plot them.\n",
        );
        let before = text.len();
        if self.enforced {
            self.positions(text);
        }
        self.speeds(text);
        self.efforts(text);
        if text.len() == before {
            text.push_str("# The robot file specifies no speed or effort limits. A limit on the tool speed would be\n");
            self.speed_of_tool(text);
        } else if !text[before..].contains("joint_velocity") {
            text.push_str("# The robot file specifies no speed limits. A limit on the tool speed would be\n");
            self.speed_of_tool(text);
        }
        self.curves(text);
    }

    /// A limit that a task may have, as a comment.
    fn speed_of_tool(&self, text: &mut String) {
        text.push_str("# [[tasks.limits]]\n# kind = \"frame_velocity\"\n");
        let _ = writeln!(text, "# frame = {:?}", self.mount_name());
        text.push_str(
            "# select = [\"vx\", \"vy\", \"vz\"]\n# lower = -0.25                  # m/s\n# upper = 0.25\n\n",
        );
    }

    /// Ranges of joints, where the file gives them.
    fn positions(&self, text: &mut String) {
        let joints = self.limb.planning.tree.joint_indices();
        let range = |dof: usize| {
            let limits = &self.limb.planning.robot.joints[joints[dof]].limits;
            [limits.lower, limits.upper]
        };
        self.limits(text, "joint_position", str::to_owned, ["rad", "m"], range);
    }

    /// Speeds of joints, where the file gives them.
    fn speeds(&self, text: &mut String) {
        let joints = self.limb.planning.tree.joint_indices();
        let speed = |dof: usize| up_to(self.limb.planning.robot.joints[joints[dof]].limits.velocity);
        self.limits(text, "joint_velocity", str::to_owned, ["rad/s", "m/s"], speed);
    }

    /// Torques and forces of drives, where the file gives them.
    fn efforts(&self, text: &mut String) {
        let (driven, efforts) = (self.limb.driven(), self.limb.efforts());
        let effort = |dof: usize| up_to(if driven.contains(&dof) { efforts[dof] } else { f64::INFINITY });
        let (kind, select): (&str, fn(&str) -> String) = match self.is_by_torque() {
            true => ("control", |joint| format!("tau.{joint}")),
            false => ("drive_effort", str::to_owned),
        };
        self.limits(text, kind, select, ["N m", "N"], effort);
    }

    /// Limits of joints that turn and of those that slide, in their units, where the file gives them; `select` names
    /// what is limited of a joint.
    fn limits(
        &self,
        text: &mut String,
        kind: &str,
        select: fn(&str) -> String,
        units: [&str; 2],
        range: impl Fn(usize) -> [f64; 2],
    ) {
        let planning = &self.limb.planning;
        for (slides, unit) in [false, true].into_iter().zip(units) {
            let joints = planning.tree.joint_indices().iter().map(|&joint| &planning.robot.joints[joint]).enumerate();
            let of_kind = joints.filter(|(_, joint)| (joint.kind == JointKind::Prismatic) == slides);
            let given = of_kind.map(|(dof, joint)| (select(&joint.name), range(dof)));
            let is_limit = |[lower, upper]: [f64; 2]| lower.is_finite() && upper.is_finite() && lower < upper;
            let (names, ranges): (Vec<_>, Vec<_>) = given.filter(|(_, range)| is_limit(*range)).unzip();
            limit(text, kind, &names, &ranges, unit, self.enforced);
        }
    }

    fn curves(&self, text: &mut String) {
        text.push_str("# Curves: stored over time in results and plotted in reports; they do not affect the cost.\n");
        if self.template.touches() {
            text.push_str("[[tasks.curves]]                 # N: contact force on the wall\n");
            text.push_str("kind = \"contact_force\"\ncontact = \"wall\"\n\n");
        }
        if self.template == Template::Handle {
            text.push_str("[[tasks.curves]]                 # N: force of the hook on the handle\n");
            text.push_str(
                "kind = \"coupling_force\"\ncoupling = \"hook\"\nselect = [\"force_x\", \"force_y\", \"force_z\"]\n\n",
            );
        }
        let _ = write!(
            text,
            "[[tasks.curves]]                 # m: position of the tool; compare with the target of the cost\n\
             kind = \"frame_point\"\nframe = {:?}\n",
            self.mount_name()
        );
        for axis in self.yielding() {
            let _ = write!(
                text,
                "\n[[tasks.curves]]                 # m: deflection of the mount\nkind = \"coupling_deflection\"\ncoupling = {axis:?}\n"
            );
        }
    }
}

/// Up to a number on both sides of 0.
fn up_to(most: f64) -> [f64; 2] {
    [-most, most]
}

/// A limit on both sides, where there is anything to limit.
fn limit(text: &mut String, kind: &str, select: &[String], ranges: &[[f64; 2]], unit: &str, enforced: bool) {
    if select.is_empty() {
        return;
    }
    // Rounding must not exceed the limits of the file.
    let within = |end: f64| if plain(end.abs()) > end.abs() { plain(end * (1.0 - 5e-6)) } else { end };
    let [lower, upper] = [0, 1].map(|side| list(&ranges.iter().map(|range| within(range[side])).collect::<Vec<_>>()));
    let _ = writeln!(text, "[[tasks.limits]]\nkind = {kind:?}\nselect = {}", names(select));
    said(text, &format!("lower = {lower}"), &format!("{unit}, of the robot file"));
    let _ = writeln!(text, "upper = {upper}");
    if enforced {
        said(text, "enforce = true", "without it, the plan exceeds limits of the robot");
    }
    text.push('\n');
}
