//! The task of a template: start, noise and costs.

use std::fmt::Write;

use supple_robot::vector::{add, scale};

use super::{Draft, Template, list, names, plain, said};
use crate::commands::new::place::FEW;
use crate::commands::new::rules::{STEPS, digits};

impl Draft<'_> {
    pub(super) fn task(&self, text: &mut String) {
        let Self { start, rules, limb, .. } = self;
        let _ = write!(text, "\n[[tasks]]\nname = {:?}\n", self.template.words().0);
        said(text, &format!("steps = {STEPS}"), &format!("{:?} s", rules.time));
        said(text, &format!("time_step = {:?}", rules.time_step()), "s");
        if let Some((limit, cost)) = self.limit {
            said(
                text,
                &format!("bound = {limit:?}"),
                &format!(
                    "{:?} times the expected cost {} of this stiff design, found by evaluation",
                    rules.margin,
                    plain(cost)
                ),
            );
        }
        if self.enforce {
            said(text, "enforce_effort_limits = true", "without it, the plan exceeds efforts of the file");
        }
        let turned = start.rpy.map_or_else(String::new, |rpy| format!(", rpy = {}", list(&rpy)));
        let _ = write!(
            text,
            "\n[tasks.initial_state]\n{}",
            if limb.joints().len() < FEW {
                let positions = limb.joints().iter().zip(&start.q);
                positions.map(|(joint, q)| format!("\"q.{joint}\" = {:?}\n", plain(*q))).collect::<String>()
            } else {
                let (frame, position) = (&limb.frame, list(&start.position));
                format!("pose = {{ frame = {frame:?}, position = {position}{turned} }}   # by inverse kinematics\n")
            }
        );
        if self.template == Template::Insert {
            said(text, &format!("\"c.wall\" = {:?}", digits(0.4 * rules.clearance)), "m: offset of the actual hole");
        }
        let wander = rules.disturbance;
        let (mount, q) = (self.mount_name(), digits(rules.tip_sd.powi(2) / limb.lever().powi(2) * 25.0));
        let m = digits((0.1 * rules.clearance).powi(2) * 1e-2);
        let v = digits((0.1 * rules.travel / rules.time / limb.lever()).powi(2) * 1e-2);
        let vm = digits((0.1 * rules.travel / rules.time).powi(2) * 1e-2);
        let mut initial = vec![
            format!("\"q.*\" = {q:?}"),
            format!("\"v.*\" = {v:?}"),
            format!("\"q.{mount}_*\" = {m:?}"),
            format!("\"v.{mount}_*\" = {vm:?}"),
        ];
        if self.template.touches() {
            initial.push(format!("\"c.wall\" = {:?}", digits(rules.wall_sd.powi(2))));
        }
        let _ = write!(
            text,
            "\n[tasks.noise]                    # variances; of the process per step\ninitial = {{ {} }}\n",
            initial.join(", ")
        );
        let dt = rules.time_step();
        // Joints that slide wander as far as the tool of a limb that turns.
        let wander = if limb.slides() { digits(wander * limb.reach) } else { wander };
        let tip = wander * limb.lever();
        let (joint, tool) = (digits(wander * wander * dt), digits(tip * tip * dt * 0.04));
        let _ = writeln!(
            text,
            "# Joint velocities drift by {wander:?} {} in one second (one standard deviation).\nprocess = {{ \"v.*\" = {joint:?}, \"v.{mount}_*\" = {tool:?} }}",
            limb.speed_unit()
        );
        if self.template.touches() {
            let _ = writeln!(text, "# The wall's position has a deviation of {:?} m.", rules.wall_sd);
        }
    }

    /// The axes of the world that are along the wall, where the wall is along axes; all otherwise.
    fn free_axes(&self, normal: [f64; 3]) -> Vec<usize> {
        let across = |axis: &usize| normal[*axis].abs() < 1e-6;
        let free: Vec<usize> = (0..3).filter(across).collect();
        if free.len() == 2 { free } else { vec![0, 1, 2] }
    }

    pub(super) fn costs(&self, text: &mut String) {
        let Self { start, rules, limb, .. } = self;
        text.push_str("\n# Weights (Bryson's rule): a constant error equal to the tolerance adds 1 to the cost.\n");
        let force = |text: &mut String, target: f64, tolerance: f64| {
            let _ = writeln!(text, "[[tasks.costs]]\nkind = \"contact_force\"\ncontact = \"wall\"");
            said(text, &format!("target = {target:?}"), "N");
            said(text, &format!("smoothing = {:?}", digits(0.1 * target)), "N");
            said(text, &format!("weight = {:?}", rules.weight(tolerance)), &format!("tolerance {tolerance:?} N"));
            text.push('\n');
        };
        let point = |text: &mut String, target: [f64; 3], axes: &[usize], last: f64| {
            let _ = writeln!(text, "[[tasks.costs]]\nkind = \"frame_point\"\nframe = {:?}", self.mount_name());
            if axes.len() < 3 {
                let _ = writeln!(
                    text,
                    "axes = {}",
                    names(&axes.iter().map(|&axis| ["x", "y", "z"][axis]).collect::<Vec<_>>())
                );
            }
            let target: Vec<f64> = axes.iter().map(|&axis| target[axis]).collect();
            said(text, &format!("target = {}", list(&target)), "m");
            let weight = rules.weight(rules.tolerance);
            said(text, &format!("weight = {weight:?}"), &format!("tolerance {:?} m", rules.tolerance));
            if last > 1.0 {
                let _ = writeln!(text, "final_weight = {:?}", digits(last * weight));
            }
            text.push('\n');
        };
        let tenth = digits(0.1 * rules.force);
        let along = self.free_axes(start.normal);
        match self.template {
            Template::Press => {
                force(text, rules.force, digits(2.0 * tenth));
                point(text, start.position, &along, 1.0);
            }
            Template::Hold => {
                force(text, rules.force, digits(2.0 * tenth));
                point(text, start.position, &along, 1.0);
            }
            Template::Wipe => {
                force(text, rules.force, digits(2.0 * tenth));
                point(text, add(start.position, scale(rules.travel, start.along[0])), &along, 20.0);
            }
            Template::Insert => {
                let into = scale(-rules.travel, start.normal);
                force(text, digits(2.0 * tenth), tenth);
                point(text, add(start.position, into), &self.free_axes(self.side()), 20.0);
            }
            Template::Reach => {
                point(text, start.moved(limb, rules.travel), &[0, 1, 2], 50.0);
            }
            Template::Handle => {
                let _ = writeln!(
                    text,
                    "[[tasks.costs]]\nkind = \"joint_position\"\nselect = [\"{}_rz\"]",
                    self.door_name()
                );
                said(text, &format!("target = [{:?}]", self.opening()), "rad: the door is pulled open");
                let tolerance = digits(0.1 * self.opening());
                said(text, &format!("weight = {:?}", rules.weight(tolerance)), &format!("tolerance {tolerance:?} rad"));
                let _ = writeln!(text, "final_weight = {:?}\n", digits(20.0 * rules.weight(tolerance)));
            }
        }
        let speed = rules.joint_speed(limb);
        let _ = writeln!(text, "[[tasks.costs]]\nkind = \"joint_velocity\"\nselect = {}", names(limb.joints()));
        said(
            text,
            &format!("weight = {:?}", rules.weight(speed)),
            &format!("tolerance {speed:?} {}", limb.speed_unit()),
        );
        let load = rules.load(limb, start);
        text.push_str("\n[[tasks.costs]]\nkind = \"control\"\n");
        let is_servo = !limb.planning.robot.actuators.is_empty();
        let (tolerance, unit) = if is_servo {
            (1.0, "in the unit of the actuators")
        } else {
            (load, if limb.slides() { "N" } else { "N m" })
        };
        said(text, &format!("weight = {:?}", rules.weight(tolerance)), &format!("tolerance {tolerance:?} {unit}"));
    }
}
