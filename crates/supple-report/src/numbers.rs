//! Numbers and units as people read them.

/// A number with five significant digits at most.
pub use supple_text::printed as number;
/// A unit as it is printed.
pub use supple_text::printed_unit as unit;

/// A number with its unit, where it has one.
pub fn with_unit(value: f64, unit_text: &str) -> String {
    if unit_text.is_empty() { number(value) } else { format!("{} {}", number(value), unit(unit_text)) }
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
pub fn labelled(name: &str, unit_text: &str) -> String {
    if unit_text.is_empty() { name.to_owned() } else { format!("{name}, {}", unit(unit_text)) }
}

/// Nats in bits.
pub fn bits(nats: f64) -> f64 {
    nats / std::f64::consts::LN_2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_relative_to_the_start() {
        assert_eq!(change(474.544, 242.785), "−48.8 %");
        assert_eq!(change(-2.0, -1.0), "+50.0 %");
        assert_eq!(change(0.0, 1.0), "–");
    }
}
