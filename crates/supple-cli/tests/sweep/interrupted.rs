use std::process::Command;
use std::time::Duration;

use supple_study::JOURNAL;
use supple_study::sweep::kept_points;

use crate::common::{Folder, Run};
use crate::{GRID, start, sweep, tables, two_mass, wait_for};

const POINTS: u64 = 200;

/// Kills in the middle of a sweep, on each number of threads.
const KILLS: usize = 8;

/// Sweeps begun for them: some are killed before their first point or are done before they are killed.
const STARTS: usize = 30 * KILLS;

/// Arguments that make points slow enough to be killed among them.
fn slow<'a>(more: &[&'a str]) -> Vec<&'a str> {
    sweep(&[&GRID, &["--rollouts", "24", "--seed", "2"], more].concat())
}

/// Arguments of a sweep that is surely not done within a tenth of a second.
fn slower<'a>(more: &[&'a str]) -> Vec<&'a str> {
    sweep(&[&GRID, &["--rollouts", "300", "--seed", "2"], more].concat())
}

#[test]
fn killed_sweeps_go_on_to_the_same_tables() {
    let folder = two_mass();
    assert_eq!(folder.run(&slow(&["--out", "whole"])).code, Some(0));
    let whole = tables(&folder, "whole");
    let mut numbers = 12_345u64;
    for threads in ["1", "2", "8"] {
        // How long sweeps take differs by machine, and by what else it does: what the last one showed is learnt.
        let (mut span, mut starts, mut inside, mut round) = (200, 0, 0, 0);
        while inside < KILLS {
            // A sweep that was complete before its kills were done is begun anew.
            let out = format!("killed-{threads}-{round}");
            let arguments = slow(&["--out", &out, "--threads", threads]);
            while inside < KILLS && !folder.path(&out).join("result.json").exists() {
                assert!(starts < STARTS, "only {inside} of {STARTS} kills were in the middle of a sweep");
                starts += 1;
                let mut child = start(&folder, &arguments);
                numbers = numbers.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                std::thread::sleep(Duration::from_millis((numbers >> 33) % span));
                child.kill().unwrap();
                let ended = child.wait().unwrap();
                let done = match folder.path(&out).join(JOURNAL).exists() {
                    true => kept_points(&folder.path(&out)).unwrap(),
                    false => 0,
                };
                println!("{threads} threads, start {starts}: {done} of {POINTS} points ({ended})");
                match done {
                    0 => span = span * 5 / 4 + 1,
                    POINTS => span = (span * 3 / 4).max(2),
                    _ => inside += 1,
                }
            }
            let run = folder.run(&arguments);
            assert_eq!(run.code, Some(0), "{run:?}");
            assert!(tables(&folder, &out) == whole, "{out}: the tables differ");
            round += 1;
        }
    }
}

#[test]
fn ctrl_c_keeps_what_is_done_and_says_how_far_it_is() {
    let folder = two_mass();
    let arguments = slower(&["--out", "out", "--threads", "2"]);
    // On a busy machine it may take a while until a point is done.
    let (run, done) = [100, 300, 1000, 3000]
        .into_iter()
        .map(|milliseconds| {
            let child = start(&folder, &arguments);
            wait_for(&folder.path("out").join(JOURNAL));
            std::thread::sleep(Duration::from_millis(milliseconds));
            assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
            let run = Run::of(&child.wait_with_output().unwrap());
            (run, kept_points(&folder.path("out")).unwrap())
        })
        .find(|(_, done)| *done > 0)
        .expect("no point was done");
    let said = format!(
        "warning: interrupted: {done} of 200 points are done and stored in out/journal.redb; the same command resumes\n"
    );
    assert_eq!((run.code, run.stderr.as_str()), (Some(1), &*said));
    assert!((1..POINTS).contains(&done));
    assert!(!folder.path("out").join("table.csv").exists() && !folder.path("out").join("result.json").exists());
    assert_eq!(folder.run(&arguments).code, Some(0));
    let fresh = two_mass();
    assert_eq!(fresh.run(&arguments).code, Some(0));
    assert!(tables(&folder, "out") == tables(&fresh, "out"));
}

#[test]
fn two_processes_do_not_share_a_folder() {
    let folder = two_mass();
    let arguments = slower(&["--out", "out", "--threads", "1"]);
    let mut child = start(&folder, &arguments);
    wait_for(&folder.path("out").join(JOURNAL));
    let second = folder.run(&arguments);
    let done = child.try_wait().unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(done.is_none(), "the first process ended too early to tell");
    assert_eq!(
        second.error(),
        "error: out/journal.redb: is in use by another process; wait until it finishes, or give another --out"
    );
    assert_eq!(folder.run(&arguments).code, Some(0));
}

#[test]
fn a_complete_sweep_writes_its_tables_again_at_once() {
    let folder: Folder = two_mass();
    let arguments = sweep(&["--grid", "k1=300:600:6", "--out", "out"]);
    assert_eq!(folder.run(&arguments).code, Some(0));
    let first = tables(&folder, "out");
    for name in ["table.csv", "table.jsonl", "result.json"] {
        std::fs::remove_file(folder.path("out").join(name)).unwrap();
    }
    assert_eq!(folder.run(&arguments).code, Some(0));
    assert!(tables(&folder, "out") == first && folder.path("out").join("result.json").exists());
}
