//! `supple report`: pages of results, and what is wrong with folders.

mod common;

use common::{Folder, TWO_MASS};

/// A folder with a task and the results of one evaluation in `at`.
fn evaluated() -> Folder {
    let folder = Folder::with_task(TWO_MASS);
    let run = folder.run(&["evaluate", "task.toml", "--out", "at"]);
    assert_eq!(run.quiet().0, Some(0), "{run:?}");
    folder
}

#[test]
fn a_page_is_written_beside_nothing_else() {
    let folder = evaluated();
    let run = folder.run(&["report", "at", "--out", "pages/one.html"]);
    let (code, said) = run.quiet();
    assert_eq!(code, Some(0));
    assert!(said.starts_with("pages/one.html: ") && said.ends_with(" MB\n"), "{said}");
    let page = std::fs::read_to_string(folder.path("pages/one.html")).unwrap();
    assert!(
        page.starts_with("<!DOCTYPE html>") && page.contains("supple evaluate task.toml --rollouts 256"),
        "{page:.300}"
    );
    assert_eq!(folder.names(), ["at", "pages", "task.toml"]);
}

#[test]
fn the_page_is_report_html_where_nothing_else_is_said() {
    let folder = evaluated();
    assert_eq!(folder.run(&["report", "at", "at"]).quiet().0, Some(0));
    assert_eq!(folder.names(), ["at", "report.html", "task.toml"]);
    let page = std::fs::read_to_string(folder.path("report.html")).unwrap();
    assert!(page.contains("Report of 1 result "), "a folder that is named twice is read once");
}

#[test]
fn folders_without_results_are_refused_and_nothing_is_written() {
    let folder = evaluated();
    std::fs::create_dir(folder.path("empty")).unwrap();
    std::fs::create_dir(folder.path("bad")).unwrap();
    std::fs::write(folder.path("bad/result.json"), "{\"format\": 1, \"kind\": \"design\"").unwrap();
    std::fs::create_dir(folder.path("later")).unwrap();
    std::fs::write(folder.path("later/result.json"), "{\"format\": 99}").unwrap();
    for (name, says) in [
        ("empty", "empty: holds no result: it has no file `result.json`"),
        ("missing", "missing: there is no such folder"),
        ("bad", "bad/result.json"),
        ("later", "format 99"),
    ] {
        let run = folder.run(&["report", "at", name]);
        assert!(run.error().contains(says), "{}", run.stderr);
    }
    assert_eq!(folder.names(), ["at", "bad", "empty", "later", "task.toml"]);
}

#[test]
fn places_that_cannot_be_written_are_refused() {
    let folder = evaluated();
    std::fs::write(folder.path("file"), "").unwrap();
    for out in ["at", "file/page.html", ".."] {
        let run = folder.run(&["report", "at", "--out", out]);
        assert!(!run.error().is_empty());
    }
    assert_eq!(folder.names(), ["at", "file", "task.toml"]);
}
