//! Names, labels and numbers as they are set in print.

use supple_text::{exponent, printed_unit, raised, trimmed};

/// A name as it is printed: `k1` has an index, and `wall_variance` is two words.
pub fn name(name: &str) -> String {
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let short = (1..=2).contains(&stem.chars().count()) && stem.chars().all(char::is_alphabetic);
    if short && stem.len() < name.len() {
        return stem.to_owned() + &name[stem.len()..].chars().map(lowered).collect::<String>();
    }
    name.replace('_', " ")
}

/// A label with its unit in brackets, and the power of ten by which the axis numbers must be multiplied.
pub fn label(label: &str, unit: &str, exponent: i32) -> String {
    let factor = if exponent == 0 { String::new() } else { power(exponent) };
    let unit = printed_unit(unit);
    let inside = [factor, unit].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ");
    // Lines do not break within a unit.
    let inside = inside.replace(' ', "\u{a0}");
    match (label.is_empty(), inside.is_empty()) {
        (_, true) => label.to_owned(),
        (true, _) => format!("({inside})"),
        _ => format!("{label} ({inside})"),
    }
}

/// Ten to a power.
pub fn power(exponent: i32) -> String {
    "10".to_owned() + &raised(&exponent.to_string())
}

/// A number with `digits` decimals, with a true minus sign instead of a hyphen.
pub fn fixed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let zero = text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.');
    if zero { text.trim_start_matches('-').to_owned() } else { text.replace('-', "\u{2212}") }
}

/// A number with three significant digits, in scientific notation if it is very large or small.
pub fn typeset(value: f64) -> String {
    typeset_to(value, DIGITS)
}

/// Numbers of one scale, which are set with as many digits as it takes to tell one from the next.
pub fn typeset_all(values: &[f64]) -> Vec<String> {
    let texts = |digits: usize| values.iter().map(|value| typeset_to(*value, digits)).collect::<Vec<_>>();
    // Steps of a scale are round: as many digits as tell them apart show each of them whole.
    let are_whole = |digits: &usize| {
        let step = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(f64::INFINITY, f64::min);
        let off = |value: &f64| {
            let unit = 10f64.powi(exponent(*value, *digits) + 1 - *digits as i32);
            ((value / unit).round() * unit - value).abs()
        };
        values.iter().all(|value| off(value) <= 1e-3 * step)
    };
    texts((DIGITS..MOST_DIGITS).find(are_whole).unwrap_or(MOST_DIGITS))
}

/// Significant digits of a number by itself, and of one among others at most.
const DIGITS: usize = 3;
const MOST_DIGITS: usize = 9;

fn typeset_to(value: f64, significant: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { "\u{2013}".into() };
    }
    let exponent = exponent(value, significant);
    if (-3..5).contains(&exponent) {
        let digits = usize::try_from(significant as i32 - 1 - exponent).unwrap_or(0);
        let text = fixed(value, digits);
        return trimmed(&text).to_owned();
    }
    let mantissa = fixed(value / 10f64.powi(exponent), significant - 1);
    let mantissa = trimmed(&mantissa);
    if mantissa == "1" { power(exponent) } else { format!("{mantissa}\u{d7}{}", power(exponent)) }
}

/// The decimal exponent of a number after rounding to the printed digits.
pub fn exponent_of(value: f64) -> i32 {
    exponent(value, 3)
}

fn lowered(c: char) -> char {
    c.to_digit(10).and_then(|digit| char::from_u32(0x2080 + digit)).unwrap_or(c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_labels_and_numbers_are_set_as_in_print() {
        assert_eq!((name("k1").as_str(), name("wall_variance").as_str()), ("k₁", "wall variance"));
        assert_eq!((name("joint1").as_str(), name("xw").as_str(), name("12").as_str()), ("joint1", "xw", "12"));
        assert_eq!(label("variance", "m^2/s^2", 0), "variance (m²/s²)");
        assert_eq!(label("k₁", "N/m", 3), "k₁ (10³\u{a0}N/m)");
        assert_eq!((label("", "", 0).as_str(), label("time", "s", 0).as_str()), ("", "time (s)"));
        assert_eq!((fixed(-1.5, 1).as_str(), fixed(-0.001, 1).as_str()), ("−1.5", "0.0"));
        let shown = [0.0, 250.0, 0.05, 99_950.0, 1e-4, -2.5e-7, 135.912].map(typeset);
        assert_eq!(shown, ["0", "250", "0.05", "10⁵", "10⁻⁴", "−2.5×10⁻⁷", "136"]);
        assert_eq!(typeset_all(&[161.8, 162.0, 162.2]), ["161.8", "162", "162.2"]);
        assert_eq!(typeset_all(&[1.0005e5, 1.001e5]), ["1.0005×10⁵", "1.001×10⁵"]);
        assert_eq!(typeset_all(&[20.0, 50.0, 1000.0]), ["20", "50", "1000"]);
        assert_eq!(typeset_all(&[135.912]), ["136"], "a constant");
    }
}
