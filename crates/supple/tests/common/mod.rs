//! What several tests share.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

pub mod bound;
pub mod reference;
pub mod same_text;

use std::path::{Path, PathBuf};

use supple::{Matrices, Problem};

/// A file of the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

/// A shipped task.
pub fn shipped(name: &str) -> Problem {
    supple_file::load(repository("tasks").join(name)).unwrap_or_else(|error| panic!("{error}"))
}

/// All files in `tasks`: what walks them needs no line for a new one.
pub fn task_files() -> Vec<String> {
    let entries = std::fs::read_dir(repository("tasks")).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.retain(|name| name.ends_with(".toml"));
    names.sort();
    names
}

/// All parameters of a problem, the first ones as given and the others at their initial values.
pub fn starting_with(problem: &Problem, first: &[f64]) -> Vec<f64> {
    let mut phi = problem.parameters.initial();
    phi[..first.len()].copy_from_slice(first);
    phi
}

/// Numbers of a JSON array.
pub fn numbers(value: &serde_json::Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Controls with one entry per step.
pub fn controls(values: &[f64]) -> Matrices {
    let mut controls = Matrices::vectors(values.len(), 1);
    for (t, &value) in values.iter().enumerate() {
        controls.vector_mut(t)[0] = value;
    }
    controls
}

/// A shipped task with lines after those of its last task.
pub fn shipped_with(name: &str, lines: &str) -> Problem {
    let path = repository("tasks").join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    supple_file::parse(&format!("{text}\n{lines}"), path.to_str().unwrap()).unwrap_or_else(|error| panic!("{error}"))
}
