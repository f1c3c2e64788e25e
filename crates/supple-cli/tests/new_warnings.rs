//! Warnings of `supple new` about tasks that it writes nonetheless: their numbers are those that the tasks have.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, repository};
use serde_json::Value;

const ARM: &str = include_str!("../templates/arm.urdf");

/// The warnings of `supple new` about a task that it writes nonetheless, and the result of an evaluation with trajectories.
fn warned(folder: &Folder, words: &[&str]) -> (Vec<String>, String, Value) {
    let run = folder.run(&[&["new", "task"][..], words].concat());
    assert_eq!(run.code, Some(0), "{words:?}: {}", run.stderr);
    let warnings: Vec<String> =
        run.stderr.lines().filter_map(|line| line.strip_prefix("warning: ")).map(str::to_owned).collect();
    folder.run(&["evaluate", "task.toml", "--rollouts", "0", "--out", "out"]);
    let result = std::fs::read_to_string(folder.path("out/result.json")).unwrap();
    let result: Value = serde_json::from_str(&result).unwrap();
    let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
    let task = result["result"]["evaluation"]["tasks"][0].clone();
    assert_exceeded(&warnings, &task);
    (warnings, text, task)
}

/// A plan is told to exceed limits by as much as the evaluation finds.
fn assert_exceeded(warnings: &[String], task: &Value) {
    for about in warnings.iter().filter(|warning| warning.starts_with("the plan exceeds the ")) {
        let violated = task["limits_violated"].as_array().unwrap().iter();
        let same = |found: &Value| {
            let near = |(said, key): (&f64, &str)| (said / found[key].as_f64().unwrap() - 1.0).abs() < 0.01;
            about.contains(found["name"].as_str().unwrap()) && numbers(about).iter().zip(["worst", "limit"]).all(near)
        };
        assert!(violated.clone().any(same), "{about}: {violated:?}");
    }
}

/// The numbers of a text, in their order.
fn numbers(text: &str) -> Vec<f64> {
    let parts = text.split([' ', ',', ':', ';', '(', ')', '=']);
    parts.filter_map(|part| part.trim_end_matches('.').parse().ok()).collect()
}

/// How far from its target the tool is at the end of a plan, m.
fn missed_by(task: &Value) -> f64 {
    let quantities = task["trajectory"]["quantities"].as_array().unwrap().iter();
    let places = quantities.filter(|q| q["of"].as_str().unwrap().starts_with("cost ") && q["unit"] == "m");
    let off = places
        .map(|q| q["values"].as_array().unwrap().last().unwrap().as_f64().unwrap() - q["target"].as_f64().unwrap());
    off.map(|off| off * off).sum::<f64>().sqrt()
}

/// A place beyond the length of the arm, and one within it: the first is told with how far the plan ends from it.
#[test]
fn targets_out_of_reach_are_told() {
    let robot = repository("models/wiping_arm.sdf").display().to_string();
    for (travel, is_far) in [("travel=1.3", true), ("travel=0.2", false)] {
        let folder = Folder::new();
        let words = ["--robot", &robot, "--template", "reach", "--frame", "hand", "--set", travel];
        let (warnings, text, task) = warned(&folder, &words);
        let about = warnings.iter().find(|warning| warning.contains("from its target"));
        let missed = missed_by(&task);
        assert_eq!(about.is_some(), is_far, "{missed} m: {warnings:?}\n{text}");
        let Some(about) = about else {
            assert!(missed < 0.05, "{missed}\n{text}");
            continue;
        };
        // How far, and the tolerance.
        let said = numbers(about);
        assert!((said[0] / missed - 1.0).abs() < 0.06 && missed > 0.5, "{missed} m, but {about}");
        assert!(text.contains(&format!("# tolerance {:?} m", said[1])), "{about}\n{text}");
    }
}

/// In its posture at rest, the last joint would turn beyond its range: the plan keeps it within.
#[test]
fn plans_keep_the_ranges_of_the_robot() {
    let robot = repository("models/wiping_arm.sdf").display().to_string();
    let folder = Folder::new();
    let words = ["--robot", &robot, "--template", "reach", "--frame", "hand", "--set", "travel=0.2"];
    let (warnings, text, task) = warned(&folder, &words);
    assert!(text.contains("kind = \"joint_position\"") && text.contains("enforce = true"), "{text}");
    assert_eq!(task["limits_violated"], serde_json::json!([]), "{warnings:?}");
    assert!(warnings.iter().all(|warning| !warning.contains("exceeds")), "{warnings:?}");
    // Without the limit it does not.
    std::fs::write(folder.path("free.toml"), text.replace("enforce = true", "enforce = false")).unwrap();
    let run = folder.run(&["evaluate", "free.toml", "--rollouts", "0", "--json"]);
    let free: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(free["tasks"][0]["limits_violated"][0]["name"], "position of joint `wrist`", "{}", run.stdout);
}

/// A press within 20 ms, for which no drive is strong enough: all limits that its plan exceeds are told.
#[test]
fn limits_that_no_correction_keeps_are_told() {
    let robot = repository("models/peg_on_wall.urdf").display().to_string();
    let words = ["--robot", &robot, "--template", "press", "--frame", "gripper", "--set", "time=0.02"];
    let (warnings, _, task) = warned(&Folder::new(), &words);
    let about = warnings.iter().filter(|warning| warning.starts_with("the plan exceeds the ")).count();
    assert!(about > 0 && about == task["limits_violated"].as_array().unwrap().len(), "{warnings:?}");
}

/// Doors that open farther than the arm can pull them: the angle of the hinge is a state, and no quantity of the cost.
#[test]
fn doors_that_open_too_far_are_told() {
    let folder = Folder::new();
    let robot = repository("models/wiping_arm.sdf").display().to_string();
    // Half a turn in little time.
    let set = ["--set", "travel=0.62", "--set", "time=0.3"];
    let words = [&["--robot", &robot, "--template", "handle", "--frame", "hand"], &set[..]].concat();
    let (warnings, text, task) = warned(&folder, &words);
    let about = warnings
        .iter()
        .find(|warning| warning.contains("rad from its target"))
        .unwrap_or_else(|| panic!("{warnings:?}"));
    let trajectory = &task["trajectory"];
    let names = trajectory["state_names"].as_array().unwrap();
    let hinge = names.iter().position(|name| name == "q.door_rz").unwrap();
    let end = trajectory["states"].as_array().unwrap().last().unwrap()[hinge].as_f64().unwrap();
    let table: toml::Value = toml::from_str(&text).unwrap();
    let costs = table["tasks"][0]["costs"].as_array().unwrap();
    let target = costs.iter().find(|cost| cost["kind"].as_str() == Some("joint_position")).unwrap();
    let target = target["target"][0].as_float().unwrap();
    let said = numbers(about)[0];
    assert!((said / (end - target).abs() - 1.0).abs() < 0.06, "from {end} to {target} rad, but {about}");
}

/// Where the sensor hardly lowers the cost, that is said with both costs, which are those in the file.
#[test]
fn sensors_of_little_use_are_told() {
    let folder = Folder::new();
    let robot = repository("models/elastic_elbow.urdf").display().to_string();
    let words = ["--robot", &robot, "--template", "reach", "--frame", "fingertip", "--set", "travel=0.79"];
    let (warnings, text, _) = warned(&folder, &words);
    let about = warnings.iter().find(|warning| warning.contains("--set disturbance")).unwrap();
    let (said, costs) = (numbers(about), common::costs(&text));
    assert!(said[0] < said[1] && said[1] < 1.05 * said[0], "{about}");
    assert!(said.iter().zip(costs).all(|(said, cost)| (said / cost - 1.0).abs() < 1e-3), "{about}, but {costs:?}");
    // Of use with what it measures.
    let words = [&words[..6], &["--set", "disturbance=0.5"]].concat();
    let (warnings, ..) = warned(&Folder::new(), &words);
    assert!(!warnings.iter().any(|warning| warning.contains("--set disturbance")), "{warnings:?}");
}

/// A speed limit that no joint reaches, and a range of a single position: both are told with the joint, and the second is
/// locked.
#[test]
fn odd_limits_of_robot_files_are_told() {
    let folder = Folder::new();
    let fast = ARM.replacen("velocity=\"3\"", "velocity=\"500\"", 1);
    std::fs::write(folder.path("arm.urdf"), fast).unwrap();
    let words = ["--robot", "arm.urdf", "--template", "press"];
    let (warnings, text, _) = warned(&folder, &words);
    let about: Vec<_> = warnings.iter().filter(|warning| warning.contains("`velocity`")).collect();
    assert!(about.len() == 1 && about[0].contains("`turn`") && numbers(about[0]) == [500.0], "{warnings:?}");
    assert!(!text.contains("locked"), "{text}");
    let folder = Folder::new();
    let still = ARM.replacen("lower=\"-3.1\" upper=\"3.1\"", "lower=\"0.2\" upper=\"0.2\"", 1);
    assert_ne!(still, ARM);
    std::fs::write(folder.path("arm.urdf"), still).unwrap();
    let (warnings, text, task) = warned(&folder, &words);
    let about: Vec<_> = warnings.iter().filter(|warning| warning.contains("`turn`")).collect();
    assert!(about.len() == 1 && about[0].contains("`lower`") && about[0].contains("`upper`"), "{warnings:?}");
    let table: toml::Value = toml::from_str(&text).unwrap();
    assert_eq!(table["model"]["locked"].as_array().unwrap()[0].as_str(), Some("turn"), "{text}");
    assert!(!task["trajectory"]["state_names"].as_array().unwrap().iter().any(|name| name == "q.turn"));
}

/// Costs of single runs of free motions differ a lot: their tasks ask for more roll-outs than the default, and an evaluation
/// then needs no more.
#[test]
fn free_motions_ask_for_enough_rollouts() {
    for (template, asked) in [("reach", Some(1000)), ("press", None)] {
        let folder = Folder::new();
        std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
        assert_eq!(folder.run(&["new", "task", "--robot", "arm.urdf", "--template", template]).code, Some(0));
        let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
        let table: toml::Value = toml::from_str(&text).unwrap();
        let found = table.get("design").and_then(|part| part.get("rollouts")).and_then(toml::Value::as_integer);
        assert_eq!(found, asked, "{text}");
        let task = folder.run(&["evaluate", "task.toml", "--json"]).json(0)["tasks"][0].clone();
        assert_eq!(task["trust"]["verdict"], "holds", "{template}: {}", task["trust"]);
    }
}

/// A travel that is longer than from end to end of the arm is refused before anything is planned.
#[test]
fn a_travel_beyond_the_length_of_the_arm_is_refused() {
    let robot = repository("models/wiping_arm.sdf").display().to_string();
    let folder = Folder::new();
    let run =
        folder.run(&["new", "task", "--robot", &robot, "--template", "wipe", "--frame", "hand", "--set", "travel=5"]);
    assert_eq!(run.code, Some(2), "{}", run.stderr);
    assert!(run.stderr.contains("--set travel: the tool at `hand` can move by"), "{}", run.stderr);
    assert!(!folder.path("task.toml").exists());
}

/// A door that would open by more than half a turn was planned for a minute, and then only warned of.
#[test]
fn doors_that_open_by_more_than_half_a_turn_are_refused() {
    let robot = repository("models/wiping_arm.sdf").display().to_string();
    let folder = Folder::new();
    for travel in ["travel=0.65", "travel=2", "travel=1e300"] {
        let words = ["--robot", &robot, "--template", "handle", "--frame", "hand", "--set", travel];
        let run = folder.run(&[&["new", "task"][..], &words].concat());
        assert_eq!(run.code, Some(2), "{travel}: {}", run.stderr);
        let valid =
            "--set travel: the handle moves along an arc around the hinge, 0.2 m away, by at most 0.628 m, half a turn";
        assert!(run.stderr.contains(valid), "{}", run.stderr);
        assert!(run.stderr.contains("which opens the door by") && run.stderr.contains(" rad"), "{}", run.stderr);
        assert!(!folder.path("task.toml").exists());
    }
}

/// A travel that is halved because the tool reaches no farther is told, with both lengths, and stands in the file.
#[test]
fn a_travel_that_is_halved_is_told() {
    let folder = Folder::new();
    std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
    let mut told = 0;
    for travel in [0.1, 0.9, 1.3] {
        let set = format!("travel={travel}");
        let words = ["--robot", "arm.urdf", "--template", "reach", "--set", &set];
        let run = folder.run(&[&["new", "task"][..], &words].concat());
        let text = std::fs::read_to_string(folder.path("task.toml")).unwrap_or_default();
        let said = run.stderr.contains(&format!("the tool moves by {} m instead of {travel} m", travel / 2.0));
        let comment = text.contains(&format!("m: {:?} m away, half of the travel", travel / 2.0));
        assert_eq!(said, comment || text.is_empty() && said, "{}\n{text}", run.stderr);
        told += usize::from(said);
        assert!(travel > 0.5 || !said, "{}", run.stderr);
        let _ = std::fs::remove_file(folder.path("task.toml"));
    }
    assert!(told > 0, "none of these travels is halved");
}

/// A base that no drive holds falls, whatever the leg below it does.
#[test]
fn robots_that_fall_are_told() {
    let folder = Folder::new();
    let body = "<inertial><mass value=\"2\"/><inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";
    let robot = format!(
        "<robot name=\"hopper\"><link name=\"world\"/>\
         <joint name=\"drop\" type=\"prismatic\"><parent link=\"world\"/><child link=\"base\"/><axis xyz=\"0 0 1\"/>\
         <limit lower=\"-5\" upper=\"5\" effort=\"0\" velocity=\"10\"/></joint><link name=\"base\">{body}</link>\
         <joint name=\"leg\" type=\"prismatic\"><parent link=\"base\"/><child link=\"foot\"/><axis xyz=\"0 0 1\"/>\
         <limit lower=\"-1\" upper=\"1\" effort=\"100\" velocity=\"10\"/></joint><link name=\"foot\">{body}</link></robot>"
    );
    std::fs::write(folder.path("hopper.urdf"), &robot).unwrap();
    let run = folder.run(&["new", "hop", "--robot", "hopper.urdf"]);
    assert!(run.stderr.contains("gravity moves joints `drop`, for which"), "{}", run.stderr);
    std::fs::write(folder.path("held.urdf"), robot.replace("effort=\"0\"", "effort=\"500\"")).unwrap();
    let run = folder.run(&["new", "held", "--robot", "held.urdf"]);
    assert!(!run.stderr.contains("gravity moves"), "{}", run.stderr);
}

/// Drafts without a template were written untried: friction held a small finger short of half of its way, and nothing said so.
#[test]
fn drafts_reach_their_targets_or_say_that_they_do_not() {
    let finger = ARM.replace("damping=\"", "friction=\"10\" damping=\"1").replace("xyz=\"0 0 0.", "xyz=\"0 0 0.0");
    let stuck = ARM.replacen(
        "effort=\"100\" velocity=\"3\"/><dynamics damping=\"1.0\"",
        "effort=\"0\"/><dynamics damping=\"1000\"",
        1,
    );
    let shipped = std::fs::read_dir(repository("models")).unwrap().map(|entry| entry.unwrap().path());
    let shipped: Vec<_> =
        shipped.filter(|path| path.is_file()).map(|path| (path.display().to_string(), None)).collect();
    assert!(shipped.len() >= 5 && finger != ARM && stuck != ARM);
    let folder = Folder::new();
    std::fs::write(folder.path("finger.urdf"), finger).unwrap();
    std::fs::write(folder.path("stuck.urdf"), stuck).unwrap();
    let own = [("finger.urdf".to_owned(), Some(true)), ("stuck.urdf".to_owned(), Some(false))];
    for (robot, reaches) in own.into_iter().chain(shipped) {
        let (warnings, text, task) = warned(&folder, &["--robot", &robot]);
        std::fs::remove_file(folder.path("task.toml")).unwrap();
        std::fs::remove_dir_all(folder.path("out")).unwrap();
        assert_eq!(task["status"], "converged", "{robot}: {text}");
        let about = warnings.iter().find(|warning| warning.contains("from its target"));
        assert!(reaches.is_none_or(|reaches| about.is_none() == reaches), "{robot}: {warnings:?}\n{text}");
        // Where the end of the limb goes to, and where it starts.
        let Some(line) = text.lines().find(|line| line.contains("it starts at")) else { continue };
        let places: Vec<f64> = line.split(['[', ']', ',']).filter_map(|part| part.trim().parse().ok()).collect();
        let way = (0..3).map(|i| (places[i] - places[i + 3]).powi(2)).sum::<f64>().sqrt();
        let missed = missed_by(&task);
        assert_eq!(missed < 0.1 * way, about.is_none(), "{robot}: {missed} m of {way} m\n{text}");
        if let Some(about) = about {
            let said = numbers(about);
            assert!(
                (said[0] / missed - 1.0).abs() < 0.06 && (said[1] / way - 1.0).abs() < 0.06,
                "{missed} of {way}: {about}"
            );
        }
    }
}

/// A tool that starts deep inside its wall is told by `evaluate`, with its depth and force.
#[test]
fn contacts_that_start_deep_inside_are_told() {
    let folder = Folder::new();
    std::fs::write(folder.path("arm.urdf"), ARM).unwrap();
    assert_eq!(folder.run(&["new", "task", "--robot", "arm.urdf", "--template", "press", "--wall=-x"]).code, Some(0));
    let text = std::fs::read_to_string(folder.path("task.toml")).unwrap();
    let about =
        |run: &common::Run| run.stderr.contains("m inside its wall") || run.stdout.contains("m inside its wall");
    assert!(!about(&folder.run(&["evaluate", "task.toml", "--rollouts", "0"])));
    let deep = text.replacen("[tasks.initial_state]\n", "[tasks.initial_state]\n\"c.wall\" = 0.2\n", 1);
    std::fs::write(folder.path("task.toml"), deep).unwrap();
    let run = folder.run(&["evaluate", "task.toml", "--rollouts", "0"]);
    assert!(about(&run), "{}\n{}", run.stdout, run.stderr);
    let all = run.stdout + &run.stderr;
    assert!(
        all.contains("contact `wall` is 0.2 m inside its wall and exerts 114 N, where a cost tracks 10 N"),
        "{all}"
    );
}

/// What the reader of a robot file warns of: every command that reads the task prints it, and so does the one that writes
/// it.
#[test]
fn warnings_of_the_robot_file_are_printed() {
    let robot =
        ARM.replacen("<robot ", "<robot unknown_attribute=\"1\" ", 1).replacen("</robot>", "<strange/></robot>", 1);
    for words in [&[][..], &["--template", "reach"]] {
        let folder = Folder::new();
        std::fs::write(folder.path("robot.urdf"), &robot).unwrap();
        let run = folder.run(&[&["new", "task", "--robot", "robot.urdf"], words].concat());
        assert_eq!(run.code, Some(0), "{words:?}: {}", run.stderr);
        let expected = folder.run(&["evaluate", "task.toml", "--rollouts", "0"]).stderr;
        // In a task the file is named, as other warnings are about the task.
        let of_file: Vec<&str> =
            expected.lines().filter_map(|line| line.strip_prefix("warning: robot.urdf: ")).collect();
        let [of_file] = of_file.iter().filter(|line| line.contains("strange")).collect::<Vec<_>>()[..] else {
            panic!("{expected}")
        };
        assert_eq!(run.stderr.matches(of_file).count(), 1, "{words:?}: {}", run.stderr);
    }
}
