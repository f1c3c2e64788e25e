//! Shipped task, robot and table files and a result, each changed at random in thousands of ways: all are read or refused
//! with an error, soon, and none makes a reader panic. The same inputs on every machine.
#![allow(clippy::unwrap_used)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use supple::EvaluateOptions;
use supple_study::evaluate::EvaluateReport;
use supple_study::study::Work;
use supple_study::{Folder, LoadedTask, Made, RESULT, Source, StudyError, StudyResult};

/// Changed files of each shipped task.
const OF_A_TASK: usize = 160;

/// Changed results.
const OF_A_RESULT: usize = 250;

/// Far more than reading takes.
const SOON: Duration = Duration::from_secs(10);

/// What replaces numbers and words.
const STRANGE: [&str; 24] = [
    "nan",
    "inf",
    "-inf",
    "1e999",
    "-1e-320",
    "0",
    "-0.0",
    "-1",
    "18446744073709551616",
    "1e308",
    "true",
    "[]",
    "{}",
    "\"\"",
    "[[[[]]]]",
    "\u{0}",
    "\u{202e}",
    "\u{1b}[2J",
    "'",
    "\"\"\"",
    "<a>",
    "&x;",
    "../../../../etc/passwd",
    "é",
];

/// Numbers that look random (Knuth's MMIX generator).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % limit.max(1)
    }

    /// A place in a text, between two characters.
    fn place(&mut self, text: &str) -> usize {
        let place = self.below(text.len() + 1);
        (0..=place).rev().find(|&place| text.is_char_boundary(place)).unwrap_or(0)
    }

    /// The bytes of a word or number.
    fn word(&mut self, text: &str) -> std::ops::Range<usize> {
        let is_part = |c: char| c.is_alphanumeric() || "._-+".contains(c);
        let from = self.place(text);
        let start = text[from..].find(is_part).map_or(text.len(), |skip| from + skip);
        let end = text[start..].find(|c| !is_part(c)).map_or(text.len(), |length| start + length);
        start..end
    }

    fn change(&mut self, text: &mut String) {
        let lines: Vec<&str> = text.lines().collect();
        match self.below(9) {
            0 => text.truncate(self.place(text)),
            1 => {
                let mut places = [self.place(text), self.place(text)];
                places.sort_unstable();
                let most = places[1].min(places[0] + 40);
                let end = (places[0]..=most).rev().find(|&place| text.is_char_boundary(place)).unwrap_or(places[0]);
                text.replace_range(places[0]..end, "");
            }
            2 => {
                let (from, to) = (self.below(lines.len()), self.below(lines.len()));
                let mut lines = lines.clone();
                if !lines.is_empty() {
                    lines.insert(to, lines[from]);
                }
                *text = lines.join("\n");
            }
            3 => {
                let at = self.below(lines.len());
                *text = lines
                    .iter()
                    .enumerate()
                    .filter(|(i, _)| *i != at)
                    .map(|(_, line)| *line)
                    .collect::<Vec<_>>()
                    .join("\n");
            }
            4 | 5 => {
                let word = self.word(text);
                text.replace_range(word, STRANGE[self.below(STRANGE.len())]);
            }
            6 => {
                let (from, to) = (self.word(text), self.word(text));
                let other = text[from].to_owned();
                text.replace_range(to, &other);
            }
            7 => {
                let at = self.place(text);
                text.insert_str(at, STRANGE[self.below(STRANGE.len())]);
            }
            _ => {
                let (word, repeats) = (self.word(text), 2 + self.below(300));
                let many = text[word.clone()].repeat(repeats);
                text.replace_range(word, &many);
            }
        }
    }
}

fn read<T>(what: &str, work: impl FnOnce() -> Result<T, StudyError>) -> bool {
    let clock = Instant::now();
    let found = catch_unwind(AssertUnwindSafe(work));
    let took = clock.elapsed();
    assert!(took < SOON, "{what}: took {took:?}");
    match found.unwrap_or_else(|_| panic!("{what}: it panicked")) {
        Ok(_) => true,
        Err(error) => {
            assert!(!error.to_string().trim().is_empty(), "{what}: an error without words");
            false
        }
    }
}

fn shipped() -> Vec<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tasks");
    let mut found: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    found.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    found.sort();
    found
}

/// What robots move by, motors and walls included, has a unit.
#[test]
fn every_state_of_a_robot_has_a_unit() {
    for path in shipped() {
        let task = LoadedTask::load(&path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        for one in task.problem.tasks.iter().filter(|_| text.contains("kind = \"robot\"")) {
            for state in one.system.channels().states {
                assert!(!state.unit.is_empty(), "{}: {} has no unit", path.display(), state.name);
            }
        }
    }
}

#[test]
fn changed_task_robot_and_table_files_are_read_or_refused() {
    let (mut random, mut fine, mut count) = (Random(1), 0, 0);
    for path in shipped() {
        let sources = LoadedTask::load(&path).unwrap().sources;
        for number in 0..OF_A_TASK {
            let mut changed: Vec<Source> = sources.clone();
            let place = random.below(changed.len());
            for _ in 0..1 + random.below(3) {
                let mut text = std::mem::take(&mut changed[place].text);
                random.change(&mut text);
                changed[place].text = text;
            }
            let what = format!("{} {number}", path.display());
            fine += usize::from(read(&what, || LoadedTask::restore(&changed)));
            count += 1;
        }
    }
    assert!(count > 1500 && fine > count / 50 && fine < count, "{fine} of {count} were read");
}

#[test]
fn changed_results_are_read_or_refused() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tasks/two_mass_small.toml");
    let task = LoadedTask::load(&path).unwrap();
    let options = EvaluateOptions { rollouts: 2, trajectories: true, ..EvaluateOptions::default() };
    let evaluation = task.problem.evaluate(&task.phi, &options).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let made = Made::of(&task, Work::Evaluate(Default::default()));
    Folder::save(folder.path(), &made, &StudyResult::Evaluate(Box::new(EvaluateReport { evaluation }))).unwrap();
    let text = std::fs::read_to_string(folder.path().join(RESULT)).unwrap();
    let (mut random, mut fine) = (Random(2), 0);
    for number in 0..OF_A_RESULT {
        let mut changed = text.clone();
        random.change(&mut changed);
        std::fs::write(folder.path().join(RESULT), changed).unwrap();
        fine += usize::from(read(&format!("result {number}"), || Folder::load(folder.path())));
    }
    assert!(fine > 0 && fine < OF_A_RESULT, "{fine} were read");
}
