//! The task of a template: start, noise and costs.

use std::fmt::Write;

use supple_robot::vector::{add, dot, scale};

use super::{Draft, Limit, Template, list, names, plain, said};
use crate::commands::new::place::FEW;
use crate::commands::new::rules::{STEPS, digits};

impl Draft<'_> {
    pub(super) fn task(&self, text: &mut String) {
        let rules = self.rules;
        let _ = write!(text, "\n[[tasks]]\nname = {:?}\n", self.template.words().0);
        said(text, &format!("steps = {STEPS}"), &format!("{:?} s", rules.time));
        said(text, &format!("time_step = {:?}", rules.time_step()), "s");
        if let Some(Limit { bound, precise, coarse }) = self.limit {
            let sensors = if self.template == Template::Reach { "joint sensors" } else { "force sensor" };
            let _ = writeln!(
                text,
                "# Expected cost: at least {} with the precise {sensors}, and at least {} with the coarsest. The limit is {} % of\n\
                 # the way: the sensor must save the rest.\nbound = {bound:?}",
                plain(digits(precise)),
                plain(digits(coarse)),
                plain(100.0 * rules.margin),
            );
        }
        self.initial_state(text);
        self.noise(text);
    }

    fn initial_state(&self, text: &mut String) {
        let Self { start, rules, limb, .. } = self;
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
        // The tool hangs in its mount, and presses already where it holds.
        let [x, y] = start.along;
        let pressed = if self.template == Template::Hold { rules.force } else { 0.0 };
        let loads = [x, y, scale(-1.0, start.normal)].map(|axis| rules.mass * dot(axis, limb.gravity));
        let loads = [loads[0], loads[1], loads[2] - pressed].map(|load| if load.abs() < 1e-3 * rules.force { 0.0 } else { digits(load) });
        for (axis, load) in self.axes().iter().zip(loads).filter(|(_, load)| *load != 0.0) {
            let value = match self.yielding().contains(axis) {
                true => format!("\"{load:?} / k\""),
                false => format!("{:?}", digits(load / rules.stiffness)),
            };
            let why = if self.template == Template::Hold && axis.ends_with('z') { "the force" } else { "the weight of the tool" };
            said(text, &format!("\"q.{axis}\" = {value}"), &format!("m: under {why}"));
        }
        let normal = if self.template == Template::Insert { loads[0] } else { loads[2] };
        let beyond = if self.template == Template::Hold { rules.smoothing } else { 0.0 };
        if self.template.touches() && (normal != 0.0 || beyond != 0.0) {
            let value = match (normal != 0.0, beyond != 0.0) {
                (true, true) => format!("\"{beyond:?} - {normal:?} / k\"").replace("- -", "+ "),
                (true, false) => format!("\"{:?} / k\"", -normal),
                (false, _) => format!("{beyond:?}"),
            };
            said(text, &format!("\"c.wall\" = {value}"), "m: the wall from its `point`, where the tool is");
        }
    }

    fn noise(&self, text: &mut String) {
        let Self { rules, limb, .. } = self;
        let (mount, dt) = (self.mount_name(), rules.time_step());
        // Joints that slide wander as far as the tool of a limb that turns.
        let wander = if limb.slides() { digits(rules.disturbance * limb.reach) } else { rules.disturbance };
        let speed = 0.01 * rules.travel / rules.time;
        let mut initial = vec![
            ("q.*".to_owned(), rules.joint_sd(limb)),
            ("v.*".to_owned(), speed / limb.lever()),
            (format!("q.{mount}_*"), 0.1 * rules.wall_sd),
            (format!("v.{mount}_*"), speed),
        ];
        // A wall that is held is known where the tool presses, and wanders.
        let wanders = self.template == Template::Hold;
        if self.template.touches() {
            initial.push(("c.wall".to_owned(), if wanders { 0.2 * rules.wall_sd } else { rules.wall_sd }));
        }
        if self.template == Template::Handle {
            let door = self.door_name();
            initial.push((format!("q.{door}_x"), 2.0 * rules.wall_sd));
            initial.push((format!("v.{door}_x"), 0.0));
        }
        let mut process = vec![("v.*".to_owned(), wander), (format!("v.{mount}_*"), 0.2 * wander * limb.lever())];
        if wanders {
            process.push(("c.wall".to_owned(), rules.wall_sd));
        }
        if self.template == Template::Handle {
            process.push((format!("v.{}_x", self.door_name()), 0.0));
        }
        let table = |rows: &[(String, f64)], factor: f64| -> String {
            let rows = rows.iter().map(|(name, number)| format!("\"{name}\" = {:?}", digits(factor * number)));
            rows.collect::<Vec<_>>().join(", ")
        };
        let _ = write!(
            text,
            "\n[tasks.noise]                    # standard deviations; of the process per step\ninitial_deviation = {{ {} }}\n",
            table(&initial, 1.0)
        );
        let _ = writeln!(
            text,
            "# Joint velocities drift by {wander:?} {} in one second{}; in a step, by that times the square root of the time step.\n\
             process_deviation = {{ {} }}",
            limb.speed_unit(),
            if wanders { format!(", the wall by {:?} m", rules.wall_sd) } else { String::new() },
            table(&process, dt.sqrt())
        );
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
        let point = |text: &mut String, target: [f64; 3], axes: &[usize], is_end: bool| {
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
            let on_the_way = if is_end { rules.travel } else { rules.tolerance };
            let weight = rules.weight(on_the_way);
            said(text, &format!("weight = {weight:?}"), &format!("tolerance {on_the_way:?} m"));
            if is_end {
                let weight = rules.final_weight(rules.tolerance);
                said(text, &format!("final_weight = {weight:?}"), &format!("tolerance {:?} m", rules.tolerance));
            }
            text.push('\n');
        };
        let tenth = digits(0.1 * rules.force);
        let along = self.free_axes(start.normal);
        let [x, _, z] = self.axes();
        match self.template {
            Template::Press | Template::Hold => {
                force(text, rules.force, tenth);
                point(text, start.position, &along, false);
                self.deflection(text, &z);
            }
            Template::Wipe => {
                force(text, rules.force, tenth);
                point(text, add(start.position, scale(rules.travel, start.along[0])), &along, true);
                self.deflection(text, &z);
            }
            Template::Insert => {
                let into = scale(-rules.travel, start.normal);
                force(text, rules.force, tenth);
                point(text, add(start.position, into), &self.free_axes(self.side()), true);
                self.deflection(text, &x);
            }
            Template::Reach => {
                point(text, start.moved(limb, rules.travel), &[0, 1, 2], true);
            }
            Template::Handle => {
                let _ = writeln!(
                    text,
                    "[[tasks.costs]]\nkind = \"joint_position\"\nselect = [\"{}_rz\"]",
                    self.door_name()
                );
                said(text, &format!("target = [{:?}]", self.opening()), "rad: the door is pulled open");
                let (on_the_way, last) = (self.opening(), digits(0.1 * self.opening()));
                said(text, &format!("weight = {:?}", rules.weight(on_the_way)), &format!("tolerance {on_the_way:?} rad"));
                said(text, &format!("final_weight = {:?}", rules.final_weight(last)), &format!("tolerance {last:?} rad"));
                text.push('\n');
                let tolerance = digits(0.2 * rules.force);
                let _ = writeln!(text, "[[tasks.costs]]\nkind = \"coupling_force\"\ncoupling = {x:?}");
                let weight = rules.weight(tolerance);
                said(text, &format!("weight = {weight:?}"), &format!("tolerance {tolerance:?} N, towards the hinge"));
                text.push('\n');
                self.deflection(text, &z);
            }
        }
        let speed = rules.joint_speed(limb);
        let _ = writeln!(text, "[[tasks.costs]]\nkind = \"joint_velocity\"\nselect = {}", names(limb.joints()));
        said(
            text,
            &format!("weight = {:?}", rules.weight(speed)),
            &format!("tolerance {speed:?} {}", limb.speed_unit()),
        );
        text.push_str("\n[[tasks.costs]]\nkind = \"control\"\n");
        let (tolerance, [turn, slide]) =
            if self.is_by_torque() { (rules.load(limb), ["N m", "N"]) } else { (rules.command(limb), ["rad", "m"]) };
        let unit = if limb.slides() { slide } else { turn };
        said(text, &format!("target = {}", list(&self.holding())), "the controls that hold the start");
        said(text, &format!("weight = {:?}", rules.weight(tolerance)), &format!("tolerance {tolerance:?} {unit}"));
        text.push('\n');
    }

    /// The cost of a mount that yields far.
    fn deflection(&self, text: &mut String, coupling: &str) {
        let rules = self.rules;
        let _ = writeln!(text, "[[tasks.costs]]\nkind = \"coupling_deflection\"\ncoupling = {coupling:?}");
        let weight = rules.weight(rules.deflection);
        said(text, &format!("weight = {weight:?}"), &format!("tolerance {:?} m", rules.deflection));
        text.push('\n');
    }
}
