//! What the program says beside its results: warnings of files, limits that plans violate, time steps too large.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, TWO_MASS, edited, repository};

/// An arm whose file has a warning; it begins beyond the limit of its slide, and a spring is to be designed.
const ARM: &str = r#"
[model]
kind = "robot"
file = "arm.urdf"
gravity = [0.0, 0.0, 0.0]

[[model.compliance]]
kind = "spring"
name = "soft"
joint = "elbow"
stiffness = "k"

[[model.sensors]]
kind = "joint_position"
select = ["shoulder", "elbow", "slide"]
variance = 1e-3

[parameters.k]
initial = 2.0
bounds = [1.0, 3.0]

[[tasks]]
name = "hold"
steps = 5
time_step = 0.01
initial_state = { "q.slide" = 0.35 }

[tasks.noise]
initial = { "*" = 1e-3 }
process = { "*" = 1e-4 }

[[tasks.costs]]
kind = "joint_position"
weight = 1.0

[[tasks.costs]]
kind = "control"
weight = 0.01

[design]
starts = 1
branch_attempts = 0
"#;

const WARNING: &str = "warning: arm.urdf: inertial of link `upper`: ";
const LIMIT: &str = "    position of joint `slide`: 0.35 at step 0, above 0.3 m (";

fn arm() -> Folder {
    let folder = Folder::with_task(ARM);
    std::fs::copy(repository("crates/supple/tests/data/arm.urdf"), folder.path("arm.urdf")).unwrap();
    folder
}

#[test]
fn commands_that_load_tasks_warn_on_standard_error() {
    let folder = arm();
    for command in ["evaluate", "design", "check"] {
        for json in [None, Some("--json")] {
            let arguments: Vec<&str> = [command, "task.toml"].into_iter().chain(json).collect();
            let run = folder.run(&arguments);
            assert!(matches!(run.code, Some(0 | 1)), "{command}: {run:?}");
            assert!(run.stderr.starts_with(WARNING), "{command}: {}", run.stderr);
            assert_eq!(run.stderr.matches("warning: ").count(), 2, "{command}: {}", run.stderr);
            let start =
                "warning: task `hold`: the initial value of position of joint `slide`, 0.35, is outside its range";
            assert!(run.stderr.contains(start), "{command}: {}", run.stderr);
            assert!(!run.stdout.contains("inertial of link"), "{command}: {}", run.stdout);
        }
    }
}

#[test]
fn evaluate_and_design_list_the_limits_that_the_plan_violates() {
    let folder = arm();
    let page = folder.run(&["evaluate", "task.toml"]).stdout;
    assert!(page.contains("  violates limits:\n") && page.contains(LIMIT), "{page}");
    assert!(
        page.contains("  roll-outs exceed limits:\n    position of joint `slide`: above 0.3 m in 98 % of them"),
        "{page}"
    );
    let page = folder.run(&["design", "task.toml"]).stdout;
    assert!(page.contains("The plan of hold violates limits:\n") && page.contains(LIMIT), "{page}");
    assert!(page.contains("Roll-outs of hold exceed limits:\n    position of joint `slide`: above 0.3 m"), "{page}");
}

#[test]
fn the_stiff_door_takes_more_torque_than_the_arm_has() {
    let task = repository("tasks/iiwa_door.toml");
    let page = Folder::new().run(&["evaluate", task.to_str().unwrap()]).stdout;
    assert!(page.contains("effort of joint `iiwa_joint_6`: 311.649 at step 0, above 300 N m (2 steps)\n"), "{page}");
}

#[test]
fn json_holds_limits_and_stability() {
    let found = Folder::with_task(TWO_MASS).run(&["evaluate", "task.toml", "--json"]).json(0);
    let task = &found["tasks"][0];
    assert_eq!(task["limits_violated"].as_array().map(Vec::len), Some(0));
    let stability = &task["stability"];
    assert!((stability["spectral_radius"].as_f64().unwrap() - 1.0).abs() < 1e-6, "{stability}");
    assert!(stability["step"].is_u64() && stability["suggested_time_step"].is_null(), "{stability}");
    assert_eq!(stability["numerically_unstable"], false);
    let arm = arm().run(&["evaluate", "task.toml", "--json"]).stdout;
    let arm: serde_json::Value = serde_json::from_str(&arm).unwrap();
    let violated = &arm["tasks"][0]["limits_violated"][0];
    assert_eq!(violated["name"], "position of joint `slide`");
    assert_eq!((&violated["worst"], &violated["limit"], &violated["step"]), (&0.35.into(), &0.3.into(), &0.into()));
    assert!(violated["steps"].is_u64());
}

#[test]
fn plans_with_too_large_a_time_step_say_what_would_do() {
    let plain = Folder::with_task(TWO_MASS).run(&["evaluate", "task.toml"]).stdout;
    assert!(!plain.contains("too large"), "{plain}");
    let folder = Folder::with_task(edited(TWO_MASS, "time_step = 0.02", "time_step = 0.05"));
    let page = folder.run(&["evaluate", "task.toml"]).stdout;
    assert!(page.contains("  time_step = 0.05 s is too large for the stiff parts of the model: the "), "{page}");
    assert!(page.contains("; use at most 0.0"), "{page}");
    let folder = Folder::with_task(edited(TWO_MASS, "time_step = 0.02", "time_step = 2000.0"));
    for command in ["evaluate", "design", "check"] {
        let run = folder.run(&[command, "task.toml"]);
        let error = run.error();
        assert!(error.starts_with("error: task.toml: task `press`: "), "{error}");
        assert!(error.contains(": time_step = 2000 s is too large for the stiff parts of the model: "), "{error}");
        assert!(error.contains("; use at most 0.0"), "{error}");
    }
}
