use serde_json::{Value, json};

use crate::common::{Folder, Run, TWO_MASS};
use crate::{assert_form, evaluation_form, number, two_mass};

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
    let bits = ["needed, bits", "used, bits", "measured, bits", "measured, bits/s"];
    let others = ["k1", "k2", "cost of press", "sampled cost of press", "from sensor sensitivity", "seed 0"];
    for part in bits.into_iter().chain(others).chain(["Roll-outs: linearisation holds."]) {
        assert!(page.contains(part), "{part} is not in\n{page}");
    }
}

#[test]
fn designs_minimise_the_information_that_is_asked_for() {
    let folder = Folder::with_task(TWO_MASS);
    let arguments = ["design", "task.toml", "--starts", "1", "--rollouts", "0", "--json"];
    let measured = folder.run(&arguments).json(0);
    let used = folder.run(&[&arguments[..], &["--information", "used"]].concat()).json(0);
    let bits = |found: &Value| number(&found["optimum"]["tasks"][0]["information"]["used"]["total_bits"]);
    assert_eq!(
        (&measured["settings"]["information"], &used["settings"]["information"]),
        (&json!("measured"), &json!("used"))
    );
    assert!(bits(&used) < bits(&measured), "{} {}", bits(&used), bits(&measured));
    assert!(used["optimum"]["tasks"][0].get("trust").is_none());
    // Nothing is needed at this bound: what is used is minimised in its stead.
    let run = folder.run(&["design", "task.toml", "--starts", "1", "--information", "needed"]);
    let page = run.quiet().1;
    assert!(
        page.contains("No information is needed there; the search then minimised the information used, among"),
        "{page}"
    );
    // Among designs that need nothing.
    let needed = folder.run(&[&arguments[..], &["--information", "needed"]].concat()).json(0);
    let least = number(&needed["optimum"]["tasks"][0]["information"]["needed"]["total_bits"]);
    assert!(least < 1e-6 && bits(&needed) > bits(&used) - 1e-6, "{least} {} {}", bits(&needed), bits(&used));
    let mixed = folder.run(&[&arguments[..], &["--information", "used=1,measured=0.01"]].concat()).json(0);
    assert_eq!(mixed["settings"]["information"], json!({ "needed": 0.0, "used": 1.0, "measured": 0.01 }));
    let run = folder.run(&["design", "task.toml", "--information", "used=much"]);
    assert!(run.code == Some(2) && run.stderr.contains("the weight `much` is not a number"), "{}", run.stderr);

    for (wrong, says) in [
        ("information = \"wanted\"", "`needed`, `used`, `measured`"),
        ("information = { needed = -1.0 }", "weights must be at least 0"),
        ("information = { needed = 1.0, seen = 2.0 }", "seen"),
        ("information = \"needed\"\ngradient = \"frozen\"", "needs the gradient `total`"),
        ("rollouts = -1", "rollouts"),
    ] {
        let text = format!("{TWO_MASS}\n[design]\n{wrong}\n");
        let run = Folder::with_task(&text).run(&["design", "task.toml"]);
        assert_eq!(run.code, Some(2), "{wrong}");
        assert!(run.stderr.contains(says) && run.stderr.contains("task.toml"), "{wrong}: {}", run.stderr);
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
    assert!(run.stdout.contains("The closest exceeds the cost limit of press by 4.6"), "{}", run.stdout);
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
    assert_eq!((&file["kind"], &file["supple"]), (&json!("design"), &json!(env!("CARGO_PKG_VERSION"))));
    let study = &file["study"];
    assert_eq!((&study["run"], &study["task"]), (&json!("design"), &json!("task.toml")));
    assert_eq!((&study["set"], &study["options"]), (&json!({ "k1": 50.0 }), &file["result"]["settings"]));
    assert_eq!((&study["options"]["seed"], &study["options"]["starts"]), (&json!(7), &json!(1)));
    let mut left: Vec<_> =
        std::fs::read_dir(folder.path("out")).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, ["checksums.sha256", "result.json"], "nothing else is left in the folder");
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
