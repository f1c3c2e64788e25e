//! The costs of a template.

use std::fmt::Write;

use supple_robot::vector::{add, scale};

use super::{Draft, Template, list, names, said};
use crate::commands::new::place::FEW;
use crate::commands::new::rules::{four_digits, plain};

/// Speeds at the end of a motion that ends at rest, as a share of those on the way.
const REST: f64 = 0.05;

impl Draft<'_> {
    pub(super) fn costs(&self, text: &mut String) {
        let Self { start, rules, limb, .. } = self;
        text.push_str("\n# Weights (Bryson's rule): a constant error equal to the tolerance adds 1 to the cost.\n");
        let along = self.free_axes(start.normal);
        let [x, _, z] = self.axes();
        // Where the tool is while it presses: on a wall that is oblique to the world, the cost counts that direction too.
        let pressed = |normal: [f64; 3], at: [f64; 3]| add(at, scale(-rules.smoothing, normal));
        match self.template {
            Template::Press | Template::Hold => {
                let at = start.position;
                let at = if self.template == Template::Press { pressed(start.normal, at) } else { at };
                self.force(text);
                self.point(text, at, &along, false);
                self.deflection(text, &z);
            }
            Template::Wipe => {
                self.force(text);
                let end = pressed(start.normal, start.along_wall(limb, rules.travel));
                self.point(text, end, &along, true);
                self.deflection(text, &z);
            }
            Template::Insert => {
                let end = add(start.position, scale(-rules.travel, start.normal));
                self.force(text);
                self.point(text, pressed(scale(-1.0, self.side()), end), &self.free_axes(self.side()), true);
                self.deflection(text, &x);
            }
            Template::Reach => self.point(text, start.moved(limb, rules.travel), &[0, 1, 2], true),
            Template::Handle => {
                self.opened(text);
                self.deflection(text, &z);
            }
        }
        self.motion(text);
    }

    /// How far the tool moves along the wall, m, where that is less than the travel.
    pub fn travelled(&self) -> Option<f64> {
        let (limb, travel) = (self.limb, self.rules.travel);
        let is_along = match self.template {
            Template::Wipe => true,
            Template::Reach => limb.joints().len() >= FEW,
            _ => false,
        };
        is_along.then(|| self.start.travelled(limb, travel)).filter(|&by| by < travel)
    }

    /// The axes of the world that are along the wall, where the wall is along axes; all otherwise.
    fn free_axes(&self, normal: [f64; 3]) -> Vec<usize> {
        let across = |axis: &usize| normal[*axis].abs() < 1e-6;
        let free: Vec<usize> = (0..3).filter(across).collect();
        if free.len() == 2 { free } else { vec![0, 1, 2] }
    }

    /// The cost of the force on the wall.
    fn force(&self, text: &mut String) {
        let rules = &self.rules;
        let (target, tolerance) = (rules.force, four_digits(0.1 * rules.force));
        let _ = writeln!(text, "[[tasks.costs]]\nkind = \"contact_force\"\ncontact = \"wall\"");
        said(text, &format!("target = {target:?}"), "N");
        said(text, &format!("smoothing = {:?}", four_digits(0.1 * target)), "N");
        said(text, &format!("weight = {:?}", rules.weight(tolerance)), &format!("tolerance {tolerance:?} N"));
        text.push('\n');
    }

    /// The cost of the position of the tool along axes of the world, all the time or at the end.
    fn point(&self, text: &mut String, target: [f64; 3], axes: &[usize], is_end: bool) {
        let rules = &self.rules;
        let _ = writeln!(text, "[[tasks.costs]]\nkind = \"frame_point\"\nframe = {:?}", self.mount_name());
        if axes.len() < 3 {
            let shown: Vec<_> = axes.iter().map(|&axis| ["x", "y", "z"][axis]).collect();
            let _ = writeln!(text, "axes = {}", names(&shown));
        }
        let target: Vec<f64> = axes.iter().map(|&axis| target[axis]).collect();
        let remark = match is_end.then(|| self.travelled()).flatten() {
            Some(by) => format!("m: {by:?} m away, half of the travel: the tool reaches no farther"),
            None => "m".to_owned(),
        };
        said(text, &format!("target = {}", list(&target)), &remark);
        let always = if is_end { rules.travel } else { rules.tolerance };
        said(text, &format!("weight = {:?}", rules.weight(always)), &format!("tolerance {always:?} m"));
        if is_end {
            let (weight, last) = (rules.final_weight(rules.tolerance), rules.tolerance);
            said(text, &format!("final_weight = {weight:?}"), &format!("tolerance {last:?} m"));
        }
        text.push('\n');
    }

    /// The costs of a door: its angle, and the forces that do not move it.
    fn opened(&self, text: &mut String) {
        let rules = &self.rules;
        let _ = writeln!(text, "[[tasks.costs]]\nkind = \"joint_position\"\nselect = [\"{}_rz\"]", self.door_name());
        said(text, &format!("target = [{:?}]", self.opening()), "rad: the door is pulled open");
        let (always, last) = (self.opening(), self.opening_tolerance());
        said(text, &format!("weight = {:?}", rules.weight(always)), &format!("tolerance {always:?} rad"));
        said(text, &format!("final_weight = {:?}", rules.final_weight(last)), &format!("tolerance {last:?} rad"));
        // A door moves neither towards its hinge nor along it, whatever force the tool exerts there.
        let (tolerance, directions) = (four_digits(0.2 * rules.force), ["towards the hinge", "along the hinge"]);
        for ((across, load), direction) in self.axes().iter().zip(self.loads()).zip(directions) {
            let _ = writeln!(text, "\n[[tasks.costs]]\nkind = \"coupling_force\"\ncoupling = {across:?}");
            if load != 0.0 {
                said(text, &format!("target = [{:?}]", -load), "N: the weight of the tool");
            }
            let weight = rules.weight(tolerance);
            said(text, &format!("weight = {weight:?}"), &format!("tolerance {tolerance:?} N, {direction}"));
        }
        text.push('\n');
    }

    /// The costs of joint speeds, of accelerations and of controls.
    fn motion(&self, text: &mut String) {
        let Self { rules, limb, .. } = self;
        for (slides, unit) in [(false, "rad"), (true, "m")] {
            let joints = limb.joints_that(slides);
            if joints.is_empty() {
                continue;
            }
            let [speed, acceleration] = [rules.joint_speed(limb, slides), rules.joint_acceleration(limb, slides)];
            for (kind, tolerance, per) in [("joint_velocity", speed, "s"), ("joint_acceleration", acceleration, "s^2")]
            {
                let _ = writeln!(text, "[[tasks.costs]]\nkind = {kind:?}\nselect = {}", names(&joints));
                let remark = format!("tolerance {tolerance:?} {unit}/{per}");
                said(text, &format!("weight = {:?}", rules.weight(tolerance)), &remark);
                if kind == "joint_velocity" && self.template == Template::Reach {
                    let rest = REST * tolerance;
                    let remark = format!("tolerance {:?} {unit}/{per}: at rest", plain(rest));
                    said(text, &format!("final_weight = {:?}", plain(four_digits(rest.powi(-2)))), &remark);
                }
                text.push('\n');
            }
        }
        text.push_str("[[tasks.costs]]\nkind = \"control\"\n");
        let (tolerance, [turn, slide]) =
            if self.is_by_torque() { (rules.load(limb), ["N m", "N"]) } else { (rules.command(limb), ["rad", "m"]) };
        let unit = if limb.slides() { slide } else { turn };
        said(text, &format!("target = {}", list(&self.holding())), "the controls that hold the robot at the start");
        said(text, &format!("weight = {:?}", rules.weight(tolerance)), &format!("tolerance {tolerance:?} {unit}"));
        text.push('\n');
    }

    /// The cost of the deflection of the mount.
    fn deflection(&self, text: &mut String, coupling: &str) {
        let rules = &self.rules;
        let _ = writeln!(text, "[[tasks.costs]]\nkind = \"coupling_deflection\"\ncoupling = {coupling:?}");
        let weight = rules.weight(rules.deflection);
        said(text, &format!("weight = {weight:?}"), &format!("tolerance {:?} m", rules.deflection));
        text.push('\n');
    }
}
