//! The tasks that are offered for custom robots, as commented text.

mod followed;
mod numbers;
mod task;
mod world;

use std::fmt::Write;

use super::limb::Limb;
use super::place::Start;
use super::rules::Rules;
use crate::template::Template;

/// All that a task file is written from.
#[derive(Clone)]
pub struct Draft<'a> {
    pub template: Template,
    pub title: &'a str,
    /// The robot's file and package roots, from the folder of the task file.
    pub file: String,
    pub package_roots: Vec<String>,
    pub limb: &'a Limb,
    pub start: &'a Start,
    pub rules: &'a Rules,
    /// The limit of the cost, with the cost that it was found from.
    pub limit: Option<(f64, f64)>,
    pub enforce: bool,
    /// Whether the tool begins where the contact sets in, as no plan finds the wall from farther.
    pub near: bool,
}

/// A list of numbers, with as many digits as they need.
fn list(numbers: &[f64]) -> String {
    let shown: Vec<_> = numbers.iter().map(|&number| format!("{:?}", plain(number))).collect();
    format!("[{}]", shown.join(", "))
}

fn names(names: &[impl AsRef<str>]) -> String {
    let shown: Vec<_> = names.iter().map(|name| format!("{:?}", name.as_ref())).collect();
    format!("[{}]", shown.join(", "))
}

/// A number with six digits, without a sign where it is 0.
fn plain(value: f64) -> f64 {
    if value.abs() < 1e-9 { 0.0 } else { format!("{value:.5e}").parse().unwrap_or(value) }
}

/// A line with a comment in the column where comments stand.
fn said(text: &mut String, line: &str, comment: &str) {
    let _ = writeln!(text, "{line:<32} # {comment}");
}

impl Draft<'_> {
    /// The same with a limit of the cost, and the cost that it was found from.
    pub fn limited(&self, limit: (f64, f64)) -> Self {
        Self { limit: Some(limit), ..self.clone() }
    }

    /// The task file.
    pub fn text(&self) -> String {
        let mut text = String::new();
        self.head(&mut text);
        self.mount(&mut text);
        self.world(&mut text);
        self.sensors(&mut text);
        self.parameters(&mut text);
        self.task(&mut text);
        self.costs(&mut text);
        self.followed(&mut text);
        text += "\n[design]                         # larger values explore more local minima but take longer\nstarts = 1\nrounds = 2\nbranch_attempts = 6\n";
        text
    }

    fn mount_name(&self) -> String {
        self.limb.free_name("mount")
    }

    fn door_name(&self) -> String {
        self.limb.free_name("door")
    }

    /// Joints of the mount: across, across and along the direction that it pushes in.
    fn axes(&self) -> [String; 3] {
        ["x", "y", "z"].map(|axis| format!("{}_{axis}", self.mount_name()))
    }

    /// Those of them whose stiffness is designed.
    fn yielding(&self) -> Vec<String> {
        let [x, y, z] = self.axes();
        match self.template {
            Template::Insert => vec![x, y],
            Template::Reach => vec![x, y, z],
            _ => vec![z],
        }
    }

    fn head(&self, text: &mut String) {
        let (name, what) = self.template.words();
        let Self { limb, .. } = self;
        let _ = write!(
            text,
            "# Template `{name}`: {what}. The tool is on a compliant mount at `{}`.\n#\n\
             # Try:\n#     supple evaluate FILE    plan, information and cost\n\
             #     supple design FILE      mount and sensor with the least information within the cost limit\n\
             #     supple check FILE       compare every derivative with finite differences\n#\n\
             # docs/tasks.md lists all keys, docs/choosing.md explains the rules of thumb behind the numbers.\n\
             title = {:?}\n\n[model]\nkind = \"robot\"\nfile = {:?}\n",
            limb.frame, self.title, self.file
        );
        if !self.package_roots.is_empty() {
            let _ = writeln!(text, "package_roots = {}", names(&self.package_roots));
        }
        if let Some(line) = limb.planning.locked_line() {
            let _ = writeln!(
                text,
                "# Joints that do not move `{}`, or that move nothing with inertia.\n{line}",
                limb.frame
            );
        }
        if let Some(driven) = driven(limb) {
            let _ = writeln!(text, "actuated = {}   # the file gives the other joints no effort", names(&driven));
        }
        if limb.planning.robot.gravity.is_none() {
            said(text, "gravity = [0.0, 0.0, -9.81]", "m/s^2");
        }
    }

    fn mount(&self, text: &mut String) {
        let Self { limb, start, rules, template, .. } = self;
        let across = rules.stiffness;
        let (stiffness, damping) = match template {
            Template::Insert => {
                (format!("[\"k\", \"k\", {across:?}]"), format!("[\"d\", \"d\", {:?}]", rules.damping()))
            }
            Template::Reach => ("\"k\"".to_owned(), "\"d\"".to_owned()),
            _ => (format!("[{across:?}, {across:?}, \"k\"]"), format!("[{d:?}, {d:?}, \"d\"]", d = rules.damping())),
        };
        let _ = write!(
            text,
            "\n# The mount: three slides with springs, and the tool beyond them. z points {}.\n\
             [[model.insert]]\nname = {:?}\nframe = {:?}\nrpy = {}\n",
            if template.touches() { "into the wall" } else { "ahead" },
            self.mount_name(),
            limb.frame,
            list(&start.mount),
        );
        let _ = writeln!(text, "axes = [\"x\", \"y\", \"z\"]");
        said(
            text,
            &format!("mass = {:?}", rules.mass),
            &format!("kg: the tool, 2 % of the mass of the limb, {} kg", plain(round3(limb.mass))),
        );
        said(text, &format!("stiffness = {stiffness}"), "N/m");
        said(text, &format!("damping = {damping}"), "N s/m");
    }
}

fn round3(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Joints with drives, where the file gives some of them no effort; none where all have drives.
fn driven(limb: &Limb) -> Option<Vec<&str>> {
    let (robot, tree) = (&limb.planning.robot, &limb.planning.tree);
    if !robot.actuators.is_empty() {
        return None;
    }
    let joints = || tree.joint_indices().iter().map(|&joint| &robot.joints[joint]);
    let driven: Vec<&str> =
        joints().filter(|joint| joint.limits.effort > 0.0).map(|joint| joint.name.as_str()).collect();
    (!driven.is_empty() && driven.len() < joints().count()).then_some(driven)
}
