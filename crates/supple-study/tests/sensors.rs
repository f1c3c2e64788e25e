//! Studies of sensors: what docs/sensors.md says of the shipped tasks, and what is refused.
#![allow(clippy::unwrap_used, clippy::expect_used, missing_docs)]

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use supple::Stop;
use supple::design::{DesignSettings, DesignStatus};
use supple_study::sensors::{Search, SensorGoal, SensorMethod, SensorValue, Sensors, SensorsOptions, SetBy, run};
use supple_study::study::Work;
use supple_study::{Folder, LoadedTask, Made, Silent, StudyError, StudyResult, Watch};

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

fn task(name: &str) -> LoadedTask {
    LoadedTask::load(&repository("tasks").join(name)).unwrap()
}

fn study(name: &str, options: SensorsOptions) -> Result<Sensors, StudyError> {
    run(&task(name), &options, Watch::default())
}

/// Asserts that the page has the rows, side by side.
fn assert_rows(rows: &[String]) {
    let page = std::fs::read_to_string(repository("docs/sensors.md")).unwrap();
    assert!(page.contains(&rows.join("\n")), "docs/sensors.md lacks\n{}", rows.join("\n"));
}

#[test]
fn the_values_of_shipped_sensors_are_as_shown() {
    let found = study("two_mass.toml", SensorsOptions::default()).unwrap();
    let row = |sensor: &SensorValue| {
        let SensorValue { name, saved_alone, saved_beyond_others, bits_alone, bits_beyond_others, .. } = sensor;
        format!("| {name} | {saved_alone:.2} | {saved_beyond_others:.2} | {bits_alone:.2} | {bits_beyond_others:.2} |")
    };
    assert_rows(&found.sensors.iter().map(row).collect::<Vec<_>>());
    assert!(!found.catalogue && found.chosen.sensors.len() == 2 && found.tasks == ["press"]);

    let door = study("iiwa_door.toml", SensorsOptions { method: SensorMethod::Greedy, ..Default::default() }).unwrap();
    let mut sensors = door.sensors.clone();
    sensors.sort_by(|a, b| b.saved_alone.total_cmp(&a.saved_alone));
    let row =
        |sensor: &SensorValue| format!("| {} | {:.3} | {:.1} |", sensor.name, sensor.saved_alone, sensor.bits_alone);
    assert_rows(&sensors[..3].iter().map(row).collect::<Vec<_>>());
    let costs = [door.none.expected_cost, door.all.expected_cost].map(|cost| format!("{cost:.2}"));
    assert_eq!(costs, ["182.17", "178.75"]);
    assert!(door.best.is_none() && door.certificate.search.is_none());
}

/// Bits of one task alone were multiplied by its weight in the design's objective.
#[test]
fn bits_of_one_task_are_not_weighted() {
    let whole = study("two_mass.toml", SensorsOptions::default()).unwrap();
    let mut light = task("two_mass.toml");
    for weight in [0.1, 0.0] {
        light.problem.tasks[0].information_weight = weight;
        let found = run(&light, &SensorsOptions::default(), Watch::default()).unwrap();
        assert_eq!(found.all.information_bits, whole.all.information_bits);
        assert_eq!(found.sensors, whole.sensors);
    }
}

#[test]
fn without_prices_the_smallest_set_is_the_cheapest() {
    let asked = |cost| SensorsOptions { cost: Some(cost), task: Some("open".into()), ..Default::default() };
    let found = study("iiwa_door.toml", asked(92.5)).unwrap();
    let mut names = found.chosen.sensors.clone();
    names.sort();
    assert_eq!(names, ["v.iiwa_joint_2", "v.iiwa_joint_4"]);
    assert!(found.chosen.price == 2.0 && found.certificate.proved && found.chosen.expected_cost <= 92.5);
    // Where none is needed, none is chosen.
    let found = study("iiwa_door.toml", asked(95.0)).unwrap();
    assert!(found.chosen.sensors.is_empty() && found.chosen.price == 0.0);
    assert_eq!(found.certificate.certified_ratio, Some(1.0));
    // A budget limits nothing then, which is said.
    let found = study("two_mass.toml", SensorsOptions { budget: Some(1.0), ..Default::default() }).unwrap();
    assert_eq!((found.chosen.sensors.len(), found.remarks.len()), (2, 1));
    assert!(found.remarks[0].contains("the budget limits nothing"), "{}", found.remarks[0]);
}

#[test]
fn sets_of_the_catalogue_are_as_shown() {
    let file = "wiping_arm_sensors.toml";
    let of_budget = study(file, SensorsOptions { budget: Some(5.0), ..Default::default() }).unwrap();
    let of_cost = study(file, SensorsOptions { cost: Some(78.0), ..Default::default() }).unwrap();
    let row = |asked: &str, set: &supple_study::sensors::SensorSet, names: bool| {
        let mut sensors = if names { set.sensors.clone() } else { Vec::new() };
        sensors.sort();
        let (names, price) = (sensors.join(", "), set.price);
        format!("| {asked} | {names} | {price} | {:.3} | {:.2} |", set.expected_cost, set.information_bits)
    };
    assert_rows(&[
        row("budget 5", &of_budget.chosen, true),
        row("cost 78", &of_cost.chosen, true),
        row("all of them", &of_budget.all, false),
    ]);
    assert_eq!(format!("{:.3}", of_budget.certificate.bound), "77.403");
    let ratio = of_budget.certificate.certified_ratio.unwrap();
    assert!((0.936..0.937).contains(&ratio), "{ratio}");
    assert_eq!(of_budget.certificate.search, Some(Search::Exhaustive));
    assert!(of_budget.certificate.proved && of_budget.certificate.ratio == Some(1.0));
    assert!(of_cost.certificate.bound <= of_cost.chosen.price);
    // What is chosen is worth what the tables of its sensors say.
    let best = of_budget.best.as_ref().unwrap();
    assert_eq!(best.expected_cost, of_budget.chosen.expected_cost);
    for sensor in of_budget.sensors.iter().filter(|sensor| sensor.chosen) {
        assert!(sensor.saved_in_set > 0.0 && sensor.saved_alone >= sensor.saved_beyond_others, "{sensor:?}");
    }
}

#[test]
fn a_task_is_worth_the_same_with_its_chosen_sensors() {
    let task = task("wiping_arm_sensors.toml");
    let evaluated = task.problem.evaluate(&task.phi, &Default::default()).unwrap();
    let found = study("wiping_arm_sensors.toml", SensorsOptions { count: Some(10), ..Default::default() }).unwrap();
    assert!(found.chosen.expected_cost < evaluated.tasks[0].cost.expected);
    let own = study("wiping_arm.toml", SensorsOptions::default()).unwrap();
    assert!((own.all.expected_cost - evaluated.tasks[0].cost.expected).abs() < 1e-9 * own.all.expected_cost);
}

#[test]
fn a_result_survives_its_folder() {
    let task = task("wiping_arm_sensors.toml");
    let options = SensorsOptions { budget: Some(8.0), goal: SensorGoal::Information, ..Default::default() };
    let found = study("wiping_arm_sensors.toml", options.clone()).unwrap();
    assert!(found.certificate.bound >= found.chosen.information_bits * (1.0 - 1e-9));
    assert_ne!(found.greedy.as_ref().unwrap().by, SetBy::Search);
    let folder = std::env::temp_dir().join(format!("supple-sensors-{}", std::process::id()));
    let made = Made::of(&task, Work::Sensors(options));
    Folder::save(&folder, &made, &StudyResult::Sensors(Box::new(found.clone()))).unwrap();
    let read = Folder::load(&folder).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let StudyResult::Sensors(read) = read.result else { panic!("{:?}", read.result.kind()) };
    assert_eq!(*read, found);
}

#[test]
fn what_cannot_be_is_refused() {
    let refused = |options| study("wiping_arm_sensors.toml", options).unwrap_err().to_string();
    let default = SensorsOptions::default;
    let found = [
        refused(SensorsOptions { budget: Some(-1.0), ..default() }),
        refused(SensorsOptions { cost: Some(f64::NAN), ..default() }),
        refused(SensorsOptions { cost: Some(130.0), goal: SensorGoal::Information, ..default() }),
        refused(SensorsOptions { task: Some("wash".into()), ..default() }),
    ];
    let expected = [
        "the budget must be at least 0; found -1",
        "the bound on the expected cost must be at least 0; found NaN",
        "--cost selects the cheapest set and cannot be combined with --for information; remove one of them",
        "no task `wash`; valid: `wipe`",
    ];
    assert_eq!(found, expected);
    for method in [SensorMethod::Greedy, SensorMethod::Both] {
        let error = refused(SensorsOptions { cost: Some(70.0), method, ..default() });
        assert!(error.contains("an expected cost of at most 70; with all of them it is 77.0723"), "{error}");
    }
    let flag = AtomicBool::new(true);
    let stopped = Watch { progress: &Silent, stop: Stop::when(&flag) };
    let error = run(&task("wiping_arm_sensors.toml"), &default(), stopped).unwrap_err();
    assert!(matches!(error, StudyError::Stopped), "{error}");
}

#[test]
fn designs_at_a_price_are_as_shown() {
    let mut task = task("two_mass_sensors.toml");
    let short = |number: f64| if number < 0.1 { format!("{number:.2e}") } else { format!("{:.3}", number) };
    let mut multipliers = Vec::new();
    let rows = [(200.0, 0.0), (10.0, 0.0), (200.0, 2.0)].map(|(budget, price_weight)| {
        task.problem.design =
            DesignSettings { budget: Some(budget), price_weight, starts: 1, ..task.problem.design.clone() };
        let watch = Watch::default();
        let found = supple_study::design::run(&task, &task.problem.design, None, watch).unwrap();
        assert_eq!(found.status, DesignStatus::Converged);
        assert!(found.optimum.feasible);
        multipliers.push(found.budget_nats_per_unit / std::f64::consts::LN_2);
        let optimum = &found.optimum;
        let of = |name: &str| optimum.parameters.get(name).unwrap();
        let position = if of("position_variance") > 9.99 { "10".to_owned() } else { short(of("position_variance")) };
        let (force, price) = (of("force_variance"), optimum.price.as_ref().unwrap().total);
        let bits = optimum.objective.information_bits;
        format!("| {budget} | {price_weight} | {position} | {force:.2} | {price:.2} | {bits:.2} |")
    });
    assert_rows(&rows);
    assert_eq!(multipliers.iter().map(|bits| format!("{bits:.2}")).collect::<Vec<_>>(), ["0.00", "0.10", "0.00"]);
}
