use serde_json::Value;
use supple_study::sweep::Sweep;
use supple_study::{Cell, StudyResult};

use crate::common::{Folder, edited, repository};
use crate::{GRID, sweep, tables, two_mass};

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn load(folder: &Folder) -> Sweep {
    match supple_study::Folder::load(&folder.path("out")).unwrap().result {
        StudyResult::Sweep(sweep) => *sweep,
        other => panic!("{other:?}"),
    }
}

#[test]
fn tables_are_the_same_on_any_number_of_threads_and_jobs() {
    let folder = two_mass();
    let mut all = Vec::new();
    for (out, option, count) in
        [("a", "--threads", "1"), ("b", "--jobs", "2"), ("c", "--threads", "8"), ("d", "--jobs", "3")]
    {
        let arguments = sweep(&[&GRID, &["--out", out, option, count][..]].concat());
        assert_eq!(folder.run(&arguments).code, Some(0));
        all.push(tables(&folder, out));
    }
    assert!(all.iter().all(|tables| *tables == all[0]));
    assert_eq!(all[0][0].iter().filter(|&&byte| byte == b'\n').count(), 201);
}

#[test]
fn json_has_one_object_per_point_in_the_order_of_the_grid() {
    let folder = two_mass();
    let run = folder.run(&sweep(&["--grid", "k2=200,300", "--grid", "k1=300:500:3", "--rollouts", "2", "--json"]));
    let (code, text) = run.quiet();
    assert_eq!(code, Some(0));
    let rows = lines(text);
    let points: Vec<[f64; 2]> = rows.iter().map(|row| ["k2", "k1"].map(|name| row[name].as_f64().unwrap())).collect();
    let expected = [[200.0, 300.0], [200.0, 400.0], [200.0, 500.0], [300.0, 300.0], [300.0, 400.0], [300.0, 500.0]];
    assert_eq!(points, expected);
    for row in &rows {
        let number = |name: &str| row[name].as_f64().unwrap();
        assert_eq!((row["press.status"].as_str(), &row["error"]), (Some("converged"), &Value::Null));
        assert_eq!((number("wall_variance"), number("feasible")), (1e-4, 1.0));
        let bits = number("information_nats") / std::f64::consts::LN_2;
        assert!((number("information_bits") - bits).abs() < 1e-9 && bits > 100.0);
        assert!((number("press.bits_per_second") - bits / 126.0 / 0.02).abs() < 1e-9);
        assert!(number("press.sampled_cost_mean") > 0.0 && number("press.sampled_cost_standard_error") > 0.0);
        assert!(number("press.expected_cost") > number("press.nominal_cost") && number("press.iterations") > 0.0);
    }
    assert_eq!(folder.names(), ["task.toml"]);
}

#[test]
fn a_folder_holds_the_table_and_comes_back() {
    let folder = two_mass();
    let arguments = ["--grid", "k1=300:500:3", "--grid", "k2=200,300", "--out", "out"];
    let run = folder.run(&sweep(&arguments));
    let (code, page) = run.quiet();
    assert_eq!(code, Some(0));
    for part in [
        "6 points, all evaluated.",
        "Least information among the 6 that are within all cost limits: ",
        "out/table.csv: the table",
    ] {
        assert!(page.contains(part), "{part} is not in\n{page}");
    }
    let sweep = load(&folder);
    assert!(sweep.complete && sweep.table.columns == sweep.columns);
    assert_eq!(sweep.table.rows.len(), 6);
    let csv = std::fs::read_to_string(folder.path("out/table.csv")).unwrap();
    assert_eq!(csv, sweep.table.to_csv());
    assert!(
        csv.starts_with("k1,k2,wall_variance,drive_variance,information_nats,information_bits,feasible,press.status,")
    );
    let unit = |name: &str| sweep.columns[sweep.table.column(name).unwrap()].unit.as_str();
    assert_eq!(["k1", "information_nats", "press.bits_per_second"].map(unit), ["N/m", "nat", "bit/s"]);
    let least = sweep.table.numbers("information_bits").unwrap().into_iter().fold(f64::INFINITY, f64::min);
    assert!(page.contains(&format!(": {least:.3} bits at k1 = 300 N/m, k2 = 200 N/m.")), "{least}: {page}");
}

#[test]
fn a_point_that_cannot_be_evaluated_says_why_and_the_others_stand() {
    let text = std::fs::read_to_string(repository("tasks/two_mass.toml")).unwrap();
    let text = edited(&text, "time_step = 0.02 ", "time_step = \"dt\" ");
    let parameter =
        "[parameters.dt]\ninitial = 0.02\nbounds = [0.001, 5000.0]\nunit = \"s\"\nrole = \"study\"\n\n[[tasks]]";
    let folder = Folder::with_task(edited(&text, "[[tasks]]", parameter));
    let run = folder.run(&sweep(&["--grid", "dt=0.02,2000,0.01", "--json"]));
    let (code, text) = run.quiet();
    assert_eq!(code, Some(0));
    let rows = lines(text);
    let error = rows[1]["error"].as_str().unwrap();
    assert!(error.starts_with("task `press`: ") && error.contains("is too large"), "{error}");
    assert_eq!((&rows[1]["information_nats"], &rows[1]["press.status"]), (&Value::Null, &Value::Null));
    assert_eq!(rows[1]["dt"], 2000.0);
    assert!([0, 2].iter().all(|&i: &usize| rows[i]["error"].is_null() && rows[i]["information_nats"].is_f64()));

    let page = folder.run(&sweep(&["--grid", "dt=0.02,2000", "--out", "out"]));
    assert_eq!(page.code, Some(0));
    assert!(page.stdout.contains("2 points; 1 could not be evaluated: see the column `error`."), "{}", page.stdout);
    let table = load(&folder).table;
    assert!(matches!(table.rows[1][table.column("error").unwrap()], Cell::Text(_)));
    let all = folder.run(&sweep(&["--grid", "dt=2000,3000"]));
    assert_eq!(all.code, Some(1), "{all:?}");
    assert!(all.stdout.contains("There is no information to compare."), "{}", all.stdout);
}

#[test]
fn the_page_shows_the_ends_of_a_long_table() {
    let folder = two_mass();
    let run = folder.run(&sweep(&["--grid", "k1=300:600:31"]));
    let (code, page) = run.quiet();
    assert_eq!(code, Some(0));
    assert!(page.contains("k2 = 500 N/m   wall_variance = 1.0000e-4 m^2   drive_variance = 0.005 m^2/s^2\n"), "{page}");
    let starts = |text: &str| page.lines().filter(|line| line.trim_start().starts_with(text)).count();
    assert_eq!(
        [starts("300 "), starts("440 "), starts(".."), starts("450 "), starts("560 "), starts("600 ")],
        [1, 1, 1, 0, 1, 1]
    );
}

/// `cargo test --release -p supple-cli --test sweep -- --ignored --nocapture`, on an idle machine.
#[test]
#[ignore = "takes all cores for about a quarter of a minute"]
fn a_hundred_by_a_hundred_points_take_less_than_a_minute() {
    let folder = two_mass();
    let clock = std::time::Instant::now();
    let run = folder.run(&sweep(&["--grid", "k1=50:600:100", "--grid", "k2=log:100:600:100", "--out", "out"]));
    let seconds = clock.elapsed().as_secs_f64();
    println!("10000 points in {seconds:.1} s");
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(seconds < 60.0);
}
