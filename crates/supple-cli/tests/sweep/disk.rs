//! Folders that cannot be written, and disks that are full.

use std::path::Path;
use std::process::Command;

use supple_study::sweep::kept_points;

use crate::common::{Folder, Run};
use crate::{GRID, sweep, tables, two_mass};

/// A small file system in memory, where the test may mount one.
struct Mounted<'a>(&'a Path);

impl<'a> Mounted<'a> {
    fn new(path: &'a Path, size: &str) -> Option<Self> {
        std::fs::create_dir(path).unwrap();
        let mount = Command::new("mount").args(["-t", "tmpfs", "-o", size, "tmpfs"]).arg(path).output();
        mount.is_ok_and(|output| output.status.success()).then_some(Self(path))
    }

    fn resize(&self, size: &str) {
        let remount = format!("remount,{size}");
        assert!(Command::new("mount").args(["-o", &remount]).arg(self.0).status().unwrap().success());
    }
}

impl Drop for Mounted<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0).status();
    }
}

/// The tables of the grid, on a disk with space.
fn expected(folder: &Folder) -> [Vec<u8>; 2] {
    assert_eq!(folder.run(&sweep(&[&GRID, &["--out", "whole"][..]].concat())).code, Some(0));
    tables(folder, "whole")
}

/// Checks how a sweep without space ended, and what is kept of it.
fn assert_full(run: &Run, folder: &Folder, out: &str, system: &str) {
    let error = run.error();
    println!("{error}");
    assert!(error.starts_with(&format!("error: {out}/")) && error.contains(system), "{error}");
    assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
    assert!(!folder.path(out).join("result.json").exists());
}

#[test]
fn a_full_disk_keeps_what_was_done() {
    let folder = two_mass();
    let whole = expected(&folder);
    let arguments = sweep(&[&GRID, &["--out", "small/out"][..]].concat());
    let path = folder.path("small");
    let Some(small) = Mounted::new(&path, "size=8k") else {
        println!("skipped: no file system can be mounted here");
        return;
    };
    let mut kept = 0;
    let mut middle = false;
    for size in ["size=8k", "size=64k", "size=104k", "size=128k", "size=160k", "size=200k", "size=240k"] {
        small.resize(size);
        let run = folder.run(&arguments);
        if run.code == Some(0) {
            break;
        }
        assert_full(&run, &folder, "small/out", "No space left on device");
        if folder.path("small/out/journal.redb").exists() {
            let now = kept_points(&folder.path("small/out")).unwrap();
            println!("{size}: {now} points are kept");
            assert!(now >= kept);
            middle |= (1..200).contains(&now);
            kept = now;
        }
    }
    assert!(middle, "the disk was never full in the middle of a sweep");
    small.resize("size=64m");
    let run = folder.run(&arguments);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(tables(&folder, "small/out") == whole);
}

#[test]
fn files_that_may_not_grow_keep_what_was_done() {
    let folder = two_mass();
    let whole = expected(&folder);
    let arguments = sweep(&[&GRID, &["--out", "out"][..]].concat());
    let mut failures = 0;
    // In units of 512 bytes, or of 1024 in some shells.
    for blocks in [8, 400] {
        let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
        let output = Command::new("sh")
            .args(["-c", &limited, env!("CARGO_BIN_EXE_supple")])
            .args(&arguments)
            .current_dir(folder.path(""))
            .output()
            .unwrap();
        let run = Run::of(&output);
        if run.code == Some(0) {
            break;
        }
        assert_full(&run, &folder, "out", "File too large");
        failures += 1;
    }
    assert!(failures > 0, "no limit was too small");
    let run = folder.run(&arguments);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(tables(&folder, "out") == whole);
}

#[test]
fn folders_that_cannot_be_written_are_named() {
    let folder = two_mass();
    std::fs::write(folder.path("file"), "").unwrap();
    std::fs::create_dir_all(folder.path("taken/journal.redb")).unwrap();
    let mut cases = vec![
        ("file/out", "`file` is a file, not a folder; choose another folder, or rename the file"),
        ("taken", "is not a regular file"),
    ];
    if cfg!(target_os = "linux") {
        cases.push(("/proc/sweep", "nothing can be created in `/proc`; choose another folder"));
    }
    for (out, said) in cases {
        let run = folder.run(&sweep(&["--grid", "k1=300,600", "--out", out]));
        let error = run.error();
        assert!(error.starts_with(&format!("error: {out}")) && error.contains(said), "{error}");
    }
}
