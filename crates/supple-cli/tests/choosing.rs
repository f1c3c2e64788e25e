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
    let stiff = |force: &str| {
        let written = Written::of(&["--template", "press", "--set", &format!("force={force}")]);
        vector(written.at("parameters/k/bounds"))[1]
    };
    assert_near(stiff("7"), round(7.0 / (REACH / 1000.0)), "the force deflects the mount by a thousandth of the reach");
    let wall = press.kind("model/compliance", "contact");
    let position = vector(&press.at("tasks/0/initial_state/pose")["position"]);
    assert!(distance(&vector(&wall["point"]), &position) < 1e-9, "the tool starts at the wall");
    assert_near(press.number("model/insert/0/mass"), round(0.02 * MASS), "mass of the tool");
    let bounds = vector(press.at("parameters/k/bounds"));
    assert_near(bounds[1], round(force / (REACH / 1000.0)), "the stiff mount");
    assert_near(bounds[1] / bounds[0], 40.0, "the softest mount");
    // 2 sqrt(k m) is critical.
    assert!(press.text.contains("damping = [44.72, 44.72, \"sqrt(0.2 * k)\"] # N s/m: half of critical"));
    let reach = Written::of(&["--template", "reach"]);
    let target = vector(&reach.kind("tasks/0/costs", "frame_point")["target"]);
    let from = vector(&reach.at("tasks/0/initial_state/pose")["position"]);
    assert_near(distance(&target, &from), round(REACH / 10.0), "travel");
    for template in ["press", "insert", "wipe", "reach", "hold"] {
        let written = Written::of(&["--template", template]);
        let steps = written.number("tasks/0/steps");
        let time = steps * written.number("tasks/0/time_step");
        assert!([(1.0, 200.0), (2.0, 400.0)].contains(&(time, steps)), "{template}: {time} s, {steps} steps");
    }
    // Its weight makes a heavier tool sag by 2 cm on the softest mount, and by no more.
    let heavy = Written::of(&["--template", "press", "--wall", "+z", "--set", "mass=1"]);
    let soft = vector(heavy.at("parameters/k/bounds"))[0];
    assert!(9.81 / soft <= 0.02 && 9.81 / (0.4 * soft) > 0.02, "{soft}");
    let insert = Written::of(&["--template", "insert"]);
    let target = number(&insert.kind("tasks/0/costs", "contact_force")["target"]);
    assert_near(target, 0.2 * force, "force of insert");
    assert_said(&[
        "times a power of ten",
        "a quarter of the sustained force, at most 10 N and 20 N per metre of reach; for `insert` a fifth of that",
        "| travel | `travel` | $L/10$ |",
        "| clearance at the start | `clearance` | 0: the tool starts where",
        "1 s; twice that if",
        "200 to 2000 steps of at most 5 ms",
        "2 % of $m$, at most 5 kg",
        "Stiffer if on the softest mount the tool would sag by more than 2 cm, or swing at less than 1 Hz",
        "the force deflects it by $L/1000$; the lower bound is 40 times softer",
        "half of critical damping",
    ]);
}

/// Joints follow commands: fast enough, stiff enough, and critically damped.
#[test]
fn drives_follow_from_the_bandwidth_and_the_force() {
    let press = Written::of(&["--template", "press"]);
    let drives = press.at("model/drives").as_table().unwrap();
    assert_eq!(drives.len(), 6);
    for (joint, drive) in drives {
        let [kp, kv] = ["kp", "kv"].map(|key| number(&drive[key]));
        // kv = 2 sqrt(kp I), I with the inertia of the drive: the frequency is 2 kp / kv.
        assert_near(2.0 * kp / kv, 2.0 * std::f64::consts::PI * 10.0, joint);
    }
    let heavy = press.at("model/joints").as_table().unwrap();
    assert!(!heavy.is_empty() && heavy.values().all(|joint| number(&joint["armature"]) > 0.0));
    assert!(press.text.contains("10.0 N move the tool by at most 0.000388 m each"), "{}", press.text);
    assert!(Written::of(&["--template", "reach"]).at("model").get("drives").is_none());
    assert_said(&[
        "The natural frequency of each joint is 10 Hz",
        "so stiff that the force moves the tool by at most $L/2500$",
        "the file adds the `armature` required by the frequency",
        "10 Hz, critically damped",
    ]);
}

#[test]
fn noise_follows_from_the_reach_and_the_force() {
    let press = Written::of(&["--template", "press"]);
    let (table, step) = ("tasks/0/noise", press.number("tasks/0/time_step"));
    let noise =
        |written: &Written, kind: &str, name: &str| number(&written.at(&format!("{table}/{kind}_deviation"))[name]);
    let force = number(&press.kind("tasks/0/costs", "contact_force")["target"]);
    let wall_sd = noise(&press, "initial", "c.wall");
    assert_near(wall_sd, round(REACH / 200.0), "wall");
    let joints = number(&press.kind("model/sensors", "joint_position")["deviation"]);
    assert_near(joints, round(round(REACH / 1000.0) / REACH), "joint sensors");
    assert_near(press.number("parameters/force_noise/initial"), 0.05 * force, "force sensor");
    let bounds = vector(press.at("parameters/force_noise/bounds"));
    assert_near(bounds[1] / bounds[0], 40.0, "range of the force sensor");
    assert_near(noise(&press, "process", "v.*"), 0.02 * step.sqrt(), "disturbances");
    let hold = Written::of(&["--template", "hold"]);
    let step = hold.number("tasks/0/time_step");
    assert_near(noise(&hold, "process", "v.*"), 0.1 * step.sqrt(), "disturbances of hold");
    assert_near(noise(&hold, "initial", "c.wall"), 0.2 * wall_sd, "wall of hold at the start");
    assert_near(noise(&hold, "process", "c.wall"), wall_sd * step.sqrt(), "wall of hold");
    let handle = Written::of(&["--template", "handle"]);
    let width = vector(handle.at("model/insert/2/position"))[0];
    assert_near(width * noise(&handle, "initial", "q.hinge_rz"), 2.0 * wall_sd, "hinge");
    let contact = press.kind("model/compliance", "contact");
    let smoothing = number(&contact["smoothing"]);
    assert_near(smoothing, 3.5 * wall_sd, "smoothing");
    assert_near(number(&contact["stiffness"]) * smoothing, force, "the wall lets the force go that deep");
    assert_said(&[
        "$L/200$, at most 5 mm; for `hold` a fifth of that initially, plus a drift of the same size in one second",
        "for the hinge of `handle` twice that sideways, as seen from the handle",
        "$L/1000$ at the tool, at most 2 mm, divided by $L$ for angles",
        "5 % of the force at the start of the search; the upper bound is 40 times larger",
        "joint velocities drift by 0.02 rad/s (one standard deviation) in a second, for `hold` by 0.1 rad/s",
        "is 3.5 standard deviations of the wall's position",
    ]);
}

#[test]
fn weights_follow_from_tolerances() {
    let press = Written::of(&["--template", "press"]);
    let cost = press.kind("tasks/0/costs", "contact_force");
    let (force, steps) = (number(&cost["target"]), press.number("tasks/0/steps"));
    let weight_in = |written: &Written, tolerance: f64| 1.0 / (written.number("tasks/0/steps") * tolerance * tolerance);
    let weight = |tolerance: f64| weight_in(&press, tolerance);
    let of = |written: &Written, kind: &str| number(&written.kind("tasks/0/costs", kind)["weight"]);
    assert_near(number(&cost["weight"]), weight(0.1 * force), "force");
    assert_near(number(&cost["smoothing"]), 0.1 * force, "smoothing of the target");
    // Off by four times its tolerance at every step; and half the tolerance.
    assert_near(number(&cost["weight"]) * steps * (4.0 * 0.1 * force).powi(2), 16.0, "four times");
    assert_near(weight(0.5) / weight(1.0), 4.0, "quadruples");
    let travel = round(REACH / 10.0);
    assert_near(of(&press, "frame_point"), weight(0.05 * travel), "point of press");
    assert_near(of(&press, "coupling_deflection"), weight(round(REACH / 50.0)), "deflection");
    for template in ["wipe", "insert", "reach"] {
        let written = Written::of(&["--template", template]);
        let cost = written.kind("tasks/0/costs", "frame_point");
        assert_near(number(&cost["weight"]), weight_in(&written, travel), template);
        assert_near(number(&cost["final_weight"]), (0.05 * travel).powi(-2), template);
    }
    let handle = Written::of(&["--template", "handle"]);
    assert_near(of(&handle, "coupling_force"), weight_in(&handle, 0.2 * force), "force across the door");
    let time = steps * press.number("tasks/0/time_step");
    assert_near(of(&press, "joint_velocity"), weight(round(10.0 * travel / (time * REACH))), "speed of joints");
    let command = press.kind("tasks/0/costs", "control");
    assert_near(number(&command["weight"]), weight(3.0 * round(travel / REACH)), "commands");
    assert_eq!(vector(&command["target"]).len(), 6);
    let reach = Written::of(&["--template", "reach"]);
    assert_near(of(&reach, "control"), weight_in(&reach, round(force * REACH)), "torques");
    assert_said(&[
        "an expected cost of 16 corresponds to an average error of four tolerances",
        "| 10 % of the force; for `handle` 20 %, towards the hinge and along it |",
        "| 5 % of the travel |",
        "| `deflection` | $L/50$, at most 20 mm |",
        "ten times the speed that completes the travel in the given time, at most half of the lowest speed limit",
        "that reaches the tolerated speed in a fifth of the time",
        "commands: three times the travel, divided by $L$ for angles; torques: the force times $L$, or the torque of friction",
        "`final_weight`, $1/\\text{tolerance}^2$, and on the way an error as large as the travel adds 1",
        "halve its tolerance, which quadruples its weight",
        "Forces are tracked with a smoothing of 10 % of the target",
    ]);
}

/// The limit lies between what the task costs with the precise sensor and with the coarsest.
#[test]
fn the_limit_lies_between_two_costs() {
    for (words, share) in [(&["--template", "press"][..], 0.25), (&["--template", "press", "--set", "margin=0.5"], 0.5)]
    {
        let written = Written::of(words);
        let [precise, coarse] = common::costs(&written.text);
        let (bound, way) = (written.number("tasks/0/bound"), coarse - precise);
        let found = (bound - precise) / way;
        assert!((share - 2e-3..share + 1.2e-2).contains(&found), "{bound} between {precise} and {coarse}");
    }
    assert_said(&[
        "each the least over five stiffnesses of the mount",
        "The `bound` lies 25 % of the way from the first to the second (`--set margin=0.5`: half of the way)",
        "If the two costs differ by less than 5 %",
    ]);
}

/// The table of the example is what `supple new wrist --model robot` writes.
#[test]
fn the_example_is_what_is_written() {
    let press = Written::of(&["--template", "press"]);
    let force = number(&press.kind("tasks/0/costs", "contact_force")["target"]);
    let contact = press.kind("model/compliance", "contact");
    let wall_sd = number(&press.at("tasks/0/noise/initial_deviation")["c.wall"]);
    let rows = [
        "| Number | Value |".to_owned(),
        format!("| force | {force} N |"),
        format!("| stiffness of the mount | {} N/m |", vector(press.at("parameters/k/bounds"))[1]),
        format!("| mass of the tool | {} kg |", press.number("model/insert/0/mass")),
        format!("| duration | {:.1} s |", press.number("tasks/0/steps") * press.number("tasks/0/time_step")),
        format!("| standard deviation of the wall position | {:.1} mm |", 1e3 * wall_sd),
        format!("| smoothing of the contact | {:.1} mm |", 1e3 * number(&contact["smoothing"])),
        format!("| stiffness of the wall | {} N/m |", number(&contact["stiffness"])),
        format!("| deviation of the force sensor | {:.2} N |", press.number("parameters/force_noise/initial")),
        format!("| limit of the cost | {} |", press.number("tasks/0/bound")),
    ];
    assert!((REACH - 0.97).abs() < 1e-9 && (MASS - 10.9).abs() < 1e-9);
    assert_said(&["with a reach of 0.97 m and a mass of 10.9 kg"]);
    let page = page();
    let lacking: Vec<&String> = rows.iter().filter(|row| !page.lines().any(|line| line == row.as_str())).collect();
    assert!(lacking.is_empty(), "docs/choosing.md lacks {lacking:#?}");
}
