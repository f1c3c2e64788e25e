//! A bounded run of all targets with a stable compiler: everything in the corpora and in the repository, and seeded
//! mutations of it. `SUPPLE_FUZZ_INPUTS` says how many mutations of each target there are, and `SUPPLE_FUZZ_SEED` which.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rand::seq::IndexedRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use supple::Stop;
use supple_fuzz::{TARGETS, home};
use supple_study::pareto::ParetoOptions;
use supple_study::{JOURNAL, LoadedTask, Progress, Watch};

/// Inputs of each target where nothing else is said.
const INPUTS: usize = 2000;
/// No input may take longer.
const PATIENCE: Duration = Duration::from_secs(20);

/// Files that are seeds of a target: of its corpus, and of the repository.
fn seeds(target: &str) -> Vec<Vec<u8>> {
    let own = |folder: &str, endings: &[&str]| {
        let folder = home().join(folder);
        let mut found = Vec::new();
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            let ending = path.extension().map(|ending| ending.to_string_lossy().into_owned()).unwrap_or_default();
            if path.is_file() && (endings.is_empty() || endings.contains(&ending.as_str())) {
                found.push(path);
            }
        }
        found.sort();
        found.iter().map(|path: &std::path::PathBuf| std::fs::read(path).unwrap()).collect::<Vec<_>>()
    };
    let mut all = own(&format!("corpus/{target}"), &[]);
    match target {
        "task" => all.extend(own("../tasks", &["toml"])),
        "robot" => all.extend(own("../models", &["urdf", "sdf", "xml"])),
        "journal" => all.push(interrupted()),
        "table" => all.extend(own("../tasks", &["csv"])),
        _ => {}
    }
    assert!(!all.is_empty(), "{target} has no seeds");
    all
}

/// Stops a study after its first part.
#[derive(Default)]
struct StopSoon(AtomicBool);

impl Progress for StopSoon {
    fn begin(&self, _: &str, _: u64, _: u64) {}

    fn advance(&self, _: u64) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// The journal of a study that was interrupted.
fn interrupted() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let task = LoadedTask::load(&home().join("../tasks/two_mass_small.toml")).unwrap();
    let soon = StopSoon::default();
    let watch = Watch { progress: &soon, stop: Stop::when(&soon.0) };
    let options = ParetoOptions { points: 4, starts: 1, seed: 0 };
    let _ = supple_study::pareto::run(&task, &options, Some(folder.path()), watch);
    std::fs::read(folder.path().join(JOURNAL)).unwrap()
}

/// Words that are likely to be read as something.
const WORDS: &[&str] = &[
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "99999999999999999999",
    "\"\"",
    "[]",
    "{}",
    "[[",
    "]]",
    "=",
    ",",
    "\n",
    "\"",
    "k",
    "true",
    "null",
    "(",
    ")",
    "^",
    "/",
    "\\",
    "<",
    ">",
    "&lt;",
    "\u{0}",
    "\u{202e}",
    "é",
];

/// One mutation of a text or bytes.
fn mutated(seeds: &[Vec<u8>], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut data = seeds.choose(random).unwrap().clone();
    for _ in 0..random.random_range(1..=4) {
        if data.is_empty() {
            data = seeds.choose(random).unwrap().clone();
            continue;
        }
        let place = random.random_range(0..data.len());
        let end = (place + random.random_range(1..=16)).min(data.len());
        match random.random_range(0..8) {
            0 => data[place] = random.random(),
            1 => data[place] ^= 1 << random.random_range(0..8),
            2 => drop(data.drain(place..end)),
            3 => data.truncate(place),
            4 => {
                let part = data[place..end].to_vec();
                data.splice(place..place, part);
            }
            5 => drop(data.splice(place..end, WORDS.choose(random).unwrap().bytes())),
            6 => replace_number(&mut data, random),
            _ => {
                let other = seeds.choose(random).unwrap();
                let from = random.random_range(0..=other.len());
                let to = (from + random.random_range(0..=64)).min(other.len());
                data.splice(place..end, other[from..to].iter().copied());
            }
        }
    }
    data
}

/// Puts another number in the place of one.
fn replace_number(data: &mut Vec<u8>, random: &mut impl Rng) {
    let digits: Vec<usize> = (0..data.len()).filter(|&i| data[i].is_ascii_digit()).collect();
    let Some(&place) = digits.choose(random) else { return };
    let is_part = |byte: u8| byte.is_ascii_digit() || b".eE+-".contains(&byte);
    let first = (0..place).rev().take_while(|&i| is_part(data[i])).last().unwrap_or(place);
    let last = (place..data.len()).take_while(|&i| is_part(data[i])).last().unwrap_or(place);
    let numbers = ["0", "1", "-1", "2", "1e-9", "1e9", "1e300", "0.5", "-0.0", "3", "1000000"];
    data.splice(first..=last, numbers.choose(random).unwrap().bytes());
}

fn run(target: &str, inputs: usize) {
    let (_, check) = TARGETS.into_iter().find(|(name, _)| *name == target).unwrap();
    let (seeds, mut random) = (seeds(target), ChaCha8Rng::seed_from_u64(number("SUPPLE_FUZZ_SEED").unwrap_or(7)));
    let mut slowest = Duration::ZERO;
    let mut try_one = |data: &[u8]| {
        let before = Instant::now();
        let found = std::panic::catch_unwind(|| check(data));
        slowest = slowest.max(before.elapsed());
        let failed = if found.is_err() { "panics" } else { "hangs" };
        if found.is_err() || before.elapsed() > PATIENCE {
            let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{target}.input"));
            std::fs::write(&path, data).unwrap();
            panic!("{target} {failed}: {}", path.display());
        }
    };
    seeds.iter().for_each(|seed| try_one(seed));
    for _ in 0..inputs {
        try_one(&mutated(&seeds, &mut random));
    }
    println!("{target}: {} seeds, {inputs} mutations, the slowest took {slowest:.2?}", seeds.len());
}

/// A number from the environment.
fn number<T: std::str::FromStr>(name: &str) -> Option<T> {
    std::env::var(name).ok().and_then(|text| text.parse().ok())
}

fn inputs() -> usize {
    number("SUPPLE_FUZZ_INPUTS").unwrap_or(INPUTS)
}

#[test]
fn tasks() {
    run("task", inputs());
}

#[test]
fn robots() {
    run("robot", inputs());
}

#[test]
fn meshes() {
    run("mesh", inputs());
}

#[test]
fn tables() {
    run("table", inputs());
}

#[test]
fn expressions() {
    run("expression", inputs());
}

#[test]
fn results() {
    run("result", inputs());
}

#[test]
fn journals() {
    run("journal", inputs());
}

#[test]
fn requests() {
    run("request", inputs());
}
