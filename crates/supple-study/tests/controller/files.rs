//! What the files of controllers hold, and what is refused.

use std::path::Path;

use serde_json::Value;
use supple::simulate::Rollouts;
use supple::{EvaluateOptions, Named};
use supple_study::controller::{At, CSource, ControllerFile, ControllerFormat, ExportedController};
use supple_study::{OWN_MODEL, Source, StudyResult};

use super::{evaluated, exported, repository, shipped};

/// The number at a place of nested lists.
fn at(value: &Value, places: &[usize]) -> f64 {
    places.iter().fold(value, |value, &place| &value[place]).as_f64().unwrap()
}

/// Every number of the JSON reads back to the bits that it was.
#[test]
fn json_holds_the_controller_to_the_last_bit() {
    let task = shipped("two_mass.toml");
    let (exported, _) = exported(&evaluated(&task, 0), None);
    let read: Value = serde_json::from_str(&exported.to_json().unwrap()).unwrap();
    assert_eq!((&read["format"], &read["version"]), (&Value::from("supple-controller"), &Value::from(1)));
    assert_eq!((&read["task"], &read["status"]), (&Value::from("press"), &Value::from("converged")));
    assert_eq!(read["control_lower"], Value::from(vec![Value::Null]), "no bounds");
    let controller = &exported.controller;
    for t in 0..controller.steps() {
        for i in 0..5 {
            assert_eq!(at(&read["states"], &[t, i]), controller.trajectory.states.vector(t)[i]);
            assert_eq!(at(&read["feedback"], &[t, 0, i]), controller.feedback.get(t, 0, i));
            assert_eq!(at(&read["input"], &[t, i, 0]), controller.dynamics.get(t, i, 5));
            assert_eq!(at(&read["filter_gain"], &[t, i, 1]), controller.filter_gain.get(t, i, 1));
            assert_eq!(at(&read["process_covariance"], &[t, i, i]), controller.noise.process.get(t, i, i));
        }
    }
    let lengths = ["time", "expected_measurements", "measurement_covariance", "controls", "dynamics"];
    assert_eq!(lengths.map(|key| read[key].as_array().unwrap().len()), [126, 126, 126, 125, 125]);
}

/// The table of the documentation has every key, and no other.
#[test]
fn the_documentation_lists_all_keys() {
    let (exported, _) = exported(&evaluated(&shipped("tanaka_plant.toml"), 0), None);
    let read: Value = serde_json::from_str(&exported.to_json().unwrap()).unwrap();
    let mut keys: Vec<&str> = read.as_object().unwrap().keys().map(String::as_str).collect();
    let page = std::fs::read_to_string(repository("docs/controller.md")).unwrap();
    let table = page.split("| Key | Shape |").nth(1).unwrap();
    let cells = table.lines().filter_map(|line| line.strip_prefix('|')?.split('|').next());
    let mut listed: Vec<&str> = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).collect();
    keys.sort_unstable();
    listed.sort_unstable();
    assert_eq!(keys, listed);
}

/// Sizes and costs of shipped tasks are those that the documentation tells.
#[test]
fn the_documentation_has_the_right_numbers() {
    let page = std::fs::read_to_string(repository("docs/controller.md")).unwrap();
    let rows: Vec<Vec<&str>> = page
        .lines()
        .filter(|line| line.starts_with("| `") && line.matches(" | ").count() == 5)
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect();
    assert_eq!(rows.len(), 3);
    for row in rows {
        let names: Vec<&str> = row[0].split('`').skip(1).step_by(2).collect();
        let task = shipped(&format!("{}.toml", names[0]));
        let wanted = EvaluateOptions { trajectories: true, rollouts: 256, ..Default::default() };
        let evaluation = task.problem.evaluate(&task.phi, &wanted).unwrap();
        let extended = evaluation.tasks[0].monte_carlo.as_ref().unwrap().cost_mean;
        let (exported, _) = exported(&evaluated(&task, 0), Some(names[1]));
        let header = CSource::of(&exported, "out.h").unwrap().header;
        for said in
            [format!("Tables: {} bytes", row[1]), format!("State: {} bytes", row[2]), format!("Work: {} ", row[3])]
        {
            assert!(header.contains(&said), "{}: {said}", row[0]);
        }
        for (said, found) in
            [(row[4], extended), (row[5], exported.monte_carlo(Rollouts { count: 256, seed: 0 }).unwrap().cost_mean)]
        {
            let number: f64 = said.parse().unwrap();
            assert!((number - found).abs() <= 1e-3 * number, "{}: {said} for {found}", row[0]);
        }
    }
}

/// The plan is that of the result to the last bit, though it is not planned again; so are the parameters, where these are
/// not those of the file.
#[test]
fn the_plan_is_the_one_of_the_result() {
    let mut task = shipped("two_mass.toml");
    task.problem.parameters.set(&mut task.phi, "k1", 123.456).unwrap();
    let folder = evaluated(&task, 0);
    let file = ControllerFile::of(&exported(&folder, None).0);
    let given = ControllerFile::of(&ExportedController::of(&folder, Some(&task), None, None).unwrap());
    let StudyResult::Evaluate(report) = &folder.result else { panic!("no evaluation") };
    let plan = report.evaluation.tasks[0].trajectory.as_ref().unwrap();
    assert_eq!((&file.states, &file.controls, &file.feedback), (&plan.states, &plan.controls, &plan.feedback));
    assert_eq!(file.parameters.get("k1"), Some(123.456));
    assert_eq!((&file.dynamics, &file.filter_gain), (&given.dynamics, &given.filter_gain));
    let deviations = |t: usize| (0..5).map(|i| file.belief_covariance[t][i][i].max(0.0).sqrt()).collect::<Vec<_>>();
    (0..=file.steps).for_each(|t| assert_eq!(deviations(t), plan.deviations[t]));
}

#[test]
fn results_without_a_controller_are_refused() {
    let task = shipped("iiwa_door.toml");
    let folder = evaluated(&task, 0);
    let refused = |folder: &_, task, at| ExportedController::of(folder, None, task, at).err().unwrap().to_string();
    assert_eq!(refused(&folder, None, None), "there are several tasks; choose one with --task: open, close");
    assert_eq!(refused(&folder, Some("opne"), None), "no task is named `opne`; valid names: open, close");
    let start = refused(&folder, Some("open"), Some(At::Start));
    assert!(start.contains("is from `supple evaluate` and holds one design"), "{start}");

    let mut own = folder.clone();
    own.path = "kept".into();
    own.made.sources = vec![Source { path: OWN_MODEL.into(), text: String::new() }];
    let said = refused(&own, Some("open"), None);
    assert!(said.starts_with("kept: was made of a model in Python") && said.contains("result.controller()"), "{said}");

    let spoiled = |spoil: fn(&mut supple::TrajectoryReport)| {
        let mut folder = folder.clone();
        let StudyResult::Evaluate(report) = &mut folder.result else { panic!("no evaluation") };
        spoil(report.evaluation.tasks[0].trajectory.as_mut().unwrap());
        refused(&folder, Some("open"), None)
    };
    assert!(spoiled(|plan| plan.feedforward.clear()).contains("has no feedforward; recompute the result"));
    assert!(spoiled(|plan| plan.states[3].truncate(2)).contains("is damaged"));
    assert!(spoiled(|plan| drop(plan.states.pop())).contains("the list of states of a controller of task `open`"));
    assert!(spoiled(|plan| plan.feedback.iter_mut().for_each(|gains| gains.truncate(1))).contains("the feedback"));

    let mut bare = folder.clone();
    let StudyResult::Evaluate(report) = &mut bare.result else { panic!("no evaluation") };
    report.evaluation.tasks[0].trajectory = None;
    assert!(refused(&bare, Some("open"), None).contains("has no trajectories"));
    let mut other = folder.clone();
    let StudyResult::Evaluate(report) = &mut other.result else { panic!("no evaluation") };
    report.evaluation.parameters = Named(vec![("mass".into(), 1.0)]);
    assert!(refused(&other, Some("open"), None).contains("`mass`"));
}

#[test]
fn c_goes_to_a_file_of_c() {
    let (exported, _) = exported(&evaluated(&shipped("tanaka_plant.toml"), 0), None);
    let folder = tempfile::tempdir().unwrap();
    for name in ["out", "out.h", ".c", "out.json"] {
        let error = exported.write(ControllerFormat::C, &folder.path().join(name)).unwrap_err();
        assert!(error.to_string().contains("must be a file NAME.c"), "{error}");
    }
    assert!(exported.write(ControllerFormat::Json, Path::new("..")).is_err());
    std::fs::create_dir(folder.path().join("out.h")).unwrap();
    assert!(exported.write(ControllerFormat::C, &folder.path().join("out.c")).is_err(), "the header is a folder");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing was written");
}
