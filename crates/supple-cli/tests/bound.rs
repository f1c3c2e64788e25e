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
    assert!(error.error().contains("several tasks: `reach`, `hold`; choose the task with --task"), "{error:?}");
    let error = folder.run(&["bound", "task.toml", "--task", "hodl"]);
    assert_eq!(error.error(), "error: no task `hodl`; valid: `reach`, `hold`");
}

#[test]
fn a_cost_that_nobody_keeps_names_the_least() {
    let folder = Folder::with_task(PLANT);
    let error = folder.run(&["bound", "task.toml", "--stationary", "--cost", "31"]);
    assert!(error.error().contains("31.483") && error.error().contains("choose a larger cost"), "{error:?}");
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

/// A linear task with the identity as its sensors.
fn linear(a: &str, b: &str, w: &str, q: &str, r: &str, steps: usize) -> String {
    let identity = if a.matches('[').count() == 2 { "[[1.0]]" } else { "[[1.0, 0.0], [0.0, 1.0]]" };
    format!(
        "title = \"x\"\n[model]\nkind = \"linear\"\nA = {a}\nB = {b}\nC = {identity}\n[[tasks]]\nname = \"t\"\nsteps = {steps}\n\
         time_step = 1.0\ninitial_state = [{}]\n\
         noise = {{ initial = {identity}, process = {w}, measurement = {identity} }}\n\
         [[tasks.costs]]\nkind = \"quadratic\"\nQ = {q}\nR = {r}\n",
        if identity == "[[1.0]]" { "0.0" } else { "0.0, 0.0" }
    )
}

/// 500 stage costs of about 100 are summed, and the budget is 1e-10 of them: in 60 digits a sensor achieves 207.12851 bits.
#[test]
fn a_lower_bound_is_below_what_is_achieved_however_small_the_budget_is() {
    let task = "title = \"x\"\n[model]\nkind = \"linear\"\nA = [[0.9]]\nB = [[0.1]]\nC = [[1.0]]\n[[tasks]]\nname = \"t\"\n\
                steps = 500\ntime_step = 1.0\ninitial_state = [-99.0]\n\
                noise = { initial = [[1e-8]], process = [[1e-8]], measurement = [[1.0]] }\n\
                [[tasks.costs]]\nkind = \"state\"\nselect = [\"x1\"]\ntarget = [-100.0]\nweight = 1.0\n\
                [[tasks.costs]]\nkind = \"control\"\nweight = 0.01\n";
    let folder = Folder::with_task(task);
    let found = folder.run(&["bound", "task.toml", "--cost", "49458.690490613044", "--json"]).json(0);
    let lower = 500.0 * number(&found, "minimum_lower_bits_per_step");
    assert!(lower > 206.0 && lower <= 207.128_505_36, "{lower}");
    // The design costs more than D, if by little.
    let remarks = found["remarks"].to_string();
    assert!(!remarks.contains("because of rounding in its filter") && remarks.contains("own cost"), "{remarks}");
}

/// By 1e-7 of the budget less than measuring nothing costs: something must be measured, if hardly anything.
#[test]
fn a_cost_just_below_that_of_measuring_nothing_needs_a_sensor() {
    let folder = Folder::with_task(linear("[[1.0]]", "[[1.0]]", "[[1.0]]", "[[1.0]]", "[[1.0]]", 4));
    let all = folder.run(&["bound", "task.toml", "--cost", "1e9", "--json"]).json(0);
    let (least, open) = (number(&all, "minimum_cost"), number(&all, "open_loop_cost"));
    for share in [1e-3, 1e-5, 1e-7] {
        let cost = least + (open - least) * (1.0 - share);
        let found = folder.run(&["bound", "task.toml", "--cost", &format!("{cost:?}"), "--json"]).json(0);
        assert!(number(&found, "achieved_cost") <= cost * (1.0 + 1e-12), "{share}: {found}");
        let (lower, bits) = (number(&found, "minimum_lower_bits_per_step"), number(&found, "minimum_bits_per_step"));
        assert!(lower > 0.9 * bits && number(&found, "achieved_bits_per_step") >= lower, "{share}: {lower} {bits}");
        assert!(found["virtual_sensor"]["rank"].as_u64().unwrap() > 0, "{share}");
    }
}

/// An integrator that hardly costs anything: its cost without measurements grows for ever, and what is measured is little.
#[test]
fn texts_say_what_is_so() {
    let damped = linear(
        "[[1.0, 0.003], [0.0, 0.9985]]",
        "[[0.0], [0.003]]",
        "[[0.0, 0.0], [0.0, 3e-5]]",
        "[[0.003, 0.0], [0.0, 0.0]]",
        "[[3e-5]]",
        20,
    );
    let run = Folder::with_task(damped).run(&["bound", "task.toml", "--stationary", "--cost", "1.2076403"]);
    let (code, page) = run.quiet();
    assert!(code == Some(0) && !page.contains("without measurements.") && page.contains("unbounded"), "{page}");
    // A state that grows and never costs anything.
    let free = linear("[[1.1]]", "[[1.0]]", "[[1.0]]", "[[0.0]]", "[[1.0]]", 20);
    let found = Folder::with_task(free).run(&["bound", "task.toml", "--stationary", "--cost", "1", "--json"]).json(0);
    assert_eq!(number(&found, "open_loop_cost"), 0.0);
    // Costs of any size, and the least one itself.
    let walk = Folder::with_task(linear("[[1.0]]", "[[1.0]]", "[[1.0]]", "[[1.0]]", "[[1.0]]", 4));
    let least = number(&walk.run(&["bound", "task.toml", "--cost", "1e9", "--json"]).json(0), "minimum_cost");
    let error = walk.run(&["bound", "task.toml", "--cost", &format!("{least:?}")]);
    assert!(error.error().contains("no finite information achieves"), "{error:?}");
    let error = walk.run(&["bound", "task.toml", "--cost", &format!("{:?}", least.next_up())]);
    assert!(error.error().contains("is no more than rounding"), "{error:?}");
    let page = walk.run(&["bound", "task.toml", "--stationary", "--cost", "1e300"]);
    assert!(page.stdout.lines().chain(page.stderr.lines()).all(|line| line.len() < 250), "{page:?}");
}

/// A state that hardly couples to the cost needs 1e-9 bits or less, of which little is proved: that is said, and the exit
/// code says it too.
#[test]
fn a_minimum_far_above_what_is_proved_is_not_certified() {
    let weak = linear(
        "[[0.5, 0.0001], [0.0, 1.0]]",
        "[[1.0, 0.0], [0.0, 1.0]]",
        "[[1.0, 0.0], [0.0, 1.0]]",
        "[[1.0, 0.0], [0.0, 0.0]]",
        "[[1.0, 0.0], [0.0, 1.0]]",
        20,
    );
    let folder = Folder::with_task(weak);
    let mut last = f64::INFINITY;
    for (cost, code) in [("1.2", 0), ("2", 0), ("1133.9", 1)] {
        let found = folder.run(&["bound", "task.toml", "--stationary", "--cost", cost, "--json"]).json(code);
        let bits = number(&found, "minimum_bits_per_step");
        assert!(bits > 0.0 && bits < last, "{cost}: {bits} {last}");
        last = bits;
    }
    let run = folder.run(&["bound", "task.toml", "--stationary", "--cost", "1133.9"]);
    let (code, page) = run.quiet();
    assert!(code == Some(1) && page.contains("NOT ") && !page.contains("Certified"), "{page}");
}
