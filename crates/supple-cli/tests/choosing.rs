//! docs/choosing.md: the files that `supple new` writes follow its rules, and its example is what is written.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, repository};
use toml::Value;

/// The arm of `supple new --model robot`.
const ARM: &str = include_str!("../templates/arm.urdf");

/// Of this arm: from its first joint to the flange, m, and all that moves, kg.
const REACH: f64 = 0.1 + 0.36 + 0.3 + 0.08 + 0.08 + 0.05;
const MASS: f64 = 3.0 + 4.0 + 2.0 + 0.8 + 0.8 + 0.3;

struct Written {
    text: String,
    table: Value,
}

impl Written {
    fn of(words: &[&str]) -> Self {
        let folder = Folder::new();
        std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
        let run = folder.run(&[&["new", "wrist", "--robot", "arm.urdf"][..], words].concat());
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        let text = std::fs::read_to_string(folder.path("wrist.toml")).unwrap();
        Self { table: toml::from_str(&text).unwrap(), text }
    }

    /// The value at a path of keys, and of indices of lists.
    fn at(&self, path: &str) -> &Value {
        path.split('/').fold(&self.table, |value, key| match key.parse::<usize>() {
            Ok(index) => &value[index],
            Err(_) => &value[key],
        })
    }

    fn number(&self, path: &str) -> f64 {
        number(self.at(path))
    }

    /// The first entry of a list whose kind is this.
    fn kind(&self, list: &str, kind: &str) -> &Value {
        self.at(list).as_array().unwrap().iter().find(|entry| entry["kind"].as_str() == Some(kind)).unwrap()
    }
}

fn number(value: &Value) -> f64 {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64)).unwrap()
}

fn vector(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(number).collect()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// 1, 2 or 5 times a power of ten: the nearest by ratio.
fn round(value: f64) -> f64 {
    let candidates = (-12..12).flat_map(|power| [1.0, 2.0, 5.0].map(|first| first * 10f64.powi(power)));
    candidates.min_by(|a, b| (a / value).ln().abs().total_cmp(&(b / value).ln().abs())).unwrap()
}

/// To the four digits with which files are written.
fn assert_near(found: f64, expected: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < 2e-3, "{what}: {found}, not {expected}");
}

fn page() -> String {
    std::fs::read_to_string(repository("docs/choosing.md")).unwrap()
}

/// Panics with all that the page lacks; where its lines break does not matter.
fn assert_said(said: &[&str]) {
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let page = words(&page());
    let lacking: Vec<&&str> = said.iter().filter(|said| !page.contains(&words(said))).collect();
    assert!(lacking.is_empty(), "docs/choosing.md lacks {lacking:#?}");
}

#[test]
fn sizes_follow_from_the_reach_and_the_mass() {
    let press = Written::of(&["--template", "press"]);
    let force = number(&press.kind("tasks/0/costs", "contact_force")["target"]);
    assert!(force <= 10.0 && round(force) == force);
    // The rule of short limbs, and what may be set.
    assert_eq!(Written::of(&["--template", "press", "--set", "force=7"]).number("parameters/k/initial"), 5000.0);
    let wall = press.kind("model/compliance", "contact");
    let position = vector(&press.at("tasks/0/initial_state/pose")["position"]);
    assert_near(distance(&vector(&wall["point"]), &position), round(REACH / 100.0), "clearance");
    assert_near(press.number("model/insert/0/mass"), round(0.02 * MASS), "mass of the tool");
    let stiff = press.number("parameters/k/initial");
    assert_near(stiff, round(1e3 * force), "the force deflects the mount by 1 mm");
    let bounds = vector(press.at("parameters/k/bounds"));
    assert_near(bounds[1] / bounds[0], 40.0, "the softest mount");
    let critical = 2.0 * (stiff * press.number("model/insert/0/mass")).sqrt();
    assert_near(press.number("parameters/d/initial"), round(0.5 * critical), "damping");
    let reach = Written::of(&["--template", "reach"]);
    let target = vector(&reach.kind("tasks/0/costs", "frame_point")["target"]);
    let from = vector(&reach.at("tasks/0/initial_state/pose")["position"]);
    assert_near(distance(&target, &from), round(REACH / 10.0), "travel");
    for (template, seconds) in [("press", 0.5), ("insert", 0.5), ("wipe", 1.0), ("reach", 1.0), ("hold", 1.0)] {
        let written = Written::of(&["--template", template]);
        assert_eq!(written.number("tasks/0/steps"), 100.0);
        let time = 100.0 * written.number("tasks/0/time_step");
        assert!(
            [seconds, 2.0 * seconds].iter().any(|wanted| (time / wanted - 1.0).abs() < 1e-9),
            "{template}: {time} s"
        );
    }
    assert_said(&[
        "times a power of ten",
        "a quarter of the sustained force, at most 10 N, and at most 10 N for a reach of 0.5 m",
        "| travel | `travel` | $L/10$ |",
        "| clearance at the start | `clearance` | $L/100$; where",
        "0.5 s for `press` and `insert`, else 1 s, in 100 steps; twice that if",
        "2 % of $m$",
        "the force deflects it by 1 mm; the lower bound is 40 times softer",
        "half of critical damping",
    ]);
}

#[test]
fn noise_follows_from_the_clearance_and_the_force() {
    let press = Written::of(&["--template", "press"]);
    let (clearance, step) = (round(REACH / 100.0), press.number("tasks/0/time_step"));
    let force = number(&press.kind("tasks/0/costs", "contact_force")["target"]);
    let wall_sd = press.number("tasks/0/noise/initial/c.wall").sqrt();
    assert_near(wall_sd, 0.2 * clearance, "wall");
    let tip_sd = round(0.02 * clearance);
    let joints = number(&press.kind("model/sensors", "joint_position")["variance"]);
    assert_near(joints.sqrt(), round(tip_sd / REACH), "joint sensors");
    assert_near(press.number("parameters/force_noise/initial").sqrt(), 0.02 * force, "force sensor");
    let bounds = vector(press.at("parameters/force_noise/bounds"));
    assert_near((bounds[1] / bounds[0]).sqrt(), 100.0, "range of the force sensor");
    assert_near(press.number("tasks/0/noise/process/v.*"), 0.02 * 0.02 * step, "disturbances");
    let hold = Written::of(&["--template", "hold"]);
    let step = hold.number("tasks/0/time_step");
    assert_near(hold.number("tasks/0/noise/process/v.*"), 0.1 * 0.1 * step, "disturbances of hold");
    let contact = press.kind("model/compliance", "contact");
    let smoothing = number(&contact["smoothing"]);
    assert_near(smoothing, 2.5 * wall_sd, "smoothing");
    assert_near(number(&contact["stiffness"]) * smoothing, force, "the wall lets the force go that deep");
    assert_said(&[
        "20 % of the clearance",
        "2 % of the clearance at the tool, divided by $L$ for angles",
        "2 % of the force at the start of the search; the upper bound is 100 times larger",
        "joint velocities drift by 0.02 rad/s (one standard deviation) in a second, for `hold` by 0.1 rad/s",
        "The rule is 2.5 deviations of the wall's position",
    ]);
}

#[test]
fn weights_follow_from_tolerances_and_the_limit_from_the_cost() {
    let press = Written::of(&["--template", "press"]);
    let cost = press.kind("tasks/0/costs", "contact_force");
    let (force, steps) = (number(&cost["target"]), press.number("tasks/0/steps"));
    let weight = |tolerance: f64| 1.0 / (steps * tolerance * tolerance);
    assert_near(number(&cost["weight"]), weight(0.2 * force), "force");
    assert_near(number(&cost["smoothing"]), 0.1 * force, "smoothing of the target");
    // Off by four times its tolerance at every step; and half the tolerance.
    assert_near(number(&cost["weight"]) * steps * (4.0 * 0.2 * force).powi(2), 16.0, "four times");
    assert_near(weight(0.5) / weight(1.0), 4.0, "quadruples");
    let insert = Written::of(&["--template", "insert"]);
    let cost = insert.kind("tasks/0/costs", "contact_force");
    assert_near(number(&cost["weight"]), weight(0.5 * number(&cost["target"])), "force of insert");
    assert_near(number(&cost["target"]), 0.2 * force, "target of insert");
    let travel = round(REACH / 10.0);
    for (template, last) in [("wipe", 20.0), ("insert", 20.0), ("reach", 50.0)] {
        let written = Written::of(&["--template", template]);
        let cost = written.kind("tasks/0/costs", "frame_point");
        assert_near(number(&cost["weight"]), weight(0.05 * travel), template);
        assert_near(number(&cost["final_weight"]) / number(&cost["weight"]), last, template);
    }
    let time = steps * press.number("tasks/0/time_step");
    let speed = number(&press.kind("tasks/0/costs", "joint_velocity")["weight"]);
    assert_near(speed, weight(round(travel / (time * REACH))), "speed of joints");
    let line = press.text.lines().find(|line| line.starts_with("bound = ")).unwrap();
    let cost: f64 = line.split("expected cost ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    let bound = press.number("tasks/0/bound");
    assert!((1.2 * cost..1.2 * cost * 1.1 + 1e-9).contains(&bound), "{bound} for {cost}");
    assert_said(&[
        "an expected cost of 16 means that something is off by four times its tolerance",
        "Tolerances are 20 % of the force (10 % for `insert`), 5 % of the travel",
        "`final_weight` is greater by 20 or 50",
        "halve its tolerance: its weight quadruples",
        "Forces are tracked with a smoothing of 10 % of the target",
        "writes 1.2 times its cost as `bound`, rounded up (`--set margin=1.5` allows more)",
    ]);
}

/// The table of the example is what `supple new wrist --model robot` writes.
#[test]
fn the_example_is_what_is_written() {
    let press = Written::of(&["--template", "press"]);
    let force = number(&press.kind("tasks/0/costs", "contact_force")["target"]);
    let contact = press.kind("model/compliance", "contact");
    let variance = |path: &str| press.number(path).sqrt();
    let rows = [
        "| Number | Value |".to_owned(),
        format!("| force | {force} N |"),
        format!("| stiffness of the mount | {} N/m |", press.number("parameters/k/initial")),
        format!("| damping of the mount | {} N s/m |", press.number("parameters/d/initial")),
        format!("| mass of the tool | {} kg |", press.number("model/insert/0/mass")),
        format!("| duration | {:.1} s |", 100.0 * press.number("tasks/0/time_step")),
        format!(
            "| standard deviation of the wall position | {:.1} mm |",
            1e3 * variance("tasks/0/noise/initial/c.wall")
        ),
        format!("| smoothing of the contact | {:.1} mm |", 1e3 * number(&contact["smoothing"])),
        format!("| stiffness of the wall | {} N/m |", number(&contact["stiffness"])),
        format!("| deviation of the force sensor | {:.2} N |", variance("parameters/force_noise/initial")),
        format!("| limit of the cost | {} |", press.number("tasks/0/bound")),
    ];
    assert!((REACH - 0.97).abs() < 1e-9 && (MASS - 10.9).abs() < 1e-9);
    assert_said(&["with a reach of 0.97 m and a mass of 10.9 kg"]);
    let page = page();
    let lacking: Vec<&String> = rows.iter().filter(|row| !page.lines().any(|line| line == row.as_str())).collect();
    assert!(lacking.is_empty(), "docs/choosing.md lacks {lacking:#?}");
}
