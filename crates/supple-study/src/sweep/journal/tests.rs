#![allow(clippy::unwrap_used)]

use std::fs::File;
use std::path::PathBuf;

use rand_less::Numbers;
use redb::{Database, ReadableTableMetadata};
use tempfile::TempDir;

use super::super::tests::{RUNNING, StopAfter, options, task};
use super::super::{SweepOptions, run};
use super::*;
use crate::journal::{ABOUT, ADVICE, JOURNAL};

/// Numbers that look random, the same in every run.
mod rand_less {
    pub struct Numbers(pub u64);

    impl Numbers {
        /// A number below another.
        pub fn below(&mut self, end: usize) -> usize {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 33) as usize) % end
        }
    }
}

struct Sample {
    task: LoadedTask,
    options: SweepOptions,
    folder: TempDir,
    csv: String,
}

impl Sample {
    /// A sweep that was stopped in the middle of a segment.
    fn new() -> Self {
        let task = task();
        let options = options(&task, &["k1=300,400", "k2=log:100:600:40"]);
        let csv = run(&task, &options, None, RUNNING).unwrap().table.to_csv();
        // How many points are done when it stops depends on the machine; one of these ends in the middle.
        for _ in 0..50 {
            let folder = tempfile::tempdir().unwrap();
            let stop = StopAfter::new(22);
            let done = run(&task, &options, Some(folder.path()), stop.watch()).unwrap().table.rows.len();
            let sample = Self { task: task.clone(), options: options.clone(), folder, csv: csv.clone() };
            if (22..60).contains(&done) && sample.is_within_a_segment() {
                return sample;
            }
        }
        panic!("no sweep was stopped in the middle");
    }

    /// Whether the journal has plans from which an unfinished segment continues.
    fn is_within_a_segment(&self) -> bool {
        let change = Database::open(self.path()).unwrap().begin_write().unwrap();
        let any = !change.open_table(PLANS).unwrap().is_empty().unwrap();
        change.abort().unwrap();
        any
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join(JOURNAL)
    }

    fn run(&self) -> Result<String, StudyError> {
        let sweep = run(&self.task, &self.options, Some(self.folder.path()), RUNNING)?;
        assert!(sweep.complete);
        Ok(sweep.table.to_csv())
    }

    /// Runs with a journal of these bytes: it is refused and left as it is, or gives the right table.
    fn refuses(&self, bytes: &[u8], what: &str) -> bool {
        std::fs::write(self.path(), bytes).unwrap();
        match self.run() {
            Ok(csv) => {
                assert_eq!(csv, self.csv, "{what}");
                false
            }
            Err(error) => {
                assert!(matches!(error, StudyError::Kept { .. }), "{what}: {error:?}");
                let text = error.to_string();
                assert!(text.starts_with(&*self.path().to_string_lossy()) && text.ends_with(ADVICE), "{text}");
                assert!(text.contains(": is damaged or ") || text.contains(": is a database of format "), "{text}");
                assert!(std::fs::read(self.path()).unwrap() == bytes, "{what}: the journal was changed");
                true
            }
        }
    }
}

#[test]
fn a_stopped_sweep_goes_on_to_the_same_table() {
    let sample = Sample::new();
    assert!(kept_points(sample.folder.path()).unwrap() >= 22);
    assert_eq!(sample.run().unwrap(), sample.csv);
    assert_eq!(kept_points(sample.folder.path()).unwrap(), 80);
    // Complete: nothing is evaluated, but the table is there.
    assert_eq!(sample.run().unwrap(), sample.csv);
}

#[test]
fn searches_for_designs_go_on_too() {
    let task = task();
    let options = SweepOptions { starts: 1, rollouts: 2, ..options(&task, &["k1=300,400,500,600"]) };
    let csv = run(&task, &options, None, RUNNING).unwrap().table.to_csv();
    let folder = tempfile::tempdir().unwrap();
    let stop = StopAfter::new(1);
    assert!(!run(&task, &options, Some(folder.path()), stop.watch()).unwrap().complete);
    let sweep = run(&task, &options, Some(folder.path()), RUNNING).unwrap();
    assert!(sweep.complete && sweep.table.to_csv() == csv);
}

#[test]
fn truncated_journals_are_refused_and_left_alone() {
    let sample = Sample::new();
    let bytes = std::fs::read(sample.path()).unwrap();
    let mut numbers = Numbers(3);
    let mut lengths =
        vec![0, 1, 8, 9, 63, 64, 128, 319, 320, 4095, 4096, 4097, 8192, bytes.len() - 4096, bytes.len() - 1];
    lengths.extend((0..40).map(|_| numbers.below(bytes.len())));
    let refused = lengths.iter().filter(|&&len| sample.refuses(&bytes[..len], &format!("{len} bytes"))).count();
    assert!(refused >= lengths.len() / 2, "{refused} of {}", lengths.len());
    assert!(sample.refuses(b"", "empty") && sample.refuses(&bytes[..1000], "a start"));
}

#[test]
fn overwritten_journals_are_refused_or_not_harmed() {
    let sample = Sample::new();
    let bytes = std::fs::read(sample.path()).unwrap();
    let mut numbers = Numbers(7);
    let mut refused = 0;
    // More of them with this variable, for a longer look.
    let cases = std::env::var("SUPPLE_JOURNAL_CASES").map_or(60, |cases| cases.parse().unwrap());
    for case in 0..cases {
        let mut damaged = bytes.clone();
        let longest = [4, 64, 5000][case % 3];
        let (start, len) = match case % 2 {
            // The header, and pages that are in use.
            0 => (numbers.below(512), 1 + numbers.below(longest)),
            _ => (numbers.below(bytes.len() - longest), 1 + numbers.below(longest)),
        };
        for byte in &mut damaged[start..start + len] {
            *byte = numbers.below(256) as u8;
        }
        refused += usize::from(sample.refuses(&damaged, &format!("{len} bytes at {start}")));
    }
    // Much of the file is unused, so that damage there does not matter.
    assert!(refused >= cases / 20, "{refused} of {cases}");
    let noise: Vec<u8> = (0..100_000).map(|_| numbers.below(256) as u8).collect();
    assert!(sample.refuses(&noise, "noise"));
}

#[test]
fn another_sweep_is_refused_with_the_difference() {
    let sample = Sample::new();
    let bytes = std::fs::read(sample.path()).unwrap();
    let refused = |task: &LoadedTask, options: &SweepOptions, lines: &[&str]| {
        let error = run(task, options, Some(sample.folder.path()), RUNNING).unwrap_err().to_string();
        assert!(error.contains("belongs to another sweep; give another --out, or remove the file"), "{error}");
        lines.iter().for_each(|line| assert!(error.lines().any(|found| found == *line), "no `{line}` in\n{error}"));
        assert!(std::fs::read(sample.path()).unwrap() == bytes);
    };
    let Sample { options, .. } = &sample;
    refused(&sample.task, &SweepOptions { seed: 4, ..options.clone() }, &["-seed 0", "+seed 4"]);
    refused(&sample.task, &SweepOptions { rollouts: 4, ..options.clone() }, &["-rollouts 0", "+rollouts 4"]);
    refused(
        &sample.task,
        &SweepOptions { starts: 0, axes: options.axes[..1].to_vec(), ..options.clone() },
        &["+parameter k2 = 500.0"],
    );
    let mut task = super::super::tests::task();
    task.phi[2] = 2e-4;
    refused(&task, options, &["-parameter wall_variance = 0.0001", "+parameter wall_variance = 0.0002"]);
    let mut task = super::super::tests::task();
    task.sources[0].text = task.sources[0].text.replace("steps = 125", "steps = 120");
    refused(&task, options, &["-steps = 125", "+steps = 120"]);
    let mut axes = options.axes.clone();
    axes[1].values[3] *= 1.0 + 1e-15;
    refused(&sample.task, &SweepOptions { axes, ..options.clone() }, &[]);
    assert_eq!(sample.run().unwrap(), sample.csv);
}

#[test]
fn another_version_is_refused() {
    for (key, value, said) in [
        ("format", "2", "has format 2; this version of supple keeps format 1"),
        ("supple", "0.0.9", "was written by supple 0.0.9, but this is "),
        ("identity", "nothing", "does not match its fingerprint"),
    ] {
        let sample = Sample::new();
        let database = Database::open(sample.path()).unwrap();
        let change = database.begin_write().unwrap();
        change.open_table(ABOUT).unwrap().insert(key, value).unwrap();
        change.commit().unwrap();
        drop(database);
        let error = sample.run().unwrap_err().to_string();
        assert!(error.contains(said) && error.contains("give another --out"), "{error}");
    }
}

#[test]
fn databases_of_others_and_rows_that_do_not_fit_are_refused() {
    let sample = Sample::new();
    std::fs::remove_file(sample.path()).unwrap();
    drop(Database::create(sample.path()).unwrap());
    let bytes = std::fs::read(sample.path()).unwrap();
    assert!(sample.refuses(&bytes, "an empty database"));
    for (point, row) in [(79, "[1]"), (80, "[]"), (79, "{"), (79, "[0,0,0,0,0,0,0,0,0,0,0,0,0,0]")] {
        let sample = Sample::new();
        let database = Database::open(sample.path()).unwrap();
        let change = database.begin_write().unwrap();
        change.open_table(ROWS).unwrap().insert(point, row).unwrap();
        change.commit().unwrap();
        drop(database);
        let bytes = std::fs::read(sample.path()).unwrap();
        assert!(sample.refuses(&bytes, row));
    }
    let sample = Sample::new();
    let database = Database::open(sample.path()).unwrap();
    let change = database.begin_write().unwrap();
    change.open_table(PLANS).unwrap().retain(|_, _| false).unwrap();
    change.commit().unwrap();
    drop(database);
    let bytes = std::fs::read(sample.path()).unwrap();
    assert!(sample.refuses(&bytes, "no plans"));
}

#[test]
fn a_journal_in_use_is_refused() {
    let sample = Sample::new();
    let file = File::options().read(true).write(true).open(sample.path()).unwrap();
    file.lock().unwrap();
    let error = sample.run().unwrap_err().to_string();
    assert!(error.contains("is in use by another process"), "{error}");
    drop(file);
    assert_eq!(sample.run().unwrap(), sample.csv);
}

#[test]
fn what_an_earlier_process_left_of_a_new_journal_is_no_harm() {
    let sample = Sample::new();
    std::fs::remove_file(sample.path()).unwrap();
    std::fs::write(sample.folder.path().join("journal.new"), b"half a header").unwrap();
    assert_eq!(sample.run().unwrap(), sample.csv);
    assert!(!sample.folder.path().join("journal.new").exists());
}
