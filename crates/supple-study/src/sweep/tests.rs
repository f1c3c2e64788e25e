#![allow(clippy::unwrap_used)]

use std::path::Path;

use super::*;

/// The small shipped task.
pub fn task() -> LoadedTask {
    LoadedTask::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks/two_mass_small.toml"), &[]).unwrap()
}

/// A plain sweep over axes.
pub fn options(task: &LoadedTask, axes: &[&str]) -> SweepOptions {
    let axes = axes.iter().map(|axis| Axis::parse(axis, task).unwrap()).collect();
    SweepOptions { axes, rollouts: 0, starts: 0, seed: 0 }
}
