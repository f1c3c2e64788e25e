//! What the commands print and write, and the exit codes they end with.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, LINEAR, Run, TWO_MASS, edited, repository};
use serde_json::{Value, json};

/// Checks that `found` has the form of `form`: every key of its tables, and values of the same type as its own; the one
/// entry of a list or of a table with the key `*` stands for every entry.
fn assert_form(found: &Value, form: &Value, path: &str) {
    match (found, form) {
        (Value::Object(found), Value::Object(form)) => match form.get("*") {
            Some(entry) => found.iter().for_each(|(key, value)| assert_form(value, entry, &format!("{path}.{key}"))),
            None => {
                for (key, entry) in form {
                    let value = found.get(key).unwrap_or_else(|| panic!("{path}.{key} is missing"));
                    assert_form(value, entry, &format!("{path}.{key}"));
                }
            }
        },
        (Value::Array(found), Value::Array(form)) => {
            assert!(!found.is_empty(), "{path} is empty");
            found.iter().enumerate().for_each(|(i, value)| assert_form(value, &form[0], &format!("{path}[{i}]")));
        }
        (Value::Number(found), Value::Number(form)) => {
            assert!(!form.is_u64() || found.is_u64(), "{path} = {found} is no whole number");
        }
        (Value::String(_), Value::String(_)) | (Value::Bool(_), Value::Bool(_)) => {}
        _ => panic!("{path} = {found} has not the form of {form}"),
    }
}

/// What `supple evaluate` prints of a problem whose tasks have bounds.
fn evaluation_form() -> Value {
    json!({
        "parameters": { "*": 0.5 },
        "objective": { "information_nats": 0.5, "information_bits": 0.5 },
        "feasible": true,
        "tasks": [{
            "name": "",
            "status": "",
            "iterations": 1,
            "stationarity": 0.5,
            "cost": {
                "expected": 0.5, "nominal": 0.5, "belief": 0.5, "process": 0.5, "initial": 0.5, "bound": 0.5
            },
            "information": {
                "total_nats": 0.5, "total_bits": 0.5, "bits_per_step": 0.5, "bits_per_second": 0.5,
                "paper_form_nats": 0.5, "per_step_nats": [0.5]
            }
        }]
    })
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn assert_close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-12 * (1.0 + a.abs()), "{a} and {b}");
}

/// A shipped task, edited.
fn two_mass(from: &str, to: &str) -> Folder {
    Folder::with_task(edited(TWO_MASS, from, to))
}

// evaluate

#[test]
fn evaluate_prints_one_object_of_the_published_form() {
    let folder = Folder::with_task(TWO_MASS);
    let arguments = ["evaluate", "task.toml", "--json", "--gradient", "both", "--rollouts", "20", "--seed", "3"];
    let found = folder.run(&arguments).json(0);
    let gradient = json!({ "k1": 0.5, "k2": 0.5 });
    let mut form = evaluation_form();
    form["tasks"][0]["gradient"] = json!({
        "total": {
            "information_nats": gradient, "expected_cost": gradient, "nominal_cost": gradient,
            "belief_cost": gradient, "process_cost": gradient, "initial_cost": gradient
        },
        "frozen": { "information_nats": gradient, "belief_cost": gradient }
    });
    form["tasks"][0]["monte_carlo"] = json!({ "rollouts": 20, "cost_mean": 0.5, "cost_standard_error": 0.5 });
    assert_form(&found, &form, "");
    assert_eq!(keys(&found), ["feasible", "objective", "parameters", "tasks"]);
    assert_eq!(keys(&found["parameters"]), ["k1", "k2"]);
    assert_eq!(found["tasks"][0]["status"], "converged");
    assert_eq!(found["tasks"][0]["monte_carlo"]["rollouts"], 20);

    let (cost, information) = (&found["tasks"][0]["cost"], &found["tasks"][0]["information"]);
    let parts = ["nominal", "belief", "process", "initial"].map(|part| number(&cost[part]));
    assert_close(number(&cost["expected"]), parts.iter().sum());
    let per_step = information["per_step_nats"].as_array().unwrap();
    assert_eq!(per_step.len(), 126);
    assert_close(number(&information["total_nats"]), per_step.iter().map(number).sum());
    let bits = number(&information["total_nats"]) / std::f64::consts::LN_2;
    assert_close(number(&information["total_bits"]), bits);
    assert_close(number(&information["bits_per_step"]), bits / 126.0);
    assert_close(number(&information["bits_per_second"]), bits / 126.0 / 0.02);
    assert_close(number(&found["objective"]["information_bits"]), bits);
    assert_eq!(folder.names(), ["task.toml"]);
}

#[test]
fn evaluate_prints_what_was_asked_for_and_no_more() {
    let folder = Folder::with_task(TWO_MASS);
    let task =
        |more: &[&str]| folder.run(&[&["evaluate", "task.toml", "--json"], more].concat()).json(0)["tasks"][0].clone();
    let plain = task(&[]);
    assert_eq!((plain.get("gradient"), plain.get("monte_carlo")), (None, None));
    assert_eq!(keys(&task(&["--gradient", "total"])["gradient"]), ["total"]);
    assert_eq!(keys(&task(&["--gradient", "frozen"])["gradient"]), ["frozen"]);
    assert_eq!(keys(&task(&["--gradient", "both"])["gradient"]), ["frozen", "total"]);
    assert_eq!(task(&["--gradient", "none"]), plain);
    let sampled = task(&["--rollouts", "1"]);
    assert_eq!(sampled["monte_carlo"]["cost_standard_error"], Value::Null);
}

#[test]
fn evaluate_prints_a_page_for_people() {
    let run = Folder::with_task(TWO_MASS).run(&["evaluate", "task.toml"]);
    let (code, page) = run.quiet();
    assert_eq!(code, Some(0));
    for part in ["Two small masses", "k1 = 60 N/m", "press: converged", "bits/s", "meets the bound 25"] {
        assert!(page.contains(part), "{part} is not in\n{page}");
    }
}

#[test]
fn set_changes_parameters_of_either_role() {
    let folder = Folder::with_task(LINEAR);
    let page = folder.run(&["evaluate", "task.toml"]).stdout;
    assert!(page.contains("stiffness = -0.2    gain = 0.1 m/(N s)   sensor-noise = 0.1    allowance = 50"), "{page}");
    let run = |more: &[&str]| folder.run(&[&["evaluate", "task.toml", "--json"], more].concat()).json(0);
    let found = run(&["--set", "gain=0.5", "--set=allowance=60", "--set", " sensor-noise = 2e-1 "]);
    let expected = json!({ "stiffness": -0.2, "gain": 0.5, "sensor-noise": 0.2, "allowance": 60.0 });
    assert_eq!(found["parameters"], expected);
    assert_eq!(found["tasks"][0]["cost"]["bound"], 60.0);
    assert_ne!(found["tasks"][0]["information"], run(&[])["tasks"][0]["information"]);
    assert_eq!(run(&["--set", "gain=0.3", "--set", "gain=0.5"])["parameters"]["gain"], 0.5, "the last one holds");
}

#[test]
fn a_missed_bound_is_a_shortfall_and_says_by_how_much() {
    let folder = two_mass("bound = 25.0", "bound = 20.0");
    let run = folder.run(&["evaluate", "task.toml"]);
    assert_eq!(run.quiet().0, Some(1));
    assert!(run.stdout.contains("misses the bound 20 by 0.29"), "{}", run.stdout);
    let found = folder.run(&["evaluate", "task.toml", "--json"]).json(1);
    assert_eq!((&found["feasible"], &found["tasks"][0]["status"]), (&json!(false), &json!("converged")));
    let none = two_mass("bound = 25.0", "bound = 0").run(&["evaluate", "task.toml"]);
    assert_eq!(none.quiet().0, Some(1));
    assert!(none.stdout.contains("misses the bound 0 by 20.29") && !none.stdout.contains('%'), "{}", none.stdout);
}

#[test]
fn a_plan_that_does_not_converge_is_a_shortfall() {
    let folder = two_mass("title =", "planning.max_iterations = 2\ntitle =");
    let found = folder.run(&["evaluate", "task.toml", "--json"]).json(1);
    assert_eq!((&found["feasible"], &found["tasks"][0]["status"]), (&json!(false), &json!("max_iterations")));
    let run = folder.run(&["evaluate", "task.toml"]);
    assert_eq!(run.quiet().0, Some(1));
    assert!(run.stdout.contains("max_iterations"), "{}", run.stdout);
}

#[test]
fn files_of_every_form_are_read() {
    let evaluate = |text: &str| Folder::with_task(text).run(&["evaluate", "task.toml", "--json"]).json(0);
    let plain = evaluate(TWO_MASS);
    assert_eq!(evaluate(&TWO_MASS.replace('\n', "\r\n")), plain, "lines that end in CR LF");
    assert_eq!(evaluate(&format!("\u{feff}{TWO_MASS}")), plain, "a byte order mark");
    assert_eq!(evaluate(&edited(TWO_MASS, "= 25.0", "= 25")), plain, "a whole number");
    assert_eq!(evaluate(&edited(TWO_MASS, "[10.0]", "[[10.0]]")), plain, "one row of controls");
    let renamed = TWO_MASS.replace("[parameters.k1]", "[parameters.'k-\u{e4}.1']").replace("\"k1\"", "\"k-\u{e4}.1\"");
    let renamed = evaluate(&renamed);
    assert_eq!(keys(&renamed["parameters"]), ["k-\u{e4}.1", "k2"]);
    assert_eq!(renamed["tasks"], plain["tasks"], "names in any script");
    let full = edited(TWO_MASS, "[5e-3, 5e-2]", "[[5e-3, 0.0], [0.0, 5e-2]]");
    assert_eq!(evaluate(&full)["tasks"][0]["cost"], plain["tasks"][0]["cost"], "a full covariance");
    let free = evaluate(&edited(TWO_MASS, "bound = 25.0", ""));
    assert_eq!((&free["feasible"], &free["tasks"][0]["cost"]["bound"]), (&json!(true), &Value::Null), "no bound");
}

#[test]
fn a_problem_needs_no_parameters() {
    let (before, rest) = TWO_MASS.split_once("[parameters.k1]").unwrap();
    let (_, after) = rest.split_once("[[tasks]]").unwrap();
    let text = edited(&format!("{before}[[tasks]]{after}"), "[\"k1\", \"k2\"]", "[60, 30]");
    let folder = Folder::with_task(text);
    let found = folder.run(&["evaluate", "task.toml", "--json", "--gradient", "total"]).json(0);
    assert_eq!(found["parameters"], json!({}));
    let plain = Folder::with_task(TWO_MASS).run(&["evaluate", "task.toml", "--json"]).json(0);
    assert_eq!(found["tasks"][0]["cost"], plain["tasks"][0]["cost"]);
    assert!(folder.run(&["design", "task.toml"]).error().contains("nothing to design"));
}

#[test]
fn controls_may_be_given_per_step() {
    let rows = vec!["[10.0]"; 125].join(", ");
    let flat = vec!["10.0"; 125].join(", ");
    let evaluate = |guess: &str| {
        let folder = two_mass("initial_control = [10.0]", &format!("initial_control = [{guess}]"));
        folder.run(&["evaluate", "task.toml", "--json"]).json(0)
    };
    assert_eq!(evaluate(&rows), evaluate(&flat));
}

#[test]
fn tasks_share_parameters_and_add_up() {
    let found = Folder::with_task(LINEAR).run(&["evaluate", "task.toml", "--json", "--gradient", "total"]).json(0);
    let tasks = found["tasks"].as_array().unwrap();
    let nats = |task: usize| number(&tasks[task]["information"]["total_nats"]);
    assert_eq!((tasks.len(), &tasks[0]["name"], &tasks[1]["name"]), (2, &json!("reach"), &json!("hold")));
    assert_close(number(&found["objective"]["information_nats"]), nats(0) + 2.0 * nats(1));
    assert_eq!(number(&tasks[0]["gradient"]["total"]["expected_cost"]["allowance"]), 0.0);
}

/// Equal eigenvalues kept an eigenvalue iteration from ending.
#[test]
fn many_equal_states_have_a_frozen_gradient() {
    let row = |i: usize| (0..8).map(|j| if i == j { "0.9" } else { "0.000125" }).collect::<Vec<_>>().join(", ");
    let rows: Vec<_> = (0..8).map(|i| format!("[{}]", row(i))).collect();
    let all = |value: &str| [value; 8].join(", ");
    let text = format!(
        "model = {{ kind = \"linear\", A = [{}], B = [{}], C = [[{}]] }}\n[[tasks]]\nname = \"rest\"\nsteps = 10\n\
         time_step = 0.1\ninitial_state = [{}]\ninitial_control = [0.0]\n\
         noise = {{ initial = [{}], process = [{}], measurement = [0.1] }}\n\
         costs = [{{ kind = \"state\", select = [\"x1\", \"x8\"], weight = 1 }}, {{ kind = \"control\", weight = 0.1 }}]\n",
        rows.join(", "),
        all("[1.0]"),
        all("1.0"),
        all("1.0"),
        all("0.1"),
        all("0.01")
    );
    let folder = Folder::with_task(text);
    let found = folder.run(&["evaluate", "task.toml", "--gradient", "frozen", "--json"]).json(0);
    let radius = number(&found["tasks"][0]["gradient"]["frozen"]["recursion_spectral_radius"]);
    assert!((0.9..1.0).contains(&radius), "{radius}");
}

// design

#[test]
fn design_prints_one_object_of_the_published_form() {
    let folder = Folder::with_task(TWO_MASS);
    let found = folder.run(&["design", "task.toml", "--starts", "2", "--seed", "5", "--json"]).json(0);
    let form = json!({
        "status": "",
        "start": evaluation_form(),
        "optimum": evaluation_form(),
        "starts": [{ "status": "", "from": { "*": 0.5 }, "to": { "*": 0.5 }, "information_nats": 0.5 }],
        "evaluations": 1,
        "seconds": 0.5
    });
    assert_form(&found, &form, "");
    assert_eq!((&found["status"], &found["seed"]), (&json!("converged"), &json!(5)));
    let starts = found["starts"].as_array().unwrap();
    assert_eq!(starts.len(), 2);
    let effort: u64 = starts.iter().map(|start| start["evaluations"].as_u64().unwrap()).sum();
    assert_eq!(found["evaluations"], effort);
    assert_eq!(found["start"]["parameters"], json!({ "k1": 60.0, "k2": 30.0 }));
    let nats = |side: &str| number(&found[side]["objective"]["information_nats"]);
    assert!(nats("optimum") < nats("start"));
    assert!(number(&found["optimum"]["tasks"][0]["cost"]["expected"]) <= 25.0 * (1.0 + 1e-6));
    assert_eq!(folder.names(), ["task.toml"]);
}

#[test]
fn design_prints_a_page_for_people() {
    let run = Folder::with_task(TWO_MASS).run(&["design", "task.toml", "--starts", "1", "--set", "k2=20"]);
    let (code, page) = run.quiet();
    assert_eq!(code, Some(0));
    for part in ["k1", "k2", "information, bits", "information, bits/s", "cost of press", "seed 0"] {
        assert!(page.contains(part), "{part} is not in\n{page}");
    }
}

#[test]
fn design_takes_every_method_and_gradient() {
    let folder = Folder::with_task(TWO_MASS);
    for (method, gradient) in [("sqp", "total"), ("sqp", "frozen"), ("barrier", "total"), ("barrier", "frozen")] {
        let arguments = ["design", "task.toml", "--starts", "1", "--json", "--method", method, "--gradient", gradient];
        let run = folder.run(&arguments);
        let code = run.code.filter(|code| [0, 1].contains(code)).unwrap();
        let found = run.json(code);
        assert_eq!((&found["method"], &found["gradient"]), (&json!(method), &json!(gradient)));
        assert_eq!(code == 0, found["status"] == "converged");
    }
}

#[test]
fn a_design_that_cannot_meet_its_bound_is_a_shortfall_and_says_by_how_much() {
    let folder = two_mass("bound = 25.0", "bound = 5.0");
    let run = folder.run(&["design", "task.toml", "--starts", "1"]);
    assert_eq!(run.quiet().0, Some(1));
    assert!(run.stdout.contains("The closest misses the bound of press by 4.6"), "{}", run.stdout);
    let found = folder.run(&["design", "task.toml", "--starts", "1", "--json", "--out", "out"]).json(1);
    assert_eq!((&found["status"], &found["optimum"]["feasible"]), (&json!("bound_violated"), &json!(false)));
    assert!(number(&found["starts"][0]["violation"]) > 0.0);
    assert!(folder.path("out/result.json").exists(), "it was computed, so it is written");
}

#[test]
fn a_design_whose_plans_do_not_converge_says_so() {
    let run =
        two_mass("title =", "planning.tolerance = 1e-300\ntitle =").run(&["design", "task.toml", "--starts", "1"]);
    assert_eq!(run.quiet().0, Some(1));
    assert!(run.stdout.contains("a plan of press that ended as line_search_stalled"), "{}", run.stdout);
}

#[test]
fn out_writes_a_result_with_all_that_made_it() {
    let folder = Folder::with_task(TWO_MASS);
    std::fs::create_dir(folder.path("out")).unwrap();
    std::fs::write(folder.path("out/result.json"), "old").unwrap();
    let arguments = ["design", "task.toml", "--starts", "1", "--seed", "7", "--set", "k1=50", "--out", "out", "--json"];
    let printed = folder.run(&arguments).json(0);
    let file: Value = serde_json::from_slice(&std::fs::read(folder.path("out/result.json")).unwrap()).unwrap();
    assert_eq!(file["result"], printed);
    assert_eq!(file["sources"], json!([{ "path": "task.toml", "text": TWO_MASS }]));
    assert_eq!((&file["kind"], &file["command"], &file["seed"]), (&json!("design"), &json!("design"), &json!(7)));
    assert_eq!(file["supple"], env!("CARGO_PKG_VERSION"));
    assert_eq!(file["arguments"], json!(arguments));
    let settings = &file["result"]["settings"];
    assert_eq!((&settings["seed"], &settings["starts"]), (&json!(7), &json!(1)));
    assert_eq!(std::fs::read_dir(folder.path("out")).unwrap().count(), 1, "nothing else is left in the folder");
    assert_eq!(folder.names(), ["out", "task.toml"]);
}

#[test]
fn out_makes_its_folders() {
    let folder = Folder::with_task(TWO_MASS);
    let run = folder.run(&["design", "task.toml", "--starts", "1", "--out", "a/b"]);
    assert_eq!(run.quiet().0, Some(0));
    assert!(folder.path("a/b/result.json").exists());
}

#[cfg(unix)]
#[test]
fn a_result_is_readable_for_others_as_any_file() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::with_task(TWO_MASS);
    assert_eq!(folder.run(&["design", "task.toml", "--starts", "1", "--out", "."]).code, Some(0));
    let mode = |name: &str| std::fs::metadata(folder.path(name)).unwrap().permissions().mode();
    assert_eq!(mode("result.json"), mode("task.toml"));
}

#[cfg(unix)]
#[test]
fn a_result_knows_a_task_that_can_be_read_once_only() {
    let folder = Folder::with_task(TWO_MASS);
    let mut command = assert_cmd::Command::new(env!("CARGO_BIN_EXE_supple"));
    command.args(["design", "/dev/stdin", "--starts", "1", "--out"]).arg(folder.path("out")).write_stdin(TWO_MASS);
    assert_eq!(Run::of(&command.output().unwrap()).quiet().0, Some(0));
    let file: Value = serde_json::from_slice(&std::fs::read(folder.path("out/result.json")).unwrap()).unwrap();
    assert_eq!(file["sources"][0]["text"], TWO_MASS);
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_whose_name_is_no_text_is_no_panic() {
    use std::os::unix::ffi::OsStrExt;
    let folder = Folder::with_task(TWO_MASS);
    let name = std::ffi::OsStr::from_bytes(b"out-\xff");
    let mut command = assert_cmd::Command::new(env!("CARGO_BIN_EXE_supple"));
    command.args(["design", "task.toml", "--starts", "1", "--out"]).arg(name).current_dir(folder.path(""));
    assert_eq!(Run::of(&command.output().unwrap()).quiet().0, Some(0));
    assert!(folder.path("").join(name).join("result.json").exists());
}

// the same bits

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let folder = Folder::with_task(TWO_MASS);
    let evaluate = |threads: &str, seed: &str| {
        let arguments =
            ["evaluate", "task.toml", "--json", "--gradient", "both", "--rollouts", "300", "--branches", "8"];
        folder.run(&[&arguments[..], &["--threads", threads, "--seed", seed]].concat()).json(0)
    };
    assert_eq!(evaluate("1", "1"), evaluate("8", "1"));
    assert_eq!(evaluate("8", "1"), evaluate("8", "1"));
    assert_ne!(evaluate("8", "1"), evaluate("8", "2"));
    let design = |threads: &str, seed: &str| {
        let arguments = ["design", "task.toml", "--json", "--starts", "3", "--threads", threads, "--seed", seed];
        let mut found = folder.run(&arguments).json(0);
        found.as_object_mut().unwrap().remove("seconds");
        found
    };
    assert_eq!(design("1", "1"), design("8", "1"));
    assert_ne!(design("8", "1")["starts"][1]["from"], design("8", "2")["starts"][1]["from"]);
}

// check, schema, new, completions, version

#[test]
fn check_compares_derivatives() {
    let folder = Folder::with_task(LINEAR);
    let found = folder.run(&["check", "task.toml", "--json"]).json(0);
    assert_eq!(found["passed"], true);
    assert_eq!(found["tasks"].as_array().unwrap().len(), 2);
    let run = folder.run(&["check", "task.toml", "--set", "gain=0.5"]);
    assert_eq!(run.quiet().0, Some(0));
    assert!(run.stdout.contains("All derivatives agree."));
}

/// What in a value is not as a schema says. Knows the keywords that the published schema uses, and no others.
fn violations(schema: &Value, value: &Value, root: &Value, path: &str) -> Vec<String> {
    let Some(keywords) = schema.as_object() else { return Vec::new() };
    let each = |schema: &Value, value: &Value, at: String| violations(schema, value, root, &at);
    let fits = |schema: &&Value| violations(schema, value, root, path).is_empty();
    let wrong = |what: String| vec![format!("{path}: {what}")];
    let broken = |holds: bool, what: String| if holds { Vec::new() } else { wrong(what) };
    let list = value.as_array().map(Vec::as_slice).unwrap_or_default();
    let empty = serde_json::Map::new();
    let table = value.as_object().unwrap_or(&empty);
    let check = |(keyword, argument): (&String, &Value)| match keyword.as_str() {
        "$schema" | "$defs" | "title" | "description" | "default" | "format" => Vec::new(),
        "$ref" => each(root.pointer(&argument.as_str().unwrap()[1..]).unwrap(), value, path.to_owned()),
        "anyOf" => broken(argument.as_array().unwrap().iter().any(|schema| fits(&schema)), "fits none".into()),
        "oneOf" => {
            let count = argument.as_array().unwrap().iter().filter(fits).count();
            broken(count == 1, format!("fits {count} and not one"))
        }
        "enum" => broken(argument.as_array().unwrap().contains(value), format!("is none of {argument}")),
        "const" => broken(value == argument, format!("is not {argument}")),
        "type" => {
            let name = match value {
                Value::Number(number) if number.is_f64() => &["number"][..],
                Value::Number(_) => &["number", "integer"],
                Value::String(_) => &["string"],
                Value::Bool(_) => &["boolean"],
                Value::Array(_) => &["array"],
                Value::Object(_) => &["object"],
                Value::Null => &["null"],
            };
            let fits = |argument: &Value| name.contains(&argument.as_str().unwrap());
            broken(
                argument.as_array().map_or_else(|| fits(argument), |list| list.iter().any(fits)),
                format!("is no {argument}"),
            )
        }
        "minimum" => broken(value.as_f64().is_none_or(|number| number >= argument.as_f64().unwrap()), "too low".into()),
        "maximum" => {
            broken(value.as_f64().is_none_or(|number| number <= argument.as_f64().unwrap()), "too high".into())
        }
        "minLength" => {
            broken(value.as_str().is_none_or(|text| text.len() as u64 >= argument.as_u64().unwrap()), "short".into())
        }
        "minItems" => broken(!value.is_array() || list.len() as u64 >= argument.as_u64().unwrap(), "too few".into()),
        "maxItems" => broken(!value.is_array() || list.len() as u64 <= argument.as_u64().unwrap(), "too many".into()),
        "items" => {
            list.iter().enumerate().flat_map(|(i, value)| each(argument, value, format!("{path}[{i}]"))).collect()
        }
        "required" => {
            let missing = |key: &&Value| value.is_object() && !table.contains_key(key.as_str().unwrap());
            argument
                .as_array()
                .unwrap()
                .iter()
                .filter(missing)
                .flat_map(|key| wrong(format!("{key} is missing")))
                .collect()
        }
        "properties" => {
            let known =
                table.iter().filter_map(|(key, value)| Some((argument.get(key)?, value, format!("{path}.{key}"))));
            known.flat_map(|(schema, value, at)| each(schema, value, at)).collect()
        }
        "additionalProperties" => {
            let unknown = table.iter().filter(|(key, _)| schema["properties"].get(key).is_none());
            let one = |(key, value): (&String, &Value)| match argument {
                Value::Bool(false) => wrong(format!("{key} is unknown")),
                schema => each(schema, value, format!("{path}.{key}")),
            };
            unknown.flat_map(one).collect()
        }
        other => panic!("the keyword `{other}` of the schema is not known here"),
    };
    keywords.iter().flat_map(check).collect()
}

#[test]
fn the_schema_accepts_good_files_and_refuses_bad_ones() {
    let schema = Folder::new().run(&["schema"]).json(0);
    let violations = |text: &str| violations(&schema, &toml::from_str(text).unwrap(), &schema, "");
    let shipped = std::fs::read_dir(repository("tasks")).unwrap().map(|entry| entry.unwrap().path());
    let mut shipped: Vec<_> = shipped.filter(|path| path.extension().is_some_and(|end| end == "toml")).collect();
    shipped.push(repository("crates/supple-cli/templates/new.toml"));
    assert!(shipped.len() >= 3);
    for path in shipped {
        assert_eq!(violations(&std::fs::read_to_string(&path).unwrap()), [""; 0], "{}", path.display());
    }
    assert_eq!(violations(LINEAR), [""; 0]);
    let settings = "planning = { plan = \"sampled\", sampled = { iterations = 5, averaging = 0.5 }, newton = false }\n\
                    design = { method = \"barrier\", gradient = \"frozen\", starts = 3, seed = 1 }\n";
    assert_eq!(violations(&format!("{settings}{TWO_MASS}")), [""; 0]);
    let edits = [
        (TWO_MASS, "title =", "tittle ="),
        (TWO_MASS, "steps = 125", "steps = 0"),
        (TWO_MASS, "steps = 125", "steps = 1_000_001"),
        (TWO_MASS, "steps = 125", "steps = 12.5"),
        (TWO_MASS, "mass = [0.2, 0.11]", "mass = [0.2, 0.11, 0.3]"),
        (TWO_MASS, "mass = [0.2, 0.11]", ""),
        (TWO_MASS, "kind = \"two_mass\"", "kind = \"three_mass\""),
        (TWO_MASS, "scale = \"log\"", "scale = \"logarithmic\""),
        (TWO_MASS, "initial = 60.0", "initial = \"k2\""),
        (TWO_MASS, "time_step = 0.02", "time_step = \"\""),
        (TWO_MASS, "target = 3.0", "targets = 3.0"),
        (TWO_MASS, "measurement = [5e-3, 5e-2]", "measurement = [5e-3, [5e-2]]"),
        (LINEAR, "norm = \"quadratic\"", "norm = \"absolute\""),
        (LINEAR, "R = [[\"gain\"]]", "R = [\"gain\"]"),
    ];
    for (text, from, to) in edits {
        let bad = edited(text, from, to);
        assert!(!violations(&bad).is_empty(), "the schema accepts {to}");
        Folder::with_task(bad).run(&["evaluate", "task.toml"]).error();
    }
}

#[test]
fn new_writes_a_file_that_runs_and_is_never_written_over() {
    let folder = Folder::new();
    let run = folder.run(&["new", "grasp \"1\" \\ \u{1f600}\n"]);
    assert_eq!(run.quiet().0, Some(0));
    assert_eq!(folder.run(&["new", "press.toml"]).quiet().0, Some(0));
    assert_eq!(folder.names(), ["grasp \"1\" \\ \u{1f600}\n.toml", "press.toml"]);
    let text = std::fs::read_to_string(folder.path("press.toml")).unwrap();
    assert!(text.contains("title = \"press\""));
    for name in folder.names() {
        assert_eq!(folder.run(&["evaluate", &name]).quiet().0, Some(0));
    }
    std::fs::write(folder.path("press.toml"), "mine").unwrap();
    assert!(folder.run(&["new", "press"]).error().contains("press.toml exists already"));
    assert_eq!(std::fs::read_to_string(folder.path("press.toml")).unwrap(), "mine");
    assert_eq!(folder.names().len(), 2);
}

#[test]
fn the_new_file_can_be_designed() {
    let folder = Folder::new();
    folder.run(&["new", "press"]);
    assert_eq!(folder.run(&["design", "press.toml", "--starts", "1", "--json"]).json(0)["status"], "converged");
}

#[test]
fn completions_know_every_command() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let run = Folder::new().run(&["completions", shell]);
        let (code, script) = run.quiet();
        assert_eq!(code, Some(0));
        for command in ["design", "evaluate", "check", "schema", "new", "completions"] {
            assert!(script.contains(command), "{shell} does not know {command}");
        }
    }
}

#[test]
fn version_and_help() {
    let folder = Folder::new();
    assert_eq!(folder.run(&["--version"]).quiet(), (Some(0), concat!("supple ", env!("CARGO_PKG_VERSION"), "\n")));
    for arguments in [&["--help"][..], &["design", "--help"], &["help", "evaluate"]] {
        let run = folder.run(arguments);
        assert_eq!(run.quiet().0, Some(0));
        assert!(run.stdout.contains("Usage: supple"));
    }
    let run = folder.run(&[]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(2), ""));
    assert!(run.stderr.contains("Usage: supple"));
}

// streams and signals

/// A run whose reader has hung up.
fn unread(arguments: &[&str], folder: &Folder) -> Run {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_supple"));
    command.args(arguments).current_dir(folder.path(""));
    let pipe = std::process::Stdio::piped;
    let mut child = command.stdout(pipe()).stderr(pipe()).spawn().unwrap();
    drop(child.stdout.take());
    Run::of(&child.wait_with_output().unwrap())
}

#[test]
fn a_reader_that_hangs_up_is_no_failure() {
    let folder = Folder::with_task(TWO_MASS);
    for arguments in [
        &["evaluate", "task.toml"][..],
        &["evaluate", "task.toml", "--json", "--gradient", "both"],
        &["design", "task.toml", "--starts", "1", "--json"],
        &["schema"],
        &["completions", "bash"],
    ] {
        assert_eq!(unread(arguments, &folder).quiet(), (Some(0), ""), "{arguments:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_failure() {
    let folder = Folder::with_task(TWO_MASS);
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_supple"));
    command.args(["evaluate", "task.toml", "--json"]).current_dir(folder.path(""));
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let run = Run::of(&command.stdout(full).output().unwrap());
    assert!(run.error().contains("standard output: "), "{run:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn an_error_that_cannot_be_told_is_still_one() {
    let folder = Folder::with_task(TWO_MASS.replace("steps = ", "stesp = "));
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_supple"));
    command.args(["evaluate", "task.toml"]).current_dir(folder.path(""));
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    assert_eq!(command.stderr(full).output().unwrap().status.code(), Some(2));
}

#[cfg(unix)]
#[test]
fn an_interrupted_design_prints_the_best_until_then() {
    let folder = Folder::with_task(TWO_MASS);
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_supple"));
    // Enough starts to last for a while.
    let starts = (200 * std::thread::available_parallelism().unwrap().get()).to_string();
    command.args(["design", "task.toml", "--starts", &starts, "--json", "--out", "out"]).current_dir(folder.path(""));
    let pipe = std::process::Stdio::piped;
    let child = command.stdout(pipe()).stderr(pipe()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(700));
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let found = Run::of(&child.wait_with_output().unwrap()).json(1);
    assert_eq!(found["status"], "stopped");
    assert_eq!(found["optimum"]["feasible"], true);
    let file: Value = serde_json::from_slice(&std::fs::read(folder.path("out/result.json")).unwrap()).unwrap();
    assert_eq!(file["result"], found);
}
