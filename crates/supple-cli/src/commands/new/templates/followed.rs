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
        self.speeds(text);
        self.efforts(text);
        let efforts = self.greatest_efforts();
        if !self.is_by_torque() && !efforts.is_empty() {
            text.push_str(
                "# Greatest efforts of the drives by the robot file. Controls are commands, and no limit keeps them:\n",
            );
            efforts.into_iter().for_each(|line| text.push_str(&line));
            text.push('\n');
        }
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

    /// Lines of comment with the greatest efforts of drives, where the file gives them: those of its joints, or of what its
    /// motors exert on them.
    fn greatest_efforts(&self) -> Vec<String> {
        let (limb, efforts) = (self.limb, self.limb.efforts());
        let slides: Vec<&str> = limb.joints_that(true);
        let given = limb.driven().into_iter().filter(|&dof| efforts[dof].is_finite());
        let each = given.map(|dof| {
            let joint = &limb.joints()[dof];
            let unit = if slides.contains(&joint.as_str()) { "N" } else { "N m" };
            format!("#     {joint}: {:?} {unit}\n", plain(efforts[dof]))
        });
        each.collect()
    }

    /// Speeds of joints, where the file gives them.
    fn speeds(&self, text: &mut String) {
        let joints = self.limb.planning.tree.joint_indices();
        let speed = |dof: usize| self.limb.planning.robot.joints[joints[dof]].limits.velocity;
        self.limits(text, ("joint_velocity", str::to_owned), ["rad/s", "m/s"], speed);
    }

    /// Torques and forces of drives, where the file gives them and they are controls.
    fn efforts(&self, text: &mut String) {
        if self.is_by_torque() {
            let (driven, efforts) = (self.limb.driven(), self.limb.efforts());
            let effort = |dof: usize| if driven.contains(&dof) { efforts[dof] } else { f64::INFINITY };
            self.limits(text, ("control", |joint| format!("tau.{joint}")), ["N m", "N"], effort);
        }
    }

    /// Limits of joints that turn and of those that slide, in their units, where the file gives them; `select` names
    /// what is limited of a joint.
    fn limits(
        &self,
        text: &mut String,
        (kind, select): (&str, fn(&str) -> String),
        units: [&str; 2],
        most: impl Fn(usize) -> f64,
    ) {
        let planning = &self.limb.planning;
        for (slides, unit) in [false, true].into_iter().zip(units) {
            let joints = planning.tree.joint_indices().iter().map(|&joint| &planning.robot.joints[joint]).enumerate();
            let of_kind = joints.filter(|(_, joint)| (joint.kind == JointKind::Prismatic) == slides);
            let given = of_kind.map(|(dof, joint)| (select(&joint.name), most(dof)));
            let (names, most): (Vec<_>, Vec<_>) = given.filter(|(_, most)| most.is_finite() && *most > 0.0).unzip();
            limit(text, kind, &names, &most, unit, self.enforced);
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

/// A limit on both sides of 0, where there is anything to limit.
fn limit(text: &mut String, kind: &str, select: &[String], most: &[f64], unit: &str, enforced: bool) {
    if select.is_empty() {
        return;
    }
    // Rounding must not exceed the limits of the file.
    let below = |most: f64| if plain(most) > most { plain(most * (1.0 - 5e-6)) } else { most };
    let most: Vec<f64> = most.iter().copied().map(below).collect();
    let least: Vec<f64> = most.iter().map(|most| -most).collect();
    let _ = writeln!(text, "[[tasks.limits]]\nkind = {kind:?}\nselect = {}", names(select));
    said(text, &format!("lower = {}", list(&least)), &format!("{unit}, of the robot file"));
    let _ = writeln!(text, "upper = {}", list(&most));
    if enforced {
        said(text, "enforce = true", "without it, the plan exceeds these limits");
    }
    text.push('\n');
}
