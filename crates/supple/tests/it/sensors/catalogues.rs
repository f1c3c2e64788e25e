//! Catalogues of sensors in task files: what is measured where they are chosen, and what errors say.

use crate::common::{self, shipped};
use supple::Problem;
use supple::sensors::{Candidate, select};
use supple_file::{Files, ReadOptions, WithSensors};

/// The two masses with a catalogue.
fn with_catalogue(catalogue: &str) -> Result<Problem, supple::FileError> {
    with_catalogue_as(catalogue, WithSensors::All)
}

fn with_catalogue_as(catalogue: &str, which: WithSensors) -> Result<Problem, supple::FileError> {
    let path = common::repository("tasks/two_mass.toml");
    let text = std::fs::read_to_string(&path).unwrap() + catalogue;
    supple_file::parse_with(&text, path.to_str().unwrap(), which)
}

const ENCODERS: &str = r#"
[catalogue]
base = ["force in the spring"]
chosen = ["camera"]
[[catalogue.sensors]]
name = "encoder"
kind = "measurement"
select = ["position of m1"]
variance = 1e-4
price = 2
[[catalogue.sensors]]
name = "camera"
kind = "state"
select = ["x2", "xw"]
variance = [1e-5, "wall_variance"]
price = 8.5
[[catalogue.sensors]]
name = "foot"
kind = "signal"
select = ["contact_force"]
variance = 0.1
[[catalogue.sensors]]
name = "gap"
kind = "sum"
C = [[0.0, 0.0, "k1", 0.0, -1.0]]
variance = 1e-4
price = 1.0
"#;

#[test]
fn sensors_of_a_catalogue_are_measured_where_they_are_chosen() {
    let all = with_catalogue(ENCODERS).unwrap();
    let phi = all.parameters.initial();
    let names = |problem: &Problem| -> Vec<String> {
        problem.tasks[0].system.channels().measurements.into_iter().map(|channel| channel.name).collect()
    };
    assert_eq!(names(&all), ["force in the spring", "position of m1", "x2", "xw", "contact_force", "gap 1"]);
    let mut noise = supple::noise::Noise::zeros(5, 6);
    all.tasks[0].noise.resolve(&phi, &mut noise).unwrap();
    let variances: Vec<f64> = (0..6).map(|i| noise.measurement.get(0, i, i)).collect();
    assert_eq!(variances, [1e-2, 1e-4, 1e-5, 1e-4, 0.1, 1e-4], "the base sensor keeps the noise of the task");
    let catalogue = all.catalogue.as_ref().unwrap();
    let rows: Vec<_> = catalogue.iter().map(|sensor| (sensor.rows.clone(), sensor.price, sensor.chosen)).collect();
    assert_eq!(rows, [(vec![1], 2.0, false), (vec![2, 3], 8.5, true), (vec![4], 0.0, false), (vec![5], 1.0, false)]);

    let chosen = with_catalogue_as(ENCODERS, WithSensors::Chosen).unwrap();
    assert_eq!(names(&chosen), ["force in the spring", "x2", "xw"]);
    // One sensor of the catalogue has a set's worth, in the problem that it is chosen in as well.
    let candidates = catalogue.iter().map(|sensor| Candidate {
        name: sensor.name.clone(),
        price: sensor.price,
        rows: sensor.rows.clone(),
    });
    let selection = select(&all, &phi, candidates.collect(), None).unwrap().selection;
    let found = chosen.evaluate(&phi, &Default::default()).unwrap();
    let worth = selection.worth(&[false, true, false, false]);
    assert!((found.tasks[0].cost.expected - worth.cost).abs() < 1e-8 * worth.cost);
    assert!((found.objective.information_nats - worth.information).abs() < 1e-7 * worth.information);
    // Derivatives of added measurements, by the parameters too.
    let report = supple::check::check(&all, &phi).unwrap();
    assert!(report.passed);
}

#[test]
fn a_robot_may_have_all_its_sensors_from_a_catalogue() {
    let path = common::repository("tasks/wiping_arm.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once("[[model.sensors]]").unwrap();
    let after = rest.split_once("[parameters.k]").unwrap().1;
    let catalogue = r#"
[catalogue]
sensors = "sensors.csv"
"#;
    let table = "# prices in EUR\nname, kind, select, coupling, frame, variance, price\n\
        encoders, joint_position, shoulder;elbow, , , 1e-3, 40\n\n\
        wrist, coupling_force, , wrist_spring, , 1e-3, 90\n\
        camera, frame_point, , , pad, 1e-6; 1e-6; 1e-4, 250\n\
        wall, state, c.wall, , , 1e-6, 400\n";
    let file = format!("{before}[parameters.k]{after}{catalogue}");
    let folder = path.parent().unwrap().join("sensors.csv").display().to_string();
    let name = path.display().to_string();
    let read = |table: &str, which| {
        let files = Files::given([(folder.clone(), table.to_owned())]);
        supple_file::parse_with(&file, &name, ReadOptions { sensors: which, files, ..ReadOptions::default() })
    };
    let all = read(table, WithSensors::All).unwrap();
    assert_eq!(all.tasks[0].system.dimensions().measurements, 7);
    assert!(all.files.iter().any(|file| file.ends_with("sensors.csv")));
    let phi = all.parameters.initial();
    let candidates = all.catalogue.as_ref().unwrap().iter();
    let candidates = candidates.map(|s| Candidate { name: s.name.clone(), price: s.price, rows: s.rows.clone() });
    let selection = select(&all, &phi, candidates.collect(), None).unwrap().selection;
    let sensors = |sensors: &[&str]| -> Vec<bool> {
        selection.candidates.iter().map(|candidate| sensors.contains(&candidate.name.as_str())).collect()
    };
    // With the sensors of the shipped task it costs what that does.
    let shipped = shipped("wiping_arm.toml").evaluate(&phi, &Default::default()).unwrap();
    let worth = selection.worth(&sensors(&["encoders", "wrist"]));
    assert!((worth.cost - shipped.tasks[0].cost.expected).abs() < 1e-8 * worth.cost);
    // Without any the task still has a plan, and no information.
    let none = read(table, WithSensors::Chosen).unwrap();
    assert_eq!(none.tasks[0].system.dimensions().measurements, 0);
    let found = none.evaluate(&phi, &Default::default()).unwrap();
    assert_eq!(found.objective.information_nats, 0.0);
    assert!((found.tasks[0].cost.expected - selection.worth(&[false; 4]).cost).abs() < 1e-8 * worth.cost);
    // Any quantity may be a sensor, with the keys that it has.
    let more = "name, kind, contact, frame, axes, smoothing, lever, reference, variance\n\
        height, center_of_mass, , , y;x, , , , 1e-4\n\
        tactile, contact_force, wall, , , 0.1, , , 0.04\n\
        range, clearance, wall, , , , , , 1e-8\n\
        tracker, frame_pose, , pad, , , 0.1, 0;0;0.5, 1e-6\n";
    let found = read(more, WithSensors::All).unwrap();
    let measured: Vec<_> = found.tasks[0].system.channels().measurements.into_iter().take(4).collect();
    let named: Vec<String> = measured.iter().map(|channel| format!("{}, {}", channel.name, channel.unit)).collect();
    let expected = [
        "y of the centre of mass, m",
        "x of the centre of mass, m",
        "smoothed normal force of wall, N",
        "clearance of wall, m",
    ];
    assert_eq!(named, expected);
    assert_eq!(found.tasks[0].system.dimensions().measurements, 10);
    assert!(found.evaluate(&phi, &Default::default()).unwrap().objective.information_nats > 0.0);
    // Errors are those of the table, with its lines.
    let error = read(&table.replace("wrist_spring", "wrist_sprung"), WithSensors::Chosen).err().unwrap();
    assert!(error.file.ends_with("sensors.csv"), "{error}");
    assert_eq!((error.line, error.help.as_deref()), (5, Some("did you mean `wrist_spring`?")), "{error}");
    assert_eq!((error.key.as_str(), error.column), ("sensors[1].coupling", 26), "{error}");
    let error = read(&table.replace("pad, 1e-6; 1e-6; 1e-4", "pad, 1e-6; 1e-6"), WithSensors::Chosen).err().unwrap();
    assert_eq!(error.line, 6, "{error}");
    let error = read(&table.replace("1e-6, 400", "400"), WithSensors::Chosen).err().unwrap();
    assert!(error.line == 7 && error.message.contains("must have 7 cells"), "{error}");
    let error = read(&table.replace("1e-3, 90", "nan, 90"), WithSensors::Chosen).err().unwrap();
    assert!(error.line == 5 && error.message.contains("not a finite number"), "{error}");
    let error = read(&table.replace("1e-6, 400", "1e-6, inf"), WithSensors::Chosen).err().unwrap();
    assert!(error.line == 7 && error.message.contains("must be at least 0; found inf"), "{error}");
    // One that is not there is missed where the task names it.
    let error = supple_file::parse_with(&file, &name, WithSensors::Chosen).err().unwrap();
    assert!(error.file == name && error.key == "catalogue.sensors" && error.line > 0, "{error}");
    assert!(error.message.contains("sensors.csv: cannot be read"), "{error}");
}

/// The two masses with a table of sensors.
fn with_table(table: &str) -> Result<Problem, supple::FileError> {
    let path = common::repository("tasks/two_mass.toml");
    let text = std::fs::read_to_string(&path).unwrap() + "\n[catalogue]\nsensors = \"sensors.csv\"\n";
    let table = (path.with_file_name("sensors.csv").display().to_string(), table.to_owned());
    let options = ReadOptions { sensors: WithSensors::All, files: Files::given([table]), ..ReadOptions::default() };
    supple_file::parse_with(&text, path.to_str().unwrap(), options)
}

#[test]
fn cells_stand_for_what_is_asked_for() {
    let table = "name, kind, select, C, variance, price\n\
        7, state, x2; xw, , 1e-5; wall_variance, 3\n\
        \"gap, wide\", sum, , 0; 0; k1; 0; -1, 1e-4, 1.5\n\
        1e3, signal, contact_force, , 2, \n";
    let problem = with_table(table).unwrap();
    let phi = problem.parameters.initial();
    let sensors = problem.catalogue.as_ref().unwrap().iter();
    let sensors: Vec<_> = sensors.map(|sensor| (sensor.name.as_str(), sensor.rows.len(), sensor.price)).collect();
    assert_eq!(sensors, [("7", 2, 3.0), ("gap, wide", 1, 1.5), ("1e3", 1, 0.0)]);
    let mut noise = supple::noise::Noise::zeros(5, 6);
    problem.tasks[0].noise.resolve(&phi, &mut noise).unwrap();
    let variances: Vec<f64> = (2..6).map(|i| noise.measurement.get(0, i, i)).collect();
    assert_eq!(variances, [1e-5, 1e-4, 1e-4, 2.0]);
    let mut y = [0.0; 6];
    problem.tasks[0].system.observe(0, &[0.0, 0.0, 0.2, 0.0, 0.3], &phi, &mut y);
    assert_eq!([y[2], y[3]], [0.2, 0.3]);
    assert!((y[4] - (phi[0] * 0.2 - 0.3)).abs() < 1e-12, "the factor of x2 is the parameter k1: {}", y[4]);

    let wrong = |from: &str, to: &str| {
        let error = with_table(&table.replace(from, to)).err().unwrap();
        assert!(error.file.ends_with("sensors.csv"), "{error}");
        format!("{}:{}: {}: {}", error.line, error.column, error.key, error.message)
    };
    let found = [
        wrong("k1", "k9"),
        wrong("x2; xw", "x2; xv"),
        wrong("wall_variance", "-1"),
        wrong("1.5", "cheap"),
        wrong("-1, 1e-4", "-1; 0, 1e-4"),
        wrong("2, \n", ", 5\n"),
        wrong("state, x2; xw, ", "state, x2; xw, 1"),
    ];
    let expected = [
        "3:27: sensors[1].C[0][2]: parameter `k9` is not declared: add a table [parameters.k9], or use one of `k1`, `k2`, \
         `wall_variance`, `drive_variance`",
        "2:11: sensors[0].select: the model has no state `xv`: it has `x1`, `v1`, `x2`, `v2`, `xw`",
        "2:21: sensors[0].variance: must be above 0: sensor noise is required; found -1",
        "3:44: sensors[1].price: must be a number; found \"cheap\"",
        "3:21: sensors[1].C: must have one factor per state: 5; found 6",
        "4:1: sensors[2].variance: is missing",
        "2:19: sensors[0].C: unknown key `C`; valid: `select`, `name`, `price`, `variance`, `deviation`",
    ];
    assert_eq!(found, expected);
    let unknown = wrong("signal, contact_force", "signul, contact_force");
    assert!(
        unknown.starts_with("4:6: sensors[2].kind: must be one of `measurement`, `sum`, `center_of_mass`"),
        "{unknown}"
    );
    assert!(unknown.ends_with("found `signul`"), "{unknown}");
}

#[test]
fn errors_of_catalogues_say_what_is_valid() {
    let wrong = |from: &str, to: &str| {
        let error = with_catalogue(&ENCODERS.replace(from, to)).err().unwrap();
        (error.key.clone(), error.message.clone())
    };
    let found = [
        wrong("[\"camera\"]", "[\"cam\"]"),
        wrong("[\"camera\"]", "[\"camera\", \"camera\"]"),
        wrong("base = [\"force in the spring\"]", "base = [\"force\"]"),
        wrong("kind = \"signal\"", "kind = \"joint_position\""),
        wrong("price = 2", "price = -2"),
        wrong("\"foot\"", "\"gap\""),
        wrong("\"xw\"]", "\"xv\"]"),
        wrong("variance = 0.1", "variance = 0.0"),
        wrong("0.0, -1.0]]", "-1.0]]"),
        wrong("1e-5, \"wall_variance\"", "1e-5, 1e-5, 1e-5"),
        wrong("price = 8.5", "cost = 8.5"),
    ];
    let words: Vec<String> = found.iter().map(|(key, message)| format!("{key}: {message}")).collect();
    let expected = [
        "catalogue.chosen[0]: the catalogue has no sensor `cam`; valid: `encoder`, `camera`, `foot`, `gap`",
        "catalogue.chosen[1]: `camera` occurs twice",
        "catalogue.base[0]: the model has no measurement `force`: it has `position of m1`, `force in the spring`",
        "catalogue.sensors[2].kind: the model has no joints",
        "catalogue.sensors[0].price: must be at least 0; found -2",
        "catalogue.sensors[3].name: `gap` names two sensors",
        "catalogue.sensors[1].select: the model has no state `xv`: it has `x1`, `v1`, `x2`, `v2`, `xw`",
        "catalogue.sensors[2].variance: must be above 0: sensor noise is required; found 0",
        "catalogue.sensors[3].C: must have one factor per state: 5; found 4",
        "catalogue.sensors[1].variance: must be one number, or 2 of them, one for each entry; found 3",
        "catalogue.sensors[1].cost: unknown key `cost`; valid: `select`, `name`, `price`, `variance`, `deviation`",
    ];
    assert_eq!(words, expected);
}
