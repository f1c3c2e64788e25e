//! The tasks that are offered for custom robots, as commented text.

mod costs;
mod drives;
mod followed;
mod numbers;
mod task;
mod world;

use std::fmt::Write;

use super::limb::Limb;
use super::place::Start;
use super::rules::{Rules, plain};
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
    pub rules: Rules,
    /// The limit of the cost, and what it was found from.
    pub limit: Option<Limit>,
    /// Whether plans keep the limits of the robot.
    pub enforced: bool,
    /// Stiffness at which searches begin if the stiff mount exceeds the cost limit, N/m.
    pub first: Option<f64>,
    /// Roll-outs, where the usual number would be too few.
    pub rollouts: Option<usize>,
    /// Sub-steps, where whole steps are too long.
    pub substeps: Option<usize>,
}

/// A limit of the expected cost.
#[derive(Clone, Copy, Debug)]
pub struct Limit {
    pub bound: f64,
    /// The least cost with the precise sensor.
    pub precise: f64,
    /// The least cost with the coarsest sensor.
    pub coarse: f64,
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

/// A line with a comment in the comment column.
fn said(text: &mut String, line: &str, comment: &str) {
    let _ = writeln!(text, "{line:<32} # {comment}");
}

impl Draft<'_> {
    /// The same with a limit of the cost, and another stiffness to begin with.
    pub fn limited(&self, limit: Limit, first: Option<f64>) -> Self {
        Self { limit: Some(limit), first, ..self.clone() }
    }

    /// The task file.
    pub fn text(&self) -> String {
        let mut text = String::new();
        self.head(&mut text);
        self.drives(&mut text);
        self.mount(&mut text);
        self.world(&mut text);
        self.sensors(&mut text);
        self.parameters(&mut text);
        self.task(&mut text);
        self.costs(&mut text);
        self.followed(&mut text);
        text += "\n[design]                         # larger values explore more local minima but take longer\n\
                 starts = 2\nrounds = 2\nbranch_attempts = 6\n";
        if let Some(rollouts) = self.rollouts {
            said(&mut text, &format!("rollouts = {rollouts}"), "costs of single runs differ a lot here");
        }
        text
    }

    fn mount_name(&self) -> String {
        self.limb.free_name("mount")
    }

    pub(super) fn door_name(&self) -> String {
        self.limb.free_name("door")
    }

    fn hinge_name(&self) -> String {
        self.limb.free_name("hinge")
    }

    /// Joints of the mount: two lateral ones, then the pressing direction.
    fn axes(&self) -> [String; 3] {
        ["x", "y", "z"].map(|axis| format!("{}_{axis}", self.mount_name()))
    }

    /// Those of them whose stiffness is designed.
    fn yielding(&self) -> Vec<String> {
        self.axes()
            .into_iter()
            .zip(self.template.yields())
            .filter(|(_, yields)| *yields)
            .map(|(axis, _)| axis)
            .collect()
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
            limb.frame(),
            self.title,
            self.file
        );
        if !self.package_roots.is_empty() {
            let _ = writeln!(text, "package_roots = {}", names(&self.package_roots));
        }
        if let Some(line) = limb.planning.locked_line() {
            let _ = writeln!(
                text,
                "# Joints that are not of the limb of `{}`, {}or that move no inertia.\n{line}",
                limb.frame(),
                if limb.is_long { "that are not among its last seven, " } else { "" }
            );
        }
        if let Some(substeps) = self.substeps {
            said(text, &format!("substeps = {substeps}"), "roll-outs on whole steps differ from those on finer ones");
        }
        self.actuated(text);
        self.friction(text);
        if limb.planning.robot.gravity.is_none() {
            said(text, "gravity = [0.0, 0.0, -9.81]", "m/s^2");
        }
        limb.tool.write(text);
    }

    fn mount(&self, text: &mut String) {
        let Self { limb, start, rules, template, .. } = self;
        let (k, d) = (rules.stiffness, rules.damping());
        let stiff = [format!("{k:?}"), format!("{d:?}")];
        // Half of critical.
        let soft = ["\"k\"".to_owned(), format!("\"sqrt({:?} * k)\"", rules.mass)];
        let each = |key: usize| {
            let of =
                |axis: &String| if self.yielding().contains(axis) { soft[key].clone() } else { stiff[key].clone() };
            let each = self.axes().each_ref().map(of);
            if each.iter().all(|other| *other == each[0]) { each[0].clone() } else { format!("[{}]", each.join(", ")) }
        };
        let _ = write!(
            text,
            "\n# The mount: three slides with springs, and the tool beyond them. z points {}.\n\
             [[model.insert]]\nname = {:?}\n{}\nrpy = {}\n",
            if template.touches() { "into the wall" } else { "forwards" },
            self.mount_name(),
            limb.tool.mount(),
            list(&start.mount),
        );
        let _ = writeln!(text, "axes = [\"x\", \"y\", \"z\"]");
        said(
            text,
            &format!("mass = {:?}", rules.mass),
            &format!("kg: the tool, 2 % of the mass of the limb, {} kg", plain(supple_text::significant(limb.mass, 3))),
        );
        said(text, &format!("stiffness = {}", each(0)), "N/m");
        said(text, &format!("damping = {}", each(1)), "N s/m: half of critical");
    }
}
