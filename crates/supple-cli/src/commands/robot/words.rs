//! Names and numbers of robots in text.

/// Characters of a name that are shown.
const LONGEST: usize = 60;

/// A name in one line, and short.
pub fn name(name: &str) -> String {
    let mut short: String = name.chars().take(LONGEST).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if short.len() < name.len() {
        short.push_str("...");
    }
    short
}

/// A number with at most six significant digits.
pub fn number(value: f64) -> String {
    let value: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    match f64::abs(value) {
        0.0 => "0".into(),
        1e-3..1e6 => value.to_string(),
        _ => format!("{value:e}"),
    }
}
