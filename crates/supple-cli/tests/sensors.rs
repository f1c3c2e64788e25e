//! `supple sensors` where greedy choice leads nowhere, and tasks without any sensor.
#![allow(clippy::unwrap_used)]

mod common;

use std::fmt::Write;

use common::Folder;

/// Two states, two exact sensors of one each, a coarse one of both that greedy choice takes first, and many poor ones.
fn misleading(poor: usize, chosen: &str) -> String {
    let mut sensors = String::new();
    for k in 0..poor {
        let variance = 1000 + k;
        let _ = writeln!(sensors, "{{ name = \"z{k}\", kind = \"state\", select = [\"x1\"], variance = {variance} }},");
    }
    format!(
        r#"
        [model]
        kind = "linear"
        A = [[1.0, 0.0], [0.0, 1.0]]
        B = [[1.0, 0.0], [0.0, 1.0]]
        C = [[1.0, 0.0]]
        [catalogue]
        base = []
        {chosen}
        sensors = [
            {{ name = "both", kind = "sum", C = [[1.0, 0.0], [0.0, 1.0]], variance = 0.3 }},
            {{ name = "first", kind = "state", select = ["x1"], variance = 1e-4 }},
            {{ name = "second", kind = "state", select = ["x2"], variance = 1e-4 }},
            {sensors}
        ]
        [parameters.stiffness]
        initial = 1.0
        bounds = [0.5, 2.0]
        [[tasks]]
        name = "go"
        steps = 3
        time_step = 1.0
        initial_state = [1.0, 1.0]
        noise = {{ initial = [1.0, 1.0], process = [1e-6, 1e-6], measurement = [1.0] }}
        [[tasks.costs]]
        kind = "state"
        select = ["x1", "x2"]
        weight = "stiffness"
        final_weight = 10.0
        [[tasks.costs]]
        kind = "control"
        weight = 0.5
        "#
    )
}

#[test]
fn a_set_that_greedy_choice_misses_is_found() {
    // Few candidates are all tried; many are searched by branch and bound.
    for poor in [0, 17] {
        let folder = Folder::with_task(misleading(poor, "chosen = [\"both\"]"));
        let found = folder.run(&["sensors", "task.toml", "--count", "2", "--cost", "6", "--json"]).json(0);
        let mut names: Vec<_> =
            found["chosen"]["sensors"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
        names.sort_unstable();
        assert_eq!(names, ["first", "second"], "{poor} poor sensors");
        assert!(found["chosen"]["expected_cost"].as_f64().unwrap() < 6.0);
    }
    let folder = Folder::with_task(misleading(17, "chosen = [\"both\"]"));
    let run = folder.run(&["sensors", "task.toml", "--count", "2", "--cost", "6", "--method", "greedy"]);
    assert!(run.error().contains("does not prove that there is none"), "{run:?}");
    let run = folder.run(&["sensors", "task.toml", "--count", "2", "--cost", "1"]);
    assert!(run.error().contains("no set of sensors within the limits has"), "{run:?}");
    for (limit, value) in [("--budget", "the budget"), ("--cost", "the bound on the expected cost")] {
        let run = folder.run(&["sensors", "task.toml", limit, "-1"]);
        assert!(run.error().contains(&format!("{value} must be at least 0; found -1")), "{run:?}");
    }
}

#[test]
fn with_nothing_to_buy_the_empty_set_is_chosen_for_nothing() {
    let folder = Folder::with_task(misleading(2, "chosen = [\"both\"]"));
    let found = folder.run(&["sensors", "task.toml", "--count", "0", "--json"]).json(0);
    assert_eq!(found["chosen"]["price"].to_string(), "0.0");
}

#[test]
fn a_task_without_any_sensor_can_be_asked_everything() {
    let folder = Folder::with_task(misleading(0, ""));
    for command in ["evaluate", "check", "design", "bound", "sensors"] {
        let run = folder.run(&[command, "task.toml"]);
        assert_eq!(run.code, Some(0), "{command}: {run:?}");
    }
}

#[test]
fn measurements_with_correlated_noise_are_one_candidate_and_told() {
    let task = |v: &str| {
        format!(
            "model = {{ kind = \"linear\", A = [[1.0, 0.1], [0.0, 1.0]], B = [[0.0], [0.1]], C = [[1.0, 0.0], [0.0, 1.0]] }}\n\
             [[tasks]]\nname = \"hold\"\nsteps = 30\ntime_step = 0.1\ninitial_state = [1.0, 0.0]\n\
             noise = {{ initial = [1e-2, 1e-2], process = [1e-6, 1e-4], measurement = {v} }}\n\
             costs = [{{ kind = \"quadratic\", Q = [[1.0, 0.0], [0.0, 1.0]], R = [[0.1]] }}]\n"
        )
    };
    let remark = "y1, y2 are one candidate, chosen together: the noise of these measurements is correlated, in \
                  `noise.measurement`";
    let folder = Folder::with_task(task("[[1e-3, 1e-12], [1e-12, 1e-3]]"));
    let found = folder.run(&["sensors", "task.toml", "--count", "1", "--json"]).json(0);
    assert_eq!(found["remarks"], serde_json::json!([remark]));
    let page = folder.run(&["sensors", "task.toml", "--count", "1"]).stdout;
    assert!(page.contains(&format!("Note: {remark}.\n")), "{page}");
    let apart = Folder::with_task(task("[1e-3, 1e-3]"));
    let found = apart.run(&["sensors", "task.toml", "--count", "1", "--json"]).json(0);
    assert_eq!((&found["remarks"], found["sensors"].as_array().unwrap().len()), (&serde_json::json!([]), 2));
}
