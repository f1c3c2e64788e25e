//! What the server answers, and whom.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::io::Write;
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use common::{SMALL, Served};
use serde_json::{Value, json};
use supple::EvaluateOptions;
use supple_explore::Explorer;
use supple_study::{Folder, LoadedTask};

#[test]
fn strangers_are_refused_everywhere() {
    let served = Served::of(Path::new(SMALL));
    let (host, token) = (served.host(), served.token());
    let origin = format!("http://{host}");
    let paths = [("GET", "/"), ("GET", "/file/main.js"), ("GET", "/channel"), ("POST", "/ask"), ("POST", "/reload")];
    for (method, path) in paths {
        let with = |token: &str| format!("{path}?token={token}");
        let tries = [
            (path.to_owned(), host.as_str(), origin.as_str()),
            (with("0123"), &host, &origin),
            (with(&token), "example.org", &origin),
            (with(&token), "127.0.0.1:1", &origin),
            (with(&token), &host, "http://example.org"),
            (with(&token), &host, "null"),
        ];
        for (address, host, origin) in tries {
            let (status, _) = served.request(method, &address, &[("Host", host), ("Origin", origin)], "{}");
            assert_eq!(status, 403, "{method} {address} {host} {origin}");
        }
    }
    for (method, path) in &paths[2..] {
        let (status, _) = served.request(method, &format!("{path}?token={token}"), &[("Host", &host)], "{}");
        assert_eq!(status, 403, "{method} {path} without an origin");
    }
}

#[test]
fn the_page_and_all_its_files_are_served_with_the_token() {
    let served = Served::of(Path::new(SMALL));
    let (status, page) = served.own("GET", "/", "");
    assert_eq!(status, 200);
    let files: Vec<&str> = page.split("=\"/file/").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert!(files.len() > 10);
    for file in files {
        let (name, query) = file.split_once('?').unwrap();
        assert_eq!(query, format!("token={}", served.token()));
        let (status, text) = served.own("GET", &format!("/file/{name}"), "");
        assert!(status == 200 && text.len() > 500, "{name}: {status}");
        // plotly.js can draw maps of the world, which it would fetch; the page has none.
        assert!(name == "plotly.js" || !text.contains("https://cdn"), "{name} fetches something");
    }
    assert_eq!(served.own("GET", "/file/Cargo.toml", "").0, 404);
    assert_eq!(served.own("PUT", "/", "").0, 405);
}

#[test]
fn an_answer_says_what_it_answers_and_is_that_of_evaluate() {
    let served = Served::of(Path::new(SMALL));
    let mut page = served.page();
    let mut values = page.values();
    values[0] = 40.0;
    page.ask("evaluate", 7, json!({ "values": values, "want": ["state:0", "information:0", "nonsense:1"] }));
    let answer = page.next("evaluate");
    assert_eq!((&answer["id"], &answer["values"]), (&json!(7), &json!(values)));
    let design = &answer["designs"][0];
    let loaded = LoadedTask::load(Path::new(SMALL)).unwrap();
    let mut phi = loaded.phi.clone();
    phi[0] = 40.0;
    let expected = loaded.problem.evaluate(&phi, &EvaluateOptions::default()).unwrap();
    let task = &design["numbers"]["tasks"][0];
    assert_eq!(task["measured"], expected.tasks[0].information.total_bits);
    assert_eq!(task["expected"], expected.tasks[0].cost.expected);
    assert_eq!(design["numbers"]["feasible"], expected.feasible);
    assert_eq!(design["curves"]["curves"].as_array().unwrap().len(), 2);
    assert!(design["scene"]["bodies"].as_array().is_some_and(|bodies| !bodies.is_empty()));
    assert_eq!(served.explorer.screen().parameters[0].1, 40.0);
}

#[test]
fn limits_and_noise_turn_what_they_say() {
    let served = Served::of(Path::new(SMALL));
    let mut page = served.page();
    let names: Vec<String> =
        page.hello["knobs"].as_array().unwrap().iter().map(|knob| knob["name"].as_str().unwrap().to_owned()).collect();
    let place = |name: &str| names.iter().position(|other| other == name).expect(name);
    page.ask("evaluate", 1, json!({}));
    let before = page.next("evaluate")["designs"][0]["numbers"]["tasks"][0].clone();
    let mut values = page.values();
    values[place("cost limit")] = 1e6;
    values[place("process noise")] = 2.0;
    page.ask("evaluate", 2, json!({ "values": values }));
    let after = page.next("evaluate")["designs"][0]["numbers"]["tasks"][0].clone();
    assert_eq!(after["bound"], 1e6);
    // Variances times 4, and the plan stays.
    let part = |task: &Value, name: &str| task["parts"][name].as_f64().unwrap();
    assert!((part(&after, "process") / part(&before, "process") - 4.0).abs() < 1e-9);
    assert!((part(&after, "nominal") - part(&before, "nominal")).abs() < 1e-9 * part(&before, "nominal").abs());
}

#[test]
fn a_map_fills_from_coarse_to_fine_and_roll_outs_come_in_batches() {
    let served = Served::of(Path::new(SMALL));
    let mut page = served.page();
    page.ask("rollouts", 1, json!({ "count": 25, "want": ["state:0"] }));
    let mut costs = 0;
    while costs < 25 {
        let batch = page.next("rollouts");
        let count = batch["costs"].as_array().unwrap().len();
        assert_eq!(batch["threads"][0]["threads"].as_array().unwrap().len(), count);
        costs += count;
    }
    page.ask("map", 2, json!({ "axes": [0, 1] }));
    let mut points = Vec::new();
    loop {
        let message = page.next("map");
        points.extend(message["points"].as_array().unwrap().clone());
        if message["done"][0] == message["done"][1] {
            break;
        }
    }
    assert_eq!(points.len(), 33 * 33);
    // Their corner is the design with both parameters at their lower ends.
    let corner = points.iter().find(|point| point[0] == 0 && point[1] == 0).unwrap();
    let mut values = page.values();
    for (axis, value) in values.iter_mut().enumerate().take(2) {
        *value = page.hello["knobs"][axis]["bounds"][0].as_f64().unwrap();
    }
    page.ask("evaluate", 3, json!({ "values": values }));
    assert_eq!(corner[2], page.next("evaluate")["designs"][0]["numbers"]["measured"]);
}

#[test]
fn bad_requests_are_refused_with_a_reason() {
    let served = Served::of(Path::new(SMALL));
    let mut page = served.page();
    let path = format!("/ask?page={}", page.hello["page"]);
    for (body, says) in
        [("", "cannot be read"), ("{\"view\": \"nothing\"}", "unknown variant"), ("[1", "cannot be read")]
    {
        let (status, text) = served.own("POST", &path, body);
        assert!(status == 400 && text.contains(says), "{text}");
    }
    assert_eq!(served.own("POST", "/ask?page=99", &page.text("evaluate", 1, json!({}))).0, 410);
    page.ask("evaluate", 1, json!({ "values": [1.0] }));
    assert!(page.next("evaluate")["error"].as_str().unwrap().contains("found 1 values"));
    let mut values = page.values();
    values[0] = -1.0;
    page.ask("evaluate", 2, json!({ "values": values }));
    assert!(page.next("evaluate")["error"].as_str().unwrap().contains("must be from"));
    page.ask("map", 3, json!({ "axes": [1, 1] }));
    assert!(page.next("map")["error"].as_str().unwrap().contains("two different"));
    page.ask("save", 4, json!({ "what": "all" }));
    assert!(page.next("save")["error"].as_str().unwrap().contains("cannot be saved"));
}

#[test]
fn a_taken_port_is_an_error_that_says_so() {
    let served = Served::of(Path::new(SMALL));
    let loaded = LoadedTask::load(Path::new(SMALL)).unwrap();
    let error = Explorer::open(loaded, None, Some(served.port())).err().unwrap().to_string();
    assert!(error.contains(&served.port().to_string()) && error.contains("--port"), "{error}");
}

#[test]
fn a_closed_explorer_gives_up_its_port() {
    let loaded = || LoadedTask::load(Path::new(SMALL)).unwrap();
    let served = Served::of(Path::new(SMALL));
    let port = served.port();
    drop(served);
    let again = Explorer::open(loaded(), None, Some(port)).unwrap();
    assert!(!again.is_closed());
    again.close();
    again.serve();
    assert!(again.is_closed() && Explorer::open(loaded(), None, Some(port)).is_ok());
}

/// A copy of the small task in a folder of its own.
fn copied() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.toml");
    std::fs::copy(SMALL, &path).unwrap();
    (folder, path)
}

#[test]
fn a_changed_file_is_told_and_read_again_or_kept() {
    let (_folder, path) = copied();
    let served = Served::of(&path);
    let mut page = served.page();
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("bound = 25.0", "bound = nonsense")).unwrap();
    page.next("changed");
    let (status, error) = served.own("POST", "/reload", "");
    assert!(status == 422 && error.contains("small.toml"), "{error}");
    std::fs::write(&path, text.replace("bound = 25.0", "bound = 30.0")).unwrap();
    assert_eq!(served.own("POST", "/reload", "").0, 204);
    page.hello["generation"] = page.next("hello")["generation"].clone();
    assert_eq!(page.hello["generation"], 1);
    page.ask("evaluate", 1, json!({}));
    // The limit of the page's own slider is still the old one: it has a value for it.
    assert!(page.next("evaluate")["designs"][0]["numbers"]["tasks"][0]["bound"].is_number());
}

#[test]
fn the_task_is_saved_with_its_comments_and_begins_with_the_design() {
    let (_folder, path) = copied();
    let text = std::fs::read_to_string(&path).unwrap() + "\n# the last words\n";
    std::fs::write(&path, &text).unwrap();
    let served = Served::of(&path);
    let mut page = served.page();
    let mut values = page.values();
    values[0] = 33.5;
    let limit = page.hello["knobs"].as_array().unwrap().iter().position(|knob| knob["name"] == "cost limit").unwrap();
    values[limit] = 27.0;
    page.ask("save", 1, json!({ "what": "task", "values": values }));
    let saved = page.next("save");
    let saved = Path::new(saved["path"].as_str().unwrap_or_else(|| panic!("{saved}")));
    let new = std::fs::read_to_string(saved).unwrap();
    assert!(new.contains("# the last words") && new.matches('#').count() == text.matches('#').count());
    let loaded = LoadedTask::load(saved).unwrap();
    assert_eq!(loaded.phi[0], 33.5);
    assert_eq!(loaded.problem.tasks[0].bound, Some(supple::Value::Number(27.0)));
    page.ask("save", 2, json!({ "what": "set", "values": values }));
    let text = page.next("save")["text"].as_str().unwrap().to_owned();
    assert!(text.contains("=33.5  # no options set cost limit = 27.0: save the task file"), "{text}");
}

/// The knob with this name.
fn knob(page: &common::Page, name: &str) -> usize {
    page.hello["knobs"].as_array().unwrap().iter().position(|knob| knob["name"] == name).expect(name)
}

/// Turns these knobs, saves the task and reads it back: the numbers are those on screen.
fn round_trip(path: &Path, turns: &[(&str, f64)]) -> String {
    let served = Served::of(path);
    let mut page = served.page();
    let mut values = page.values();
    for (name, value) in turns {
        values[knob(&page, name)] = *value;
    }
    page.ask("evaluate", 1, json!({ "values": values }));
    let shown = page.next("evaluate")["designs"][0]["numbers"].clone();
    page.ask("save", 2, json!({ "what": "task", "values": values }));
    let saved = page.next("save");
    let saved = Path::new(saved["path"].as_str().unwrap_or_else(|| panic!("{saved}")));
    let of_screen = served.explorer.task().unwrap();
    for loaded in [LoadedTask::load(saved).unwrap(), of_screen] {
        let found = loaded.problem.evaluate(&loaded.phi, &EvaluateOptions::default()).unwrap();
        for (task, expected) in found.tasks.iter().zip(shown["tasks"].as_array().unwrap()) {
            for (key, found) in [("measured", task.information.total_bits), ("expected", task.cost.expected)] {
                let expected = expected[key].as_f64().unwrap();
                assert!((found - expected).abs() <= 1e-9 * expected, "{}: {key} {found}, not {expected}", task.name);
            }
            assert_eq!(expected["bound"].as_f64(), task.cost.bound);
        }
    }
    let screen = served.explorer.screen();
    assert_eq!(screen.noise.len() + screen.limits.len() + 1, turns.len(), "{screen:?}");
    let text = std::fs::read_to_string(saved).unwrap();
    assert_eq!(text.matches('#').count(), std::fs::read_to_string(path).unwrap().matches('#').count());
    text
}

#[test]
fn turned_noise_is_saved_with_the_task() {
    let (_folder, path) = copied();
    let knobs: Vec<String> = {
        let served = Served::of(&path);
        let page = served.page();
        page.hello["knobs"].as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap().to_owned()).collect()
    };
    let sensor = knobs.iter().find(|name| name.starts_with("noise of ")).unwrap();
    let turns =
        [(&*knobs[0], 41.0), ("cost limit", 26.0), ("process noise", 1.7), ("initial uncertainty", 0.6), (sensor, 2.5)];
    round_trip(&path, &turns);
}

#[test]
fn turned_noise_of_a_robots_sensors_is_saved_with_its_task() {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (from, to) in [("tasks/soft_gripper.toml", "tasks"), ("models/soft_gripper.xml", "models")] {
        std::fs::create_dir_all(folder.path().join(to)).unwrap();
        std::fs::copy(root.join(from), folder.path().join(from)).unwrap();
    }
    let path = folder.path().join("tasks/soft_gripper.toml");
    let (first, sensors) = {
        let served = Served::of(&path);
        let page = served.page();
        let names = page.hello["knobs"].as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap().to_owned());
        let names: Vec<String> = names.collect();
        let sensors: Vec<String> = names.iter().filter(|name| name.starts_with("noise of ")).cloned().collect();
        (page.hello["knobs"][0].clone(), sensors)
    };
    assert!(sensors.len() > 1, "{sensors:?}");
    let value = 0.9 * first["start"].as_f64().unwrap();
    let turns =
        [(first["name"].as_str().unwrap(), value), (&*sensors[0], 3.0), (&*sensors[1], 0.5), ("process noise", 2.0)];
    let text = round_trip(&path, &turns);
    assert!(text.contains("\nmeasurement = ["), "{text}");
}

#[test]
fn a_saved_result_is_read_by_the_other_commands() {
    let (folder, path) = copied();
    // Results go to the current folder; names are taken from the task file.
    let served = Served::of(&path);
    let mut page = served.page();
    let mut values = page.values();
    values[1] = 11.0;
    std::env::set_current_dir(folder.path()).unwrap();
    page.ask("save", 1, json!({ "what": "result", "values": values }));
    let saved = page.next("save");
    let kept = Folder::load(&folder.path().join(saved["path"].as_str().unwrap_or_else(|| panic!("{saved}")))).unwrap();
    assert_eq!(LoadedTask::restore(&kept.made.sources).unwrap().phi[1], 11.0);
    page.ask("save", 2, json!({ "what": "report", "values": values }));
    let saved = page.next("save");
    let report =
        std::fs::read_to_string(folder.path().join(saved["path"].as_str().unwrap_or_else(|| panic!("{saved}"))))
            .unwrap();
    assert!(report.contains("</html>"));
}

#[test]
fn requests_for_hundreds_of_designs_were_answered_with_megabytes() {
    let served = Served::of(Path::new(SMALL));
    let page = served.page();
    let address = format!("/ask?page={}", page.hello["page"]);
    let pin = json!({ "name": "A", "values": page.values() });
    for (list, most) in [
        (json!({ "pins": vec![pin; 900] }), "at most 8 pinned designs; found 900"),
        (json!({ "want": vec!["state:0"; 3000] }), "at most 100 quantities; found 3000"),
    ] {
        let mut ask = json!({ "view": "pins", "id": 1, "generation": 0 });
        ask.as_object_mut().unwrap().extend(list.as_object().unwrap().clone());
        let (status, text) = served.own("POST", &address, &ask.to_string());
        assert!(status == 400 && text.contains(most), "{status} {text}");
    }
}

#[test]
fn idle_connections_kept_others_out() {
    let served = Served::of(Path::new(SMALL));
    let idle: Vec<TcpStream> = (0..400)
        .map(|_| {
            let mut stream = TcpStream::connect(served.host()).unwrap();
            // Those that were closed for others need not take this.
            let _ = stream.write_all(b"GET / HT");
            stream
        })
        .collect();
    let clock = Instant::now();
    assert_eq!(served.own("GET", "/", "").0, 200);
    assert!(clock.elapsed() < Duration::from_secs(10), "{:?}", clock.elapsed());
    drop(idle);
}

#[test]
fn large_numbers_were_printed_with_hundreds_of_zeros() {
    let served = Served::of(Path::new(SMALL));
    let mut page = served.page();
    let mut values = page.values();
    values[0] = 1e308;
    page.ask("evaluate", 1, json!({ "values": values }));
    let error = page.next("evaluate")["error"].as_str().unwrap().to_owned();
    assert!(error.contains("found 1e308") && error.len() < 200, "{error}");
}
