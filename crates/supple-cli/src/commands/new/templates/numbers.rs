//! Sensors and parameters of a template.

use std::fmt::Write;

use supple_robot::JointKind;

use super::{Draft, Template, names, plain, said};
use crate::commands::new::rules::{Rules, digits};

impl Draft<'_> {
    pub(super) fn sensors(&self, text: &mut String) {
        let Self { limb, rules, .. } = self;
        let robot = &limb.planning.robot;
        let own: Vec<&supple_robot::Sensor> = robot.sensors.iter().filter(|sensor| sensor.noise > 0.0).collect();
        let encoder = if self.template == Template::Reach { "\"joint_noise\"".to_owned() } else { String::new() };
        if own.is_empty() || !encoder.is_empty() {
            let indices = limb.planning.tree.joint_indices();
            for (slides, sd, unit) in [(false, rules.joint_sd(limb), "rad^2"), (true, rules.tip_sd, "m^2")] {
                let of_kind = indices.iter().filter(|&&j| (robot.joints[j].kind == JointKind::Prismatic) == slides);
                let joints: Vec<&str> = of_kind.map(|&joint| robot.joints[joint].name.as_str()).collect();
                if joints.is_empty() {
                    continue;
                }
                let variance = if encoder.is_empty() { format!("{:?}", digits(sd * sd)) } else { encoder.clone() };
                let _ = write!(text, "\n[[model.sensors]]\nkind = \"joint_position\"\nselect = {}\n", names(&joints));
                let comment = if slides {
                    format!("{unit}: deviation {sd:?}")
                } else {
                    format!("{unit}: deviation {sd:?}, or {:?} m at the tool", rules.tip_sd)
                };
                said(text, &format!("variance = {variance}"), if encoder.is_empty() { &comment } else { unit });
            }
        } else {
            for sensor in own {
                let _ = write!(text, "\n[[model.sensors]]\nkind = \"file\"\nselect = [{:?}]\n", sensor.name);
                said(
                    text,
                    &format!("variance = {:?}", digits(sensor.noise * sensor.noise)),
                    "the noise in the robot file",
                );
            }
        }
        if self.template == Template::Reach {
            return;
        }
        text.push_str("\n# A force sensor in the mount.\n");
        for axis in self.axes() {
            let _ = write!(
                text,
                "[[model.sensors]]\nkind = \"coupling_force\"\ncoupling = {axis:?}\nvariance = \"force_noise\"\n\n"
            );
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }

    pub(super) fn parameters(&self, text: &mut String) {
        let Self { rules, limb, .. } = self;
        let Rules { stiffness, force_sd, force, .. } = **rules;
        let damping = rules.damping();
        let mut parameter = |name: &str, what: &str, numbers: [f64; 3], unit: &str, note: &str| {
            let [initial, lower, upper] = numbers.map(digits);
            text.push('\n');
            said(text, &format!("[parameters.{name}]"), what);
            said(text, &format!("initial = {initial:?}"), note);
            let _ = writeln!(text, "bounds = [{lower:?}, {upper:?}]\nscale = \"log\"\nunit = {unit:?}");
        };
        let deflection = plain(force / stiffness);
        let stiff = format!("stiff: {force:?} N deflect it by {deflection:?} m");
        parameter("k", "stiffness of the mount", [stiffness, rules.soft(), stiffness], "N/m", &stiff);
        parameter("d", "damping of the mount", [damping, 0.1 * damping, 2.0 * damping], "N s/m", "half of critical");
        if self.template == Template::Reach {
            let precise = rules.joint_sd(limb).powi(2);
            parameter(
                "joint_noise",
                "variance of the joint sensors",
                [precise, precise, 1e4 * precise],
                if limb.slides() { "m^2" } else { "rad^2" },
                &if limb.slides() {
                    format!("precise: deviation {:?} m", rules.joint_sd(limb))
                } else {
                    format!("precise: deviation {:?} rad, or {:?} m at the tool", rules.joint_sd(limb), rules.tip_sd)
                },
            );
        } else {
            let precise = force_sd * force_sd;
            parameter(
                "force_noise",
                "variance of the force sensor",
                [precise, precise, 1e4 * precise],
                "N^2",
                &format!("precise: deviation {:?} N; its square root is the deviation", digits(force_sd)),
            );
        }
    }
}
