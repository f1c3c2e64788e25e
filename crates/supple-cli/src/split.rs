//! Causes of the change in measured information.

use std::fmt::Write;

use supple::design::Split;

/// One line per task.
pub fn of_design(split: &[Split]) -> String {
    let mut text = String::new();
    for of in split.iter().filter(|of| of.total_bits != 0.0) {
        let parts = [
            ("sensor sensitivity", of.sensors_bits),
            ("how uncertainty propagates", of.uncertainty_bits),
            ("change of the plan", of.plan_bits),
            ("jumps to other local minima", of.jumps_bits),
        ];
        let shown = parts.iter().filter(|(_, bits)| bits.abs() > 1e-4 * of.total_bits.abs());
        let shown: Vec<String> = shown.map(|(name, bits)| format!("{bits:+.2} from {name}")).collect();
        let _ = writeln!(
            text,
            "{}: measured information changes by {:+.2} bits: {}.",
            of.task,
            of.total_bits,
            shown.join(", ")
        );
        if of.jumps_bits.abs() > 1e-2 * of.total_bits.abs() {
            let _ = writeln!(
                text,
                "Its plans at start and optimum are different local minima, so that its cost does not change by the parameters \
                 alone: `supple evaluate --branches 24` may find a cheaper plan at the start."
            );
        }
    }
    if !text.is_empty() {
        text.push('\n');
    }
    text
}
