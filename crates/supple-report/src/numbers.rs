//! Numbers as people read them.

/// A number with five significant digits at most.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    if value == 0.0 {
        return "0".into();
    }
    // The exponent after rounding: 99999.7 is 100000.
    let scientific = format!("{value:.4e}");
    let Some((mantissa, exponent)) = scientific.split_once('e') else { return scientific };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let text = match exponent {
        -3..=6 => format!("{value:.*}", usize::try_from(4 - exponent).unwrap_or(0)),
        _ => format!("{}e{exponent}", trimmed(mantissa)),
    };
    let text = if !(-3..=6).contains(&exponent) { text } else { trimmed(&text).to_owned() };
    text.replace('-', "−")
}

/// Without zeros at the end that say nothing.
fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// A number with its unit, where it has one.
pub fn with_unit(value: f64, unit: &str) -> String {
    if unit.is_empty() { number(value) } else { format!("{} {unit}", number(value)) }
}

/// A number with its sign.
pub fn signed(value: f64) -> String {
    if value > 0.0 { format!("+{}", number(value)) } else { number(value) }
}

/// A change relative to where it began, such as `−48.8 %`; nothing where it has no meaning.
pub fn change(from: f64, to: f64) -> String {
    let percent = 100.0 * (to - from) / from.abs();
    if percent.is_finite() { format!("{percent:+.1} %").replace('-', "−") } else { "–".into() }
}

/// A name with a unit, for axes and table heads: `k1, N/m`.
pub fn labelled(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}, {unit}") }
}

/// Nats in bits.
pub fn bits(nats: f64) -> f64 {
    nats / std::f64::consts::LN_2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_keep_their_size() {
        for (value, text) in [
            (474.543_9, "474.54"),
            (250.0, "250"),
            (99_999.7, "100000"),
            (1e6, "1000000"),
            (1e7, "1e7"),
            (-0.001_234_567, "−0.0012346"),
            (1.5e-7, "1.5e−7"),
            (0.0, "0"),
            (f64::NAN, "–"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn changes_are_relative_to_the_start() {
        assert_eq!(change(474.544, 242.785), "−48.8 %");
        assert_eq!(change(-2.0, -1.0), "+50.0 %");
        assert_eq!(change(0.0, 1.0), "–");
    }
}
