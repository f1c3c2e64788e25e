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
    supple_text::short(value, 6)
}

/// The entries of a vector.
pub fn vector(vector: [f64; 3]) -> String {
    vector.map(number).join(" ")
}
