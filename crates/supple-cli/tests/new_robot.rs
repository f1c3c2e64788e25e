//! Task files that `supple new` writes for robots: they run, converge, and touch what they should.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, repository};
use serde_json::Value;

const TEMPLATES: [&str; 6] = ["press", "wipe", "insert", "reach", "hold", "handle"];
const ARM: &str = include_str!("../templates/arm.urdf");

/// Writes a task and evaluates it: its text, and the result.
fn written(folder: &Folder, name: &str, words: &[&str]) -> (String, Value) {
    let run = folder.run(&[&["new", name][..], words].concat());
    assert_eq!(run.code, Some(0), "{words:?}: {}", run.stderr);
    let file = format!("{name}.toml");
    let run = folder.run(&["evaluate", &file, "--json", "--rollouts", "0"]);
    let text = std::fs::read_to_string(folder.path(&file)).unwrap();
    assert_eq!(run.code, Some(0), "{}\n{text}", run.stderr);
    (text, serde_json::from_str(&run.stdout).unwrap())
}

fn assert_good(text: &str, found: &Value) {
    let task = &found["tasks"][0];
    assert_eq!(task["status"], "converged", "{text}");
    assert_eq!(found["feasible"], true, "{text}");
    for contact in task["contacts"].as_array().unwrap() {
        assert_eq!(contact["touches"], true, "{contact}\n{text}");
    }
    let (cost, bound) = (task["cost"]["expected"].as_f64().unwrap(), task["cost"]["bound"].as_f64().unwrap());
    assert!(bound >= 1.2 * cost && bound < 1.35 * cost, "{bound} for {cost}");
}

#[test]
fn every_template_runs_for_the_shipped_arm() {
    for template in TEMPLATES {
        let folder = Folder::new();
        std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
        let (text, found) = written(&folder, template, &["--robot", "arm.urdf", "--template", template]);
        assert_good(&text, &found);
        assert!(text.contains("frame = \"tool0\"") && text.contains("[[model.insert]]"), "{text}");
        let count = found["tasks"][0]["contacts"].as_array().unwrap().len();
        assert_eq!(count, usize::from(["press", "wipe", "insert", "hold"].contains(&template)));
    }
}

#[test]
fn shipped_robots_have_tasks() {
    for (file, frame, template) in [
        ("iiwa14_door.urdf", "iiwa_link_7", "press"),
        ("iiwa14_door.urdf", "iiwa_link_7", "wipe"),
        ("wiping_arm.sdf", "hand", "reach"),
        ("peg_on_wall.urdf", "gripper", "press"),
    ] {
        let folder = Folder::new();
        let robot = repository("models").join(file).display().to_string();
        let words = ["--robot", &robot, "--template", template, "--frame", frame];
        let (text, found) = written(&folder, "task", &words);
        assert_good(&text, &found);
    }
}

#[test]
fn numbers_can_be_set_and_wrong_ones_are_refused() {
    let folder = Folder::new();
    std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
    let base = ["--robot", "arm.urdf", "--template", "press"];
    let words = [&base[..], &["--set", "force=5", "--wall", "-x", "--set", "margin=1.25"]].concat();
    let (text, _) = written(&folder, "five", &words);
    assert!(text.contains("\ntarget = 5.0 ") && text.contains("normal = [-1.0, 0.0, 0.0]"), "{text}");
    for (words, message) in [
        (vec!["--set", "forse=5"], "--set forse=5: templates have the numbers `force`, `travel`"),
        (vec!["--set", "force=-1"], "--set force=-1: must be above 0; found -1"),
        (vec!["--set", "force"], "--set force: write NAME=VALUE"),
        (vec!["--set", "margin=0.9"], "--set margin=0.9: must be above 1; found 0.9"),
        (vec!["--frame", "tool"], "--frame tool: arm.urdf has no such link or frame"),
        (vec!["--frame", "base"], "--frame base: no joint moves it"),
        (vec!["--wall", "up"], "--wall up: write +x, -x, +y, -y, +z, -z or three numbers"),
        (vec!["--at", "1,2"], "--at 1,2: write three numbers, x,y,z"),
        (vec!["--at", "9,9,9"], "--at: the tool does not reach this place"),
    ] {
        let run = folder.run(&[&["new", "wrong"][..], &base, &words].concat());
        assert!(run.error().contains(message), "{}", run.stderr);
        assert!(!folder.path("wrong.toml").exists());
    }
}

#[test]
fn every_kind_of_model_is_offered() {
    let run = Folder::new().run(&["schema"]);
    let schema: Value = serde_json::from_str(&run.stdout).unwrap();
    let kinds = schema["properties"]["model"]["oneOf"].as_array().unwrap();
    for kind in kinds.iter().map(|kind| kind["properties"]["kind"]["const"].as_str().unwrap()) {
        let folder = Folder::new();
        let run = folder.run(&["new", "task", "--model", kind]);
        assert_eq!(run.code, Some(0), "{kind}: {}", run.stderr);
        let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
        assert!(text.contains(&format!("kind = \"{kind}\"")), "{text}");
        assert_eq!(folder.run(&["evaluate", "task.toml", "--rollouts", "0"]).code, Some(0), "{kind}");
    }
}

#[test]
fn a_folder_is_not_overwritten_by_a_result_of_another_kind() {
    let folder = Folder::with_task(common::TWO_MASS);
    assert_eq!(folder.run(&["evaluate", "task.toml", "--rollouts", "0", "--out", "out"]).code, Some(0));
    let before = std::fs::read_to_string(folder.path("out/result.json")).unwrap();
    let run = folder.run(&["sweep", "task.toml", "--out", "out", "--grid", "k1=50,60"]);
    let message = "out holds a result of `supple evaluate`, which one of `supple sweep` would replace";
    assert!(run.error().contains(message), "{}", run.stderr);
    assert_eq!(std::fs::read_to_string(folder.path("out/result.json")).unwrap(), before);
    assert_eq!(folder.run(&["evaluate", "task.toml", "--rollouts", "0", "--out", "out"]).code, Some(0));
}

#[test]
fn pages_end_with_what_to_try_next() {
    let folder = Folder::with_task(common::TWO_MASS);
    let page = folder.run(&["evaluate", "task.toml", "--rollouts", "0"]).stdout;
    let last = page.lines().last().unwrap();
    assert!(last.starts_with("Next: `supple design` minimises the information over k1"), "{page}");
    let page = folder.run(&["design", "task.toml", "--starts", "1", "--rollouts", "0"]).stdout;
    assert!(page.lines().last().unwrap().starts_with("Next: "), "{page}");
}

/// One joint that moves along the wall presses on nothing: the file is written, and what is wrong with it said.
#[test]
fn a_tool_that_cannot_reach_its_wall_is_told() {
    let folder = Folder::new();
    let robot = repository("models/elastic_elbow.urdf").display().to_string();
    let run = folder.run(&["new", "task", "--robot", &robot, "--template", "press", "--frame", "fingertip"]);
    assert!(run.stderr.contains("warning: the plan does not touch the wall"), "{}", run.stderr);
}
