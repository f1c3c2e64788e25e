//! What the program says of contacts: when plans touch, and that a plan which misses a contact is not to be trusted.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, TWO_MASS, edited, repository};

/// The weights of force and depth so small that the plan stays where it is; little to search.
fn idle() -> Folder {
    let text = edited(TWO_MASS, "[10.0]", "[0.0]").replace("weight = 0.05", "weight = 1e-14");
    Folder::with_task(text + "\n[design]\nstarts = 1\nmax_evaluations = 3\nbranch_attempts = 0\n")
}

const WARNING: &str = "task `press`: the plan never makes contact with `wall`, but cost 1 (contact_force) tracks a force of 3 N there; the minimum clearance is 0.";

#[test]
fn evaluate_shows_what_the_plan_touches() {
    let folder = Folder::with_task(TWO_MASS);
    let run = folder.run(&["evaluate", "task.toml"]);
    let (code, page) = run.quiet();
    assert_eq!(code, Some(0));
    assert!(page.contains(" contact ") && page.contains("least clearance, m"), "{page}");
    let row = page.lines().find(|line| line.trim_start().starts_with("wall ")).unwrap();
    let found = folder.run(&["evaluate", "task.toml", "--json"]).json(0);
    let contact = &found["tasks"][0]["contacts"][0];
    let keys: Vec<&str> = contact.as_object().unwrap().keys().map(String::as_str).collect();
    let expected = [
        "first_s",
        "greatest_force_apart_N",
        "last_s",
        "least_clearance_m",
        "mean_force_N",
        "name",
        "peak_force_N",
        "share_of_time",
        "touches",
    ];
    let mut sorted = keys.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, expected);
    let share = format!("{:.3}", contact["share_of_time"].as_f64().unwrap());
    let [_, first, last, ..] = row.split_whitespace().collect::<Vec<_>>()[..] else { panic!("{row}") };
    assert!((first.parse::<f64>().unwrap() - contact["first_s"].as_f64().unwrap()).abs() < 1e-9, "{row}");
    assert_eq!((last, contact["last_s"].as_f64()), ("2.5", Some(2.5)));
    assert!(row.contains(&share), "{share} is not in {row}");
    assert_eq!(found["tasks"][0]["warnings"].as_array().map(Vec::len), Some(0));
}

#[test]
fn evaluate_shows_what_became_of_targets_and_points_out_those_that_are_missed() {
    let text = std::fs::read_to_string(repository("tasks/wiping_arm.toml")).unwrap();
    let text = text.replace("../models", repository("models").to_str().unwrap());
    let told = |text: &str| {
        let folder = Folder::with_task(text);
        let run = folder.run(&["evaluate", "task.toml", "--rollouts", "0"]);
        let (code, page) = run.quiet();
        assert_eq!(code, Some(0));
        page.to_owned()
    };
    let as_shipped = told(&text);
    let row = as_shipped.lines().find(|line| line.contains("2 frame_point")).unwrap();
    assert!(row.contains("y of pad, m") && row.contains(" 0.1 ") && row.contains(" 0.0955"), "{row}");
    assert!(!as_shipped.contains("on its way"), "{as_shipped}");

    // With weights that are too low, the pad hardly moves along the wall.
    let (weak, page) = ("weight = 0.1\nfinal_weight = 20.0\n", "weight = 10.0\nfinal_weight = 2000.0\n");
    assert!(text.contains(page));
    let missed = told(&text.replace(page, weak));
    let line = "`y of pad` of cost 2 frame_point ends at -0.08";
    assert!(missed.contains(line) && missed.contains("on its way from -0.0999"), "{missed}");
}

/// A pad that is to stay where it starts is no target that is missed.
#[test]
fn targets_near_the_start_are_not_missed() {
    let text = std::fs::read_to_string(repository("tasks/wiping_arm.toml")).unwrap();
    let text = text.replace("../models", repository("models").to_str().unwrap());
    let folder = Folder::with_task(edited(&text, "target = [0.1] ", "target = [-0.1] "));
    let run = folder.run(&["evaluate", "task.toml", "--rollouts", "0"]);
    let (_, page) = run.quiet();
    assert!(page.contains("2 frame_point") && !page.contains("on its way"), "{page}");
}

#[test]
fn a_folder_in_place_of_a_task_is_named_so() {
    let folder = Folder::with_task(TWO_MASS);
    std::fs::create_dir(folder.path("found")).unwrap();
    let run = folder.run(&["evaluate", "found"]);
    assert!(run.error().contains("it is a folder, not a file"), "{}", run.error());
}

#[test]
fn evaluate_warns_of_a_contact_that_is_missed_and_exits_with_1() {
    let folder = idle();
    let run = folder.run(&["evaluate", "task.toml", "--out", "out"]);
    let (code, page) = run.quiet();
    assert_eq!(code, Some(1));
    assert!(page.contains(&format!("\nWarning: {WARNING}")) && page.contains("never"), "{page}");
    let found = folder.run(&["evaluate", "task.toml", "--json"]).json(1);
    let task = &found["tasks"][0];
    assert!(task["warnings"][0].as_str().unwrap().starts_with(WARNING), "{task}");
    assert_eq!(
        (&task["contacts"][0]["touches"], &task["contacts"][0]["first_s"]),
        (&false.into(), &serde_json::Value::Null)
    );
    assert_eq!(folder.run(&["show", "out"]).stdout, page);
    let report = folder.run(&["report", "out", "--out", "report.html"]);
    assert_eq!(report.code, Some(0), "{report:?}");
    let report = std::fs::read_to_string(folder.path("report.html")).unwrap();
    for part in [
        "Contacts of the plan",
        "never touches wall",
        "the plan never makes contact with <code>wall</code>, but cost 1",
    ] {
        assert!(report.contains(part), "{part} is not in the report");
    }
}

#[test]
fn design_counts_designs_that_miss_the_contact_and_exits_with_1() {
    let folder = idle();
    let run = folder.run(&["design", "task.toml", "--json"]);
    assert_eq!(run.code, Some(1));
    let found: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    let evaluations = found["evaluations"].as_u64().unwrap();
    assert!(evaluations > 0);
    assert_eq!(found["evaluations_without_contact"], evaluations);
    assert_eq!(found["starts"][0]["evaluations_without_contact"], found["starts"][0]["evaluations"]);
    assert!(found["optimum"]["tasks"][0]["warnings"][0].as_str().unwrap().starts_with(WARNING));
    let page = folder.run(&["design", "task.toml"]).stdout;
    let count = match evaluations {
        1 => "1 of these designs never makes".to_owned(),
        count => format!("{count} of these designs never make"),
    };
    let footer = format!("\n{count} a contact whose force a cost tracks.\n");
    assert!(page.contains(&footer), "{page}");
    assert!(page.contains(&format!("\nWarning: {WARNING}")) && page.contains("Contacts of press:\n"), "{page}");
}

#[test]
fn sweeps_have_columns_of_contacts_and_count_points_that_miss_them() {
    let grid = ["sweep", "task.toml", "--grid", "k1=50,60"];
    let touching = Folder::with_task(TWO_MASS);
    let run = touching.run(&[&grid[..], &["--json"]].concat());
    assert_eq!(run.code, Some(0));
    for line in run.stdout.lines() {
        let row: serde_json::Value = serde_json::from_str(line).unwrap();
        let number = |name: &str| row[name].as_f64().unwrap();
        assert!((0.1..=1.0).contains(&number("press.wall.share_of_time")), "{row}");
        assert!(number("press.wall.peak_force_N") > 0.5, "{row}");
        assert_eq!(number("press.misses_contact"), 0.0, "{row}");
    }
    assert!(!touching.run(&grid).stdout.contains("Warning"), "all points touch");
    let missing = idle().run(&grid);
    assert_eq!(missing.code, Some(1), "no point is to be trusted: {missing:?}");
    let line = "Warning: at 2 points the plan of press never makes a contact whose force a cost tracks: see the \
                column `press.misses_contact`.\n";
    assert!(missing.stdout.ends_with(line), "{}", missing.stdout);
}
