use std::fmt::Write;

use similar::TextDiff;
use supple::Level;
use supple::parameters::Scale;
use twox_hash::XxHash3_64;

use super::super::grid::Grid;
use super::super::{Axis, SweepOptions};
use crate::LoadedTask;

/// Values of an axis that are written out; of a longer one, its ends and a fingerprint.
const SHOWN: usize = 64;

/// What a sweep is: all that decides about its table.
pub(in super::super) struct Identity {
    /// In words and numbers, for people.
    pub text: String,
    /// Of the text.
    pub fingerprint: String,
}

impl Identity {
    /// Of a sweep of a task.
    pub fn of(task: &LoadedTask, options: &SweepOptions, grid: &Grid) -> Self {
        let mut text = String::new();
        // Vector instructions differ by rounding.
        let _ = writeln!(text, "instructions {}", format!("{:?}", Level::current()).to_lowercase());
        for axis in &options.axes {
            let _ = writeln!(text, "grid {}", axis_text(axis));
        }
        let SweepOptions { rollouts, starts, seed, .. } = options;
        let _ = writeln!(text, "rollouts {rollouts}\nstarts {starts}\nseed {seed}");
        for (index, (parameter, value)) in task.problem.parameters.iter().zip(&task.phi).enumerate() {
            if !grid.indices.contains(&index) {
                let _ = writeln!(text, "parameter {} = {value:?}", parameter.name);
            }
        }
        for (index, source) in task.sources.iter().enumerate() {
            let what = if index == 0 { "task file" } else { "file of the robot" };
            let _ = writeln!(text, "{what}:\n{}", source.text);
        }
        let fingerprint = fingerprint(text.as_bytes());
        Self { text, fingerprint }
    }

    /// How this sweep differs from the one of a text: a unified diff.
    pub fn difference(&self, kept: &str) -> String {
        let diff = TextDiff::from_lines(kept, &self.text);
        diff.unified_diff().context_radius(2).header("journal", "this sweep").to_string()
    }
}

/// A fingerprint of bytes, the same on every machine.
pub(super) fn fingerprint(bytes: &[u8]) -> String {
    format!("{:016x}", XxHash3_64::oneshot(bytes))
}

fn axis_text(axis: &Axis) -> String {
    let Axis { parameter, scale, values, .. } = axis;
    let scale = match scale {
        Scale::Linear => "linear",
        Scale::Log => "logarithmic",
    };
    let count = values.len();
    match &values[..] {
        [first, .., last] if count > SHOWN => {
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            let fingerprint = fingerprint(&bytes);
            format!("{parameter} ({scale}): {count} values from {first:?} to {last:?}, fingerprint {fingerprint}")
        }
        _ => format!("{parameter} ({scale}): {values:?}"),
    }
}
