//! Numbers that once were wrong, infinite or not told.

use serde_json::Value;

use crate::common::{Folder, TWO_MASS, edited};

const NOISE: &str = "process = [1e-7, 1e-2, 1e-7, 4e-2, 0.0]";

/// Whether all numbers are there that a result cannot be without; JSON has `null` for what is not a number.
fn are_finite(json: &Value) -> bool {
    const NUMBERS: [&str; 6] =
        ["information_nats", "total_nats", "expected", "nominal", "minimum_bits_per_step", "nats_per_unit"];
    match json {
        Value::Object(map) => map.iter().all(|(key, value)| {
            are_finite(value) && (!NUMBERS.contains(&key.as_str()) || value.is_number() || value.is_object())
        }),
        Value::Array(list) => list.iter().all(are_finite),
        _ => true,
    }
}

/// Exit 0 says that every number is one.
#[test]
fn an_infinite_noise_ended_as_an_optimum() {
    let mut failed = 0;
    for size in ["1e307", "1e300", "1e150"] {
        let noise = format!("process = [{size}, {size}, {size}, {size}, 0.0]");
        let text = edited(&edited(TWO_MASS, NOISE, &noise), "bound = 25.0\n", "");
        let folder = Folder::with_task(text);
        for command in
            [vec!["design", "--starts", "1"], vec!["evaluate"], vec!["trace", "--starts", "1"], vec!["bound"]]
        {
            let run = folder.run(&[&command[..], &["task.toml", "--json"]].concat());
            assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
            failed += usize::from(run.code != Some(0));
            if run.code == Some(0) {
                let json: Value = serde_json::from_str(&run.stdout).unwrap();
                assert!(are_finite(&json), "{command:?} {size}");
            }
        }
    }
    assert!(failed >= 4, "the cases are of use: {failed}");
}

/// The parser of TOML speaks of a mantissa.
#[test]
fn numbers_without_a_leading_zero_are_told() {
    let folder = Folder::with_task(edited(TWO_MASS, "bound = 25.0", "bound = .25"));
    let run = folder.run(&["evaluate", "task.toml"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("numbers begin with a digit: write `0.25` in place of `.25`"), "{}", run.stderr);
}

/// One state, two sensors of which one is a thousand times finer: ln 1e10 nats, of which 23.0232 were found.
#[test]
fn redundant_sensors_lost_their_digits() {
    let task = |first: f64, c: &str| {
        format!(
            "[model]\nkind = \"linear\"\nA = [[1.0]]\nB = [[1.0]]\nC = {c}\n[[tasks]]\nname = \"t\"\nsteps = 1\n\
             time_step = 1.0\ninitial_state = [0.0]\ninitial_control = [0.0]\n[tasks.noise]\ninitial = [{first:?}]\n\
             process = [0.0]\nmeasurement = [1e-12, 1e-12]\n[[tasks.costs]]\nkind = \"quadratic\"\nQ = [[1.0]]\n\
             R = [[1.0]]\nfinal = [[1.0]]\n"
        )
    };
    // Twice the same measurement: 1/2 ln (1 + 2 |C|^2 X0 / V), whether together or at two steps.
    for (first, c, precision) in
        [(1e2, "[[1e3], [1.0]]", 1e6 + 1.0), (1e4, "[[1e3], [1.0]]", 1e6 + 1.0), (1e6, "[[1.0], [1.0]]", 2.0)]
    {
        let run = Folder::with_task(task(first, c)).run(&["evaluate", "task.toml", "--rollouts", "8", "--json"]);
        assert!(run.code.is_some_and(|code| code < 2), "{run:?}");
        let found: Value = serde_json::from_str(&run.stdout).unwrap();
        let nats = found["tasks"][0]["information"]["total_nats"].as_f64().unwrap();
        let expected = 0.5 * (1.0 + 2.0 * precision * first / 1e-12f64).ln();
        assert!((nats - expected).abs() < 1e-8, "{first:?} {c}: {nats} for {expected}");
    }
}

#[test]
fn a_risk_sensitivity_without_effect_was_ignored() {
    for plan in ["belief", "nominal"] {
        let table = format!("[planning]\nplan = \"{plan}\"\nrisk_sensitivity = 0.1\n\n[[tasks]]\nname = \"press\"");
        let folder = Folder::with_task(edited(TWO_MASS, "[[tasks]]\nname = \"press\"", &table));
        let run = folder.run(&["evaluate", "task.toml"]);
        assert!(run.error().contains("is only valid with plan = \"risk\""), "{run:?}");
    }
}

#[test]
fn a_numeric_error_did_not_say_of_which_task() {
    let text = edited(TWO_MASS, "initial_state = [0.0, 0.0", "initial_state = [1e300, 0.0");
    let run = Folder::with_task(text).run(&["evaluate", "task.toml"]);
    assert!(run.error().contains("task `press`: the cost of the first guess is not finite"), "{run:?}");
}

#[test]
fn a_value_far_above_a_small_bound_was_at_it() {
    let problem = supple_file::parse(TWO_MASS, "task.toml").unwrap();
    let mut parameter = problem.parameters.get(0).clone();
    parameter.bounds = [0.1, 1e6];
    assert!(parameter.is_at(0.1, 0.1) && parameter.is_at(0.1, 0.1 + 1e-9) && !parameter.is_at(0.1, 0.2287));
    assert!(parameter.is_at(1e6, 1e6 - 1e-3) && !parameter.is_at(1e6, 0.2287));
    parameter.bounds = [0.0, 1.0];
    assert!(parameter.is_at(0.0, 1e-7) && !parameter.is_at(0.0, 1e-5));
}

#[test]
fn sizes_beyond_all_memory_are_refused() {
    let folder = Folder::with_task(TWO_MASS);
    let refused = |words: &[&str], message: &str| {
        let run = folder.run(&[words, &["task.toml"]].concat());
        assert!(run.code == Some(2) && run.stderr.contains(message), "{run:?}");
    };
    refused(&["evaluate", "--rollouts", "1000000000000000000"], "10000000");
    refused(&["evaluate", "--branches", "1000000000000000000"], "10000");
    refused(&["pareto", "--points", "1000000000000000000"], "10000");
}

/// A chain of joints, each with a link.
fn chain(joints: usize) -> String {
    let mut text = String::from("<robot name=\"chain\"><link name=\"l0\"/>");
    for i in 1..=joints {
        text += &format!(
            "<link name=\"l{i}\"><inertial><mass value=\"0.2\"/><inertia ixx=\"1e-4\" iyy=\"1e-4\" izz=\"1e-4\" \
             ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link><joint name=\"j{i}\" type=\"continuous\">\
             <parent link=\"l{}\"/><child link=\"l{i}\"/><origin xyz=\"0 0 0.1\"/><axis xyz=\"0 1 0\"/></joint>",
            i - 1
        );
    }
    text + "</robot>"
}

#[test]
fn five_hundred_joints_took_all_memory() {
    let folder = Folder::with_task(
        "[model]\nkind = \"robot\"\nfile = \"chain.urdf\"\n[[tasks]]\nname = \"t\"\nsteps = 5\ntime_step = 0.01\n",
    );
    std::fs::write(folder.path("chain.urdf"), chain(500)).unwrap();
    let run = folder.run(&["evaluate", "task.toml"]);
    let error = run.error();
    assert!(error.contains("500 moving joints, but at most 200") && error.contains("59 GB"), "{error}");
}
