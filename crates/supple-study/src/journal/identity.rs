use std::fmt::Write;

use imara_diff::{Algorithm, BasicLineDiffPrinter, Diff, InternedInput, UnifiedDiffConfig};
use supple::Level;
use twox_hash::XxHash3_64;

use crate::LoadedTask;

/// What a study is: all that decides about its result.
pub(crate) struct Identity {
    /// What it is called in messages: a sweep.
    pub kind: &'static str,
    /// In words and numbers, for people.
    pub text: String,
    /// Of the text.
    pub fingerprint: String,
}

impl Identity {
    /// Of a study of a task: its options, one per line, and the parameters that these set themselves.
    pub fn of(kind: &'static str, task: &LoadedTask, options: &str, set: &[usize]) -> Self {
        let mut text = format!("study {kind}\n");
        // Vector instructions differ by rounding.
        let _ = writeln!(text, "instructions {}", format!("{:?}", Level::current()).to_lowercase());
        text += options;
        for (index, (parameter, value)) in task.problem.parameters.iter().zip(&task.phi).enumerate() {
            if !set.contains(&index) {
                let _ = writeln!(text, "parameter {} = {value:?}", parameter.name);
            }
        }
        for (index, source) in task.sources.iter().enumerate() {
            let what = if index == 0 { "task file" } else { "file of the robot" };
            let _ = writeln!(text, "{what}:\n{}", source.text);
        }
        let fingerprint = fingerprint(text.as_bytes());
        Self { kind, text, fingerprint }
    }

    /// How this study differs from the one of a text: a unified diff.
    pub fn difference(&self, kept: &str) -> String {
        let lines = InternedInput::new(kept, self.text.as_str());
        let mut diff = Diff::compute(Algorithm::Myers, &lines);
        diff.postprocess_lines(&lines);
        let mut around = UnifiedDiffConfig::default();
        around.context_len(2);
        let printer = BasicLineDiffPrinter(&lines.interner);
        format!("--- journal\n+++ this study\n{}", diff.unified_diff(&printer, around, &lines))
    }
}

/// A fingerprint of bytes, the same on every machine.
pub(crate) fn fingerprint(bytes: &[u8]) -> String {
    format!("{:016x}", XxHash3_64::oneshot(bytes))
}
