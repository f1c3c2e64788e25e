//! The task of a template: start and noise.

use std::fmt::Write;

use supple_robot::vector::{dot, scale};

use super::{Draft, Limit, Template, list, said};
use crate::commands::new::place::FEW;
use crate::commands::new::rules::{four_digits, plain};

impl Draft<'_> {
    pub(super) fn task(&self, text: &mut String) {
        let rules = &self.rules;
        let _ = write!(text, "\n[[tasks]]\nname = {:?}\n", self.template.words().0);
        said(text, &format!("steps = {}", rules.steps()), &format!("{:?} s", rules.time));
        said(text, &format!("time_step = {:?}", rules.time_step()), "s");
        if let Some(Limit { bound, precise, coarse }) = self.limit {
            let sensors = if self.template == Template::Reach { "joint sensors" } else { "force sensor" };
            let _ = writeln!(
                text,
                "# The least expected cost is {} with the precise {sensors} and {} with the coarsest. The limit lies {} % of the\n\
                 # way from the first to the second: above the second, no sensor would be needed.\nbound = {bound:?}",
                plain(four_digits(precise)),
                plain(four_digits(coarse)),
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
                let (frame, position) = (limb.frame(), list(&start.position));
                format!("pose = {{ frame = {frame:?}, position = {position}{turned} }}   # by inverse kinematics\n")
            }
        );
        for dof in limb.sprung().into_iter().filter(|_| limb.joints().len() >= FEW) {
            let (joint, q) = (&limb.joints()[dof], plain(start.q[dof]));
            said(text, &format!("\"q.{joint}\" = {q:?}"), "where its spring holds it");
        }
        let loads = self.loads();
        for (axis, load) in self.axes().iter().zip(loads).filter(|(_, load)| *load != 0.0) {
            let value = match self.yielding().contains(axis) {
                true => format!("\"{load:?} / k\""),
                false => format!("{:?}", four_digits(load / rules.stiffness)),
            };
            let why = if self.template == Template::Hold && axis.ends_with('z') {
                "the force"
            } else {
                "the weight of the tool"
            };
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
            said(text, &format!("\"c.wall\" = {value}"), "m: position of the wall along its normal, from `point`");
        }
    }

    /// Loads on the mount's springs at the start, N: the weight of the tool hanging in the mount and, if it already
    /// presses, the contact force.
    pub(super) fn loads(&self) -> [f64; 3] {
        let Self { start, rules, limb, .. } = self;
        let [x, y] = start.along;
        let pressed = if self.template == Template::Hold { rules.force } else { 0.0 };
        let loads = [x, y, scale(-1.0, start.normal)].map(|axis| rules.mass * dot(axis, limb.gravity));
        [loads[0], loads[1], loads[2] - pressed]
            .map(|load| if load.abs() < 1e-3 * rules.force { 0.0 } else { four_digits(load) })
    }

    fn noise(&self, text: &mut String) {
        let Self { rules, limb, .. } = self;
        let (mount, dt) = (self.mount_name(), rules.time_step());
        // Joints that slide wander as far as the tool of a limb that turns.
        let wander = if limb.slides() { four_digits(rules.disturbance * limb.reach) } else { rules.disturbance };
        let speed = 0.01 * rules.travel / rules.time;
        let mut initial = vec![
            ("q.*".to_owned(), rules.joint_sd(limb)),
            ("v.*".to_owned(), speed / limb.lever()),
            (format!("q.{mount}_*"), 0.1 * rules.wall_sd),
            (format!("v.{mount}_*"), speed),
        ];
        // If the tool already presses, the wall's position is known well, but it drifts.
        let wanders = self.template == Template::Hold;
        if self.template.touches() {
            initial.push(("c.wall".to_owned(), if wanders { 0.2 * rules.wall_sd } else { rules.wall_sd }));
        }
        if self.template == Template::Handle {
            let hinge = self.hinge_name();
            initial.push((format!("q.{hinge}_rz"), self.direction_sd()));
            initial.push((format!("v.{hinge}_rz"), 0.0));
        }
        let mut process = vec![("v.*".to_owned(), wander), (format!("v.{mount}_*"), 0.2 * wander * limb.lever())];
        if wanders {
            process.push(("c.wall".to_owned(), rules.wall_sd));
        }
        if self.template == Template::Handle {
            process.push((format!("v.{}_rz", self.hinge_name()), 0.0));
        }
        let table = |rows: &[(String, f64)], factor: f64| -> String {
            let rows = rows.iter().map(|(name, number)| format!("\"{name}\" = {:?}", four_digits(factor * number)));
            rows.collect::<Vec<_>>().join(", ")
        };
        let _ = write!(
            text,
            "\n[tasks.noise]                    # standard deviations; of the process per step\ninitial_deviation = {{ {} }}\n",
            table(&initial, 1.0)
        );
        let wall = match wanders {
            true => format!("the wall drifts by {:?} m and joint velocities", rules.wall_sd),
            false => "joint velocities drift".to_owned(),
        };
        let _ = writeln!(
            text,
            "# In one second, {wall} by {wander:?} {}; in a step, by that times the square root of the time step.\n\
             process_deviation = {{ {} }}",
            limb.speed_unit(),
            table(&process, dt.sqrt())
        );
    }
}
