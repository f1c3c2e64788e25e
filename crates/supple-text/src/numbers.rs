//! Numbers as text: one function for each purpose.
//!
//! | for | function | 0.00001234567 | 474.5439 | 12345678 |
//! |---|---|---|---|---|
//! | messages: all digits | [`digits`] | `0.00001234567` | `474.5439` | `12345678` |
//! | data: all digits, for programs | [`exact`] | `1.234567e-5` | `474.5439` | `12345678` |
//! | sentences: few digits | [`short`] of 3 | `1.23e-5` | `475` | `1.23e7` |
//! | formulas: a fixed number of digits | [`padded`] to 3 | `1.23e-5` | `475` | `1.23e7` |
//! | tables in terminals | [`tabular`] | `1.2346e-5` | `474.544` | `1.2346e7` |
//! | pages | [`printed`] | `1.2346e−5` | `474.54` | `1.2346e7` |

/// A number in a message, with all of its digits. Very large and very small numbers have an exponent, so that nobody has
/// to count zeros.
///
/// ```
/// use supple_text::digits;
///
/// assert_eq!([digits(0.1), digits(1e-7)], ["0.1", "1e-7"]);
/// ```
#[must_use]
pub fn digits(number: f64) -> String {
    let short = number == 0.0 || !number.is_finite() || (1e-5..1e16).contains(&number.abs());
    if short { format!("{number}") } else { format!("{number:e}") }
}

/// A number for programs: a short text that parses back to the same number. Whole numbers have no decimal point.
///
/// ```
/// use supple_text::exact;
///
/// assert_eq!([exact(3.0), exact(1.0 / 3.0)], ["3", "0.3333333333333333"]);
/// ```
#[must_use]
pub fn exact(number: f64) -> String {
    let mut text = format!("{number:?}");
    if text.ends_with(".0") {
        text.truncate(text.len() - 2);
    }
    text
}

/// A number with at most `count` significant digits, at least 1.
///
/// ```
/// use supple_text::{padded, printed, short, tabular};
///
/// // The same number in a sentence, in a formula, in a table of a terminal and on a page.
/// let number = 474.54409;
/// assert_eq!([short(number, 3), padded(number, 5)], ["475", "474.54"]);
/// assert_eq!([tabular(number), printed(-number)], ["474.544", "−474.54"]);
/// ```
#[must_use]
pub fn short(number: f64, count: usize) -> String {
    let number = significant(number, count);
    match number.abs() {
        0.0 => "0".into(),
        1e-3..1e6 => format!("{number}"),
        _ => format!("{number:e}"),
    }
}

/// A number with exactly `count` significant digits, at least 1, including trailing zeros.
///
/// Example: [`short`].
#[must_use]
pub fn padded(number: f64, count: usize) -> String {
    let (power, after) = (exponent(number, count), count.saturating_sub(1));
    match after as i32 - power {
        decimals @ 0.. if power >= -3 => format!("{number:.*}", decimals as usize),
        _ => format!("{number:.after$e}"),
    }
}

/// A number in a terminal table: at most six significant digits, or five and an exponent.
///
/// Example: [`short`].
#[must_use]
pub fn tabular(number: f64) -> String {
    match exponent(number, 6) {
        _ if number == 0.0 => "0".into(),
        _ if !number.is_finite() => number.to_string(),
        power @ -3..=5 => trimmed(&format!("{number:.*}", (5 - power) as usize)).to_owned(),
        _ => format!("{number:.4e}"),
    }
}

/// The 95 % confidence interval of a mean, in words, with its ends written by `number`.
///
/// ```
/// use supple_text::{interval_95, short};
///
/// assert_eq!(interval_95([1.0, 2.0], |end| short(end, 2)), "95 % interval 1 to 2");
/// ```
#[must_use]
pub fn interval_95([lower, upper]: [f64; 2], number: impl Fn(f64) -> String) -> String {
    format!("95 % interval {} to {}", number(lower), number(upper))
}

/// What more of something saves of all there is, at a rate per unit: of one unit, or of a smaller power of ten if one unit would
/// save more than half of it, as a rate holds nearby only. Numbers are written by `number`.
///
/// ```
/// use supple_text::{saves, short};
///
/// let number = |number| short(number, 3);
/// assert_eq!(saves("cost", 2.5, 20.0, number), "+1 in cost saves 2.5 bits");
/// assert_eq!(saves("cost", 4034.0, 4.25, number), "+0.0001 in cost saves 0.403 bits");
/// ```
#[must_use]
pub fn saves(of: &str, rate: f64, all: f64, number: impl Fn(f64) -> String) -> String {
    let power = (0..12).find(|&power| rate * 10f64.powi(-power) <= 0.5 * all).filter(|_| all > 0.0).unwrap_or(0);
    let amount = 10f64.powi(-power);
    format!("+{amount} in {of} saves {} bits", number(rate * amount))
}

/// A number on a page, with at most five significant digits and a typographic minus sign; a dash if it is not
/// finite.
///
/// Example: [`short`].
#[must_use]
pub fn printed(number: f64) -> String {
    if !number.is_finite() {
        return "–".into();
    }
    let text = match exponent(number, 5) {
        _ if number == 0.0 => "0".into(),
        power @ -3..=6 => trimmed(&format!("{number:.*}", usize::try_from(4 - power).unwrap_or(0))).to_owned(),
        power => {
            let text = format!("{number:.4e}");
            let mantissa = text.split_once('e').map_or("", |(mantissa, _)| mantissa);
            format!("{}e{power}", trimmed(mantissa))
        }
    };
    text.replace('-', "−")
}

/// A number rounded to `count` significant digits, at least 1.
///
/// ```
/// use supple_text::{exponent, significant};
///
/// assert_eq!((significant(999.9, 3), exponent(999.9, 3)), (1000.0, 3));
/// ```
#[must_use]
pub fn significant(number: f64, count: usize) -> f64 {
    format!("{number:.*e}", count.saturating_sub(1)).parse().unwrap_or(number)
}

/// The power of ten of the leading digit after rounding to `count` significant digits: 999.9 counts as 1000
/// with three digits. 0 if the number is 0 or not finite.
///
/// Example: [`significant`].
#[must_use]
pub fn exponent(number: f64, count: usize) -> i32 {
    let text = format!("{number:.*e}", count.saturating_sub(1));
    text.split_once('e').and_then(|(_, power)| power.parse().ok()).unwrap_or(0)
}

/// The text of a number without insignificant trailing zeros.
///
/// ```
/// assert_eq!(supple_text::trimmed("2.500"), "2.5");
/// ```
#[must_use]
pub fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// Advice about an angle of more than a full turn, which was probably given in degrees.
///
/// ```
/// let advice = supple_text::degrees(-90.0);
/// assert_eq!(advice.as_deref(), Some("angles are in rad: -90 degrees are -1.5708 rad"));
/// ```
#[must_use]
pub fn degrees(angle: f64) -> Option<String> {
    // The margin allows for a full turn given with rounded digits.
    let is_angle = angle.is_finite() && angle.abs() > std::f64::consts::TAU + 0.01;
    is_angle.then(|| format!("angles are in rad: {} degrees are {} rad", digits(angle), short(angle.to_radians(), 5)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_in_degrees_get_advice() {
        assert_eq!(degrees(-90.0).as_deref(), Some("angles are in rad: -90 degrees are -1.5708 rad"));
        assert_eq!([0.0, -6.29, 3.0, f64::NAN, f64::INFINITY].map(degrees), [const { None }; 5]);
    }

    #[test]
    fn the_table_of_functions_is_right() {
        let [tiny, some, large] = [0.000_012_345_67, 474.543_9, 12_345_678.0];
        let of = |function: &dyn Fn(f64) -> String| [tiny, some, large].map(function);
        assert_eq!(of(&digits), ["0.00001234567", "474.5439", "12345678"]);
        assert_eq!(of(&exact), ["1.234567e-5", "474.5439", "12345678"]);
        assert_eq!(of(&|number| short(number, 3)), ["1.23e-5", "475", "1.23e7"]);
        assert_eq!(of(&|number| padded(number, 3)), ["1.23e-5", "475", "1.23e7"]);
        assert_eq!(of(&tabular), ["1.2346e-5", "474.544", "1.2346e7"]);
        assert_eq!(of(&printed), ["1.2346e−5", "474.54", "1.2346e7"]);
    }

    #[test]
    fn messages_have_all_digits() {
        let shown = [0.1, 1e-5, 1e-6, 1e15, 1e16, 1.0 / 3.0].map(digits);
        assert_eq!(shown, ["0.1", "0.00001", "1e-6", "1000000000000000", "1e16", "0.3333333333333333"]);
        assert_eq!([0.0, f64::INFINITY, f64::NAN].map(digits), ["0", "inf", "NaN"]);
    }

    #[test]
    fn data_are_exact_and_short() {
        let shown = [60.0, 0.1, 1e-4, 1e-7, 1e15, 1e16, 1e300, -2.5, 5e-324].map(exact);
        assert_eq!(shown, ["60", "0.1", "0.0001", "1e-7", "1000000000000000", "1e16", "1e300", "-2.5", "5e-324"]);
    }

    #[test]
    fn sentences_have_few_digits() {
        let shown = [0.12345, 5.0, -0.0, 1234.5, 2.5e-7, 999_999.9].map(|number| short(number, 3));
        assert_eq!(shown, ["0.123", "5", "0", "1230", "2.5e-7", "1e6"]);
        assert_eq!([999_999.4, 1e-3, -2.0].map(|number| short(number, 6)), ["999999", "0.001", "-2"]);
    }

    #[test]
    fn formulas_show_zeros_that_count() {
        let shown = [0.1, 5.0, 9.996, 123.4, 999.7, 0.001, 0.000_9].map(|number| padded(number, 3));
        assert_eq!(shown, ["0.100", "5.00", "10.0", "123", "1.00e3", "0.00100", "9.00e-4"]);
    }

    #[test]
    fn tables_are_short_and_keep_the_size() {
        let shown = [0.0, 474.543_9, 99_999.97, 999_999.7, 250.0, -0.001_234_567, 1.5e-7].map(tabular);
        assert_eq!(shown, ["0", "474.544", "100000", "1.0000e6", "250", "-0.00123457", "1.5000e-7"]);
        assert_eq!(tabular(f64::NAN), "NaN");
    }

    #[test]
    fn pages_are_short_and_keep_the_size() {
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
            assert_eq!(printed(value), text);
        }
    }
}
