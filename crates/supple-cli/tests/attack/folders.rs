//! Result folders of others.

use serde_json::{Value, json};

use crate::common::{Folder, TWO_MASS};

/// A folder with the task and a result of it in `out`.
fn made(words: &[&str]) -> Folder {
    let folder = Folder::with_task(TWO_MASS);
    let run = folder.run(&[words, &["task.toml", "--out", "out"]].concat());
    assert!(run.code.is_some_and(|code| code < 2), "{run:?}");
    folder
}

/// Changes the result in `out`.
fn change(folder: &Folder, change: impl FnOnce(&mut Value)) {
    let path = folder.path("out/result.json");
    let mut result = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    change(&mut result);
    std::fs::write(path, result.to_string()).unwrap();
}

#[test]
fn a_short_row_made_figures_panic() {
    for rows in ["states", "deviations", "feedback", "controls"] {
        let folder = made(&["evaluate"]);
        change(&folder, |result| {
            let trajectory = &mut result["result"]["evaluation"]["tasks"][0]["trajectory"];
            trajectory[rows][3].as_array_mut().unwrap().clear();
        });
        for figure in ["belief", "gains", "information"] {
            let run = folder.run(&["plot", "out", "--figure", figure]);
            assert!(run.code.is_some_and(|code| code != 101) && !run.stderr.contains("panicked"), "{run:?}");
            if figure == "belief" && rows == "states" {
                assert!(run.stderr.contains("rows of its trajectories differ in length"), "{run:?}");
            }
        }
    }
}

#[test]
fn a_quantile_of_almost_nothing_took_all_memory() {
    let text = TWO_MASS.to_owned() + "\n[parameters.wall]\ninitial = 1e-4\nbounds = [1e-6, 1.0]\nrole = \"study\"\n";
    let text = text.replacen("3e-4, 1e-4]", "3e-4, \"wall\"]", 1);
    let folder = Folder::with_task(text);
    let words = ["robustness", "task.toml", "--designs", "start", "--vary", "wall=1e-5,1e-4", "--rollouts", "4"];
    let run = folder.run(&[&words[..], &["--out", "out"]].concat());
    assert!(run.code.is_some_and(|code| code < 2), "{run:?}");
    change(&folder, |result| result["result"]["cells"][0]["quantiles"][0] = json!(1e-320));
    let run = folder.run(&["plot", "out", "--figure", "robustness"]);
    assert_eq!(run.code, Some(0), "{run:?}");
}

#[test]
fn a_changed_result_says_so() {
    let folder = made(&["evaluate"]);
    assert_eq!(folder.run(&["show", "out"]).quiet().0, Some(0));
    change(&folder, |result| result["seed"] = json!(7));
    let run = folder.run(&["show", "out"]);
    assert!(run.stderr.contains("out/result.json has changed since it was made"), "{run:?}");
}

#[cfg(unix)]
#[test]
fn a_link_in_place_of_a_new_journal_was_followed() {
    for name in ["journal.new", "journal.redb"] {
        let folder = Folder::with_task(TWO_MASS);
        std::fs::create_dir(folder.path("out")).unwrap();
        std::fs::write(folder.path("precious"), "text").unwrap();
        std::os::unix::fs::symlink(folder.path("precious"), folder.path("out").join(name)).unwrap();
        let run = folder.run(&["sweep", "task.toml", "--grid", "k1=60,70", "--out", "out"]);
        assert!(
            run.code == Some(2)
                && run.stderr.contains("is not a regular file (for example a symbolic link); remove it"),
            "{run:?}"
        );
        assert_eq!(std::fs::read_to_string(folder.path("precious")).unwrap(), "text");
    }
}

#[test]
fn a_report_asks_no_address_for_anything() {
    let folder = made(&["evaluate"]);
    let run = folder.run(&["report", "out", "--out", "page.html"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let page = std::fs::read_to_string(folder.path("page.html")).unwrap();
    assert!(page.contains("http-equiv=\"Content-Security-Policy\" content=\"default-src 'none';"));
}
