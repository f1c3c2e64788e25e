//! `supple bound`: numbers known from elsewhere, and what is refused.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, LINEAR, TWO_MASS, edited};
use serde_json::Value;

const PLANT: &str = include_str!("../../../tasks/tanaka_plant.toml");

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key}: {}", value[key]))
}

#[test]
fn the_plant_of_tanaka_at_every_cost() {
    // Cost, minimum, Kostina and Hassibi, and the rank where it is known: bits per step.
    let known = [
        ("33", 6.1727, 5.778, Some(3)),
        ("35", 4.5742, 3.881, None),
        ("40", 3.2719, 2.338, Some(2)),
        ("50", 2.3595, 1.436, None),
        ("60", 1.9437, 1.101, Some(1)),
        ("80", 1.6031, 0.816, None),
        ("100", 1.4631, 0.689, None),
        ("200", 1.2770, 0.495, None),
        ("1000", 1.1861, 0.380, None),
    ];
    let folder = Folder::with_task(PLANT);
    for (cost, minimum, bound, rank) in known {
        let found = folder.run(&["bound", "task.toml", "--stationary", "--cost", cost, "--json"]).json(0);
        assert!((number(&found, "floor_bits_per_step") - 1.168539).abs() < 1e-6, "{cost}");
        assert!((number(&found, "minimum_cost") - 31.48334).abs() < 1e-5, "{cost}");
        let least = number(&found, "minimum_bits_per_step");
        assert!((least - minimum).abs() < 2e-4, "at {cost}: {least} and {minimum}");
        assert!((number(&found, "kostina_hassibi_bits_per_step") - bound).abs() < 6e-4, "{cost}");
        assert!((0.0..1e-6).contains(&number(&found, "duality_gap_bits")), "{cost}");
        let closed = number(&found, "closed_form_bits_per_step");
        assert!((closed - bound.max(1.168539)).abs() < 6e-4 && closed <= least, "{cost}");
        let sensor = &found["virtual_sensor"];
        if let Some(rank) = rank {
            assert_eq!(sensor["rank"], rank, "{cost}");
        }
        assert_eq!(sensor["measurement"][0].as_array().unwrap().len(), sensor["rank"], "{cost}");
    }
}

#[test]
fn the_plant_of_tanaka_over_horizons() {
    // The first state is charged here and not there: 4 more, whatever is measured.
    for (steps, cost, bits) in
        [(10, 40.0, 2.61241), (20, 40.0, 2.93752), (10, 80.0, 1.11315), (20, 80.0, 1.35806), (2, 80.0, 0.0)]
    {
        let folder = Folder::with_task(edited(PLANT, "steps = 20", &format!("steps = {steps}")));
        let cost = (f64::from(steps) * cost + 4.0).to_string();
        let found = folder.run(&["bound", "task.toml", "--cost", &cost, "--json"]).json(0);
        let least = number(&found, "minimum_bits_per_step");
        assert!((least - bits).abs() < 2e-4, "{steps} steps, {cost}: {least} and {bits}");
        assert!((0.0..1e-6).contains(&number(&found, "duality_gap_bits")));
        assert_eq!(found["floor_is_bound"], false);
        assert_eq!(found["minimum_per_step_bits"].as_array().unwrap().len(), steps as usize);
    }
}

#[test]
fn of_several_tasks_each_is_told_or_the_named_one() {
    let folder = Folder::with_task(LINEAR);
    let all = folder.run(&["bound", "task.toml", "--json"]).json(0);
    let names: Vec<&str> = all["tasks"].as_array().unwrap().iter().map(|task| task["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["reach", "hold"]);
    let one = folder.run(&["bound", "task.toml", "--task", "hold", "--json"]).json(0);
    assert_eq!(one["minimum_bits_per_step"], all["tasks"][1]["minimum_bits_per_step"]);
    assert!(one.get("tasks").is_none());
    let error = folder.run(&["bound", "task.toml", "--cost", "3"]);
    assert!(error.error().contains("several tasks: `reach`, `hold`; say which task"), "{error:?}");
    let error = folder.run(&["bound", "task.toml", "--task", "hodl"]);
    assert_eq!(error.error(), "error: no task `hodl`; valid: `reach`, `hold`");
}

#[test]
fn a_cost_that_nobody_keeps_names_the_least() {
    let folder = Folder::with_task(PLANT);
    let error = folder.run(&["bound", "task.toml", "--stationary", "--cost", "31"]);
    assert!(error.error().contains("31.483") && error.error().contains("ask for more"), "{error:?}");
    let error = folder.run(&["bound", "task.toml", "--cost", "nan"]);
    assert!(error.error().contains("not finite"), "{error:?}");
    assert_eq!(folder.run(&["bound", "task.toml", "--curve=1"]).code, Some(2));
}

#[test]
fn a_steady_state_needs_a_linear_model_that_does_not_change() {
    let error = Folder::with_task(TWO_MASS).run(&["bound", "task.toml", "--stationary"]);
    assert!(error.error().contains("has no steady state") && error.error().contains("linear"), "{error:?}");
    // A norm that is not quadratic.
    let folder = Folder::with_task(LINEAR);
    let error = folder.run(&["bound", "task.toml", "--stationary", "--task", "hold"]);
    assert!(error.error().contains("the curvature of its costs differs"), "{error:?}");
    // A target other than 0, and a number that drifts: the cost is not x'Qx about 0.
    let plant = edited(
        PLANT,
        "[[tasks.costs]]",
        "[[tasks.costs]]\nkind = \"state\"\nselect = [\"x1\"]\ntarget = [0.5]\nweight = 1.0\n\n[[tasks.costs]]",
    );
    let error = Folder::with_task(plant).run(&["bound", "task.toml", "--stationary"]);
    assert!(error.error().contains("its costs are not"), "{error:?}");
    // A state that grows and costs nothing needs no information: the floor is that of keeping it bounded, and no bound.
    let unseen = edited(
        PLANT,
        "Q = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]",
        "Q = [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]]",
    );
    let found = Folder::with_task(unseen).run(&["bound", "task.toml", "--stationary", "--cost", "1", "--json"]).json(0);
    assert_eq!((found["floor_is_bound"].clone(), found["minimum_bits_per_step"].clone()), (false.into(), 0.0.into()));
    folder.run(&["bound", "task.toml", "--stationary", "--task", "reach", "--json"]).json(0);
}

#[test]
fn a_curve_is_kept_shown_again_and_drawn() {
    let folder = Folder::with_task(PLANT);
    let words = ["bound", "task.toml", "--stationary", "--curve=6", "--cost=40", "--out", "kept"];
    let run = folder.run(&words);
    let (code, page) = run.quiet();
    assert_eq!(code, Some(0));
    assert!(page.contains("Kostina and Hassibi") && page.contains("Virtual sensor"), "{page}");
    assert_eq!(folder.run(&["show", "kept"]).quiet().1, page);
    let shown = folder.run(&["show", "kept", "--json"]).json(0);
    let points = shown["curve"].as_array().unwrap();
    assert_eq!(points.len(), 6);
    let bits: Vec<f64> = points.iter().map(|point| number(point, "minimum_bits_per_step")).collect();
    assert!(bits.windows(2).all(|pair| pair[0] >= pair[1]), "{bits:?}");
    assert!(points.iter().any(|point| point["cost"] == 40.0));
    let csv = std::fs::read_to_string(folder.path("kept/curve.csv")).unwrap();
    assert_eq!(csv.lines().count(), 7);
    assert!(
        csv.starts_with("task,cost,minimum_bits_per_step,minimum_lower_bits_per_step,closed_form_bits_per_step,error")
    );
    folder.run(&["plot", "kept", "--figure", "bound"]).quiet();
    folder.run(&["report", "kept"]).quiet();
    assert!(folder.path("bound.svg").exists() && folder.path("report.html").exists());
}

#[test]
fn bounds_are_steps_of_study_files() {
    let folder = Folder::with_task(PLANT);
    let study = "title = \"Bounds\"\n[[steps]]\nname = \"least\"\nrun = \"bound\"\ntask = \"task.toml\"\nstationary = true\ncost = 40\n";
    std::fs::write(folder.path("study.toml"), study).unwrap();
    let run = folder.run(&["study", "study.toml", "--out", "done"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(folder.path("done/least/result.json").exists());
}
