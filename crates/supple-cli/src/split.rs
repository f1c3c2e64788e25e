//! Causes of the change in measured information.

use std::fmt::Write;

use supple::design::Split;

/// Changes below this show as 0, bits.
const SHOWN: f64 = 5e-3;

/// One line per task whose information changes.
pub fn of_design(split: &[Split]) -> String {
    let mut text = String::new();
    for of in split {
        let parts = [
            ("sensor sensitivity", of.sensors_bits),
            ("how uncertainty propagates", of.uncertainty_bits),
            ("change of the plan", of.plan_bits),
            ("jumps to other local minima", of.jumps_bits),
        ];
        if parts.iter().all(|(_, bits)| bits.abs() < SHOWN) {
            continue;
        }
        let shown = parts.iter().filter(|(_, bits)| bits.abs() > 1e-4 * of.total_bits.abs());
        let shown: Vec<String> = shown.map(|(name, bits)| format!("{bits:+.2} from {name}")).collect();
        let _ = writeln!(
            text,
            "{}: measured information changes by {:+.2} bits: {}.",
            of.task,
            of.total_bits,
            shown.join(", ")
        );
        if of.jumps_bits.abs() > SHOWN.max(1e-2 * of.total_bits.abs()) {
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

#[cfg(test)]
mod tests {
    use supple::design::Split;

    use super::of_design;

    fn text(plan_bits: f64, jumps_bits: f64) -> String {
        let total_bits = plan_bits + jumps_bits;
        of_design(&[Split { task: "press".to_owned(), total_bits, plan_bits, jumps_bits, ..Split::default() }])
    }

    #[test]
    fn what_shows_as_nothing_is_not_told() {
        // A search that ends where it began, up to rounding.
        assert_eq!(text(0.0, 1e-12), "");
        let said = text(1.0, 1e-12);
        assert!(said.contains("by +1.00 bits: +1.00 from change of the plan.") && !said.contains("minima"), "{said}");
        // Causes that cancel are told.
        let said = text(1.0, -1.0);
        assert!(
            said.contains("+0.00 bits: +1.00 from change of the plan, -1.00 from jumps") && said.contains("24"),
            "{said}"
        );
    }
}
