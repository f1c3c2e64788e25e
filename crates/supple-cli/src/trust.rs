//! Comparison of roll-outs with predictions.

use std::fmt::Write;

use supple::simulate::{FinerSteps, MonteCarlo};
use supple::{Evaluation, Trust};

use crate::tables::number;

/// Table rows: information, costs and filter consistency found in roll-outs of a task, which keeps this cost limit, if any.
pub fn rows(sampled: &MonteCarlo, kept: Option<f64>) -> Vec<(&'static str, String, String)> {
    let mut rows = Vec::new();
    if let Some(bits) = sampled.realised_bits {
        let note =
            bits.interval_95.map_or_else(|| "bits".to_owned(), |interval| format!("bits, {}", between(interval)));
        rows.push(("sampled information", number(bits.mean), note));
    }
    if let Some(finer) = &sampled.finer {
        let FinerSteps { times, rollouts, diverged, cost_mean, own_cost_mean, .. } = *finer;
        let above = kept.filter(|limit| cost_mean > *limit).map(|limit| format!("; above the limit {}", number(limit)));
        let note = match diverged {
            0 => format!(
                "plant with {times} times finer steps; {rollouts} roll-outs; {} on the task's steps{}",
                number(own_cost_mean),
                above.unwrap_or_default()
            ),
            _ => format!("plant of {times} times finer steps; {diverged} of {rollouts} roll-outs diverged"),
        };
        let cost = if diverged == 0 { number(cost_mean) } else { "none".to_owned() };
        rows.push(("cost on finer steps", cost, note));
        if let (Some(bits), Some(more)) = (finer.realised_bits, finer.bits_difference) {
            let own = number(bits.mean - more.mean);
            let note = format!("from a filter with finer steps; {own} on the task's steps");
            rows.push(("bits on finer steps", number(bits.mean), note));
        }
        if let Some(found) = finer.consistency {
            let note = "of the filter with the task's own steps".to_owned();
            rows.push(("consistency on finer steps", format!("{:.3}", found.mean), note));
        }
    }
    if let Some(found) = sampled.consistency {
        let band =
            format!("squared innovations over expected; 95 % band {:.3} to {:.3}", found.lower_95, found.upper_95);
        rows.push(("filter consistency", format!("{:.3}", found.mean), band));
    }
    rows
}

/// The 95 % confidence interval of a mean.
pub fn between(interval: [f64; 2]) -> String {
    supple_text::interval_95(interval, number)
}

/// The verdict, and its reasons.
pub fn line(trust: &Trust) -> String {
    named("Roll-outs", trust)
}

/// The same, of roll-outs that have a name.
fn named(rollouts: &str, trust: &Trust) -> String {
    format!("{rollouts}: {trust}.")
}

/// What speaks against the plan of a task, about which other numbers are computed: warnings and the verdict of roll-outs.
pub fn of_plan(rollouts: &str, warnings: &[String], trust: Option<&Trust>) -> String {
    let warnings = warnings.iter().map(|warning| format!("Warning: {warning}.\n"));
    warnings.chain(trust.map(|trust| named(rollouts, trust) + "\n")).collect()
}

/// The verdicts at the start and at the optimum of a design.
pub fn of_design(start: &Evaluation, optimum: &Evaluation) -> String {
    let mut text = String::new();
    for (before, after) in start.tasks.iter().zip(&optimum.tasks) {
        if let (Some(from), Some(to)) = (&before.trust, &after.trust) {
            if from == to {
                let _ = writeln!(text, "{}, at start and optimum. {}", after.name, line(to));
            } else {
                let _ = writeln!(text, "{}, at start. {}", before.name, line(from));
                let _ = writeln!(text, "{}, at optimum. {}", after.name, line(to));
            }
        }
    }
    if !text.is_empty() {
        text.push('\n');
    }
    text
}
