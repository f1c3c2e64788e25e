//! Sensors and parameters of a template.

use std::fmt::Write;

use supple_robot::JointKind;

use super::{Draft, Template, names, said};
use crate::commands::new::rules::{Rules, four_digits, plain};

impl Draft<'_> {
    pub(super) fn sensors(&self, text: &mut String) {
        let Self { limb, rules, .. } = self;
        let robot = &limb.planning.robot;
        let own: Vec<&supple_robot::Sensor> = robot.sensors.iter().filter(|sensor| sensor.noise > 0.0).collect();
        let is_designed = self.template == Template::Reach;
        if own.is_empty() || is_designed {
            let indices = limb.planning.tree.joint_indices();
            for slides in [false, true] {
                let of_kind = indices.iter().filter(|&&j| (robot.joints[j].kind == JointKind::Prismatic) == slides);
                let joints: Vec<&str> = of_kind.map(|&joint| robot.joints[joint].name.as_str()).collect();
                if joints.is_empty() {
                    continue;
                }
                let _ = write!(text, "\n[[model.sensors]]\nkind = \"joint_position\"\nselect = {}\n", names(&joints));
                let (sd, unit) = if slides { (rules.tip_sd, "m") } else { (rules.joint_sd(limb), "rad") };
                let tip = if slides { String::new() } else { format!(": {:?} m at the tool", rules.tip_sd) };
                let (deviation, comment) = match (is_designed, slides == limb.slides()) {
                    (false, _) => (format!("{sd:?}"), format!("{unit}{tip}")),
                    (true, true) => ("\"joint_noise\"".to_owned(), unit.to_owned()),
                    // Slides of a limb that also turns: as far as the tool moves.
                    (true, false) => (format!("\"{:?} * joint_noise\"", plain(limb.reach)), unit.to_owned()),
                };
                said(text, &format!("deviation = {deviation}"), &comment);
            }
        } else {
            for sensor in own {
                let _ = write!(text, "\n[[model.sensors]]\nkind = \"file\"\nselect = [{:?}]\n", sensor.name);
                said(text, &format!("deviation = {:?}", four_digits(sensor.noise)), "the noise in the robot file");
            }
        }
        if is_designed {
            return;
        }
        text.push_str("\n# A force sensor in the mount.\n");
        for axis in self.axes() {
            let _ = write!(
                text,
                "[[model.sensors]]\nkind = \"coupling_force\"\ncoupling = {axis:?}\ndeviation = \"force_noise\"\n\n"
            );
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }

    pub(super) fn parameters(&self, text: &mut String) {
        let Self { rules, limb, .. } = self;
        let Rules { stiffness, force_sd, force, .. } = *rules;
        let is_reach = self.template == Template::Reach;
        let mut parameter = |name: &str, what: &str, numbers: [f64; 3], unit: &str, note: &str| {
            let [initial, lower, upper] = numbers.map(four_digits);
            text.push('\n');
            said(text, &format!("[parameters.{name}]"), what);
            said(text, &format!("initial = {initial:?}"), note);
            let _ = writeln!(text, "bounds = [{lower:?}, {upper:?}]\nscale = \"log\"\nunit = {unit:?}");
            if is_reach && name == "k" {
                said(
                    text,
                    "role = \"study\"",
                    "has little effect on free motion: not designed, but available as a slider",
                );
            }
        };
        let first = self.first.unwrap_or(stiffness);
        let deflection = plain(force / first);
        let what = if first < stiffness { "" } else { "stiff: " };
        let note = format!("{what}{force:?} N deflect it by {deflection:?} m");
        parameter("k", "stiffness of the mount", [first, rules.soft(), stiffness], "N/m", &note);
        let noise = |precise: f64| [precise, precise, 40.0 * precise];
        if is_reach {
            let (sd, unit) = (rules.joint_sd(limb), if limb.slides() { "m" } else { "rad" });
            let note = format!("precise: {:?} m at the tool", four_digits(sd * limb.lever()));
            parameter("joint_noise", "standard deviation of the joint sensors", noise(sd), unit, &note);
        } else {
            let note = format!("precise: {} % of the force", plain(100.0 * force_sd / force));
            parameter("force_noise", "standard deviation of the force sensor", noise(force_sd), "N", &note);
        }
    }
}
