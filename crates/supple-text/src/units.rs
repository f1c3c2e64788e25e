//! Units as text.
//!
//! Files, machine-readable results and terminal tables write units as the task file does, such as `m^2/s^2`, so that
//! they can be copied back into a file, like the numbers beside them. Pages and figures use [`printed_unit`].

/// A unit on a page or in a figure: `m^2/s^2` becomes `m²/s²`, and `N m` becomes `N·m`, which does not break across lines.
///
/// Only whole-number powers after `^` or `**` are converted; others stay as written.
///
/// ```
/// use supple_text::{printed_unit, raised};
///
/// assert_eq!([printed_unit("m^2/s^2"), raised("-2")], ["m²/s²", "⁻²"]);
/// ```
#[must_use]
pub fn printed_unit(unit: &str) -> String {
    let plain = unit.replace("**", "^").replace('*', " ");
    let mut out = String::new();
    let mut rest = plain.trim();
    while let Some(c) = rest.chars().next() {
        let after = &rest[c.len_utf8()..];
        rest = match c {
            '^' => match whole_power(after) {
                Some((power, behind)) => {
                    out.push_str(&raised(power));
                    behind
                }
                None => {
                    out.push(c);
                    after
                }
            },
            _ if c.is_whitespace() => {
                let behind = after.trim_start();
                if !out.ends_with(['/', '(', '\u{b7}']) && !behind.starts_with(['/', ')', '^', '\u{b7}']) {
                    out.push('\u{b7}');
                }
                behind
            }
            _ => {
                out.push(c);
                after
            }
        };
    }
    out
}

/// Text with its digits and minus signs as superscripts: `-2` becomes `⁻²`.
///
/// Example: [`printed_unit`].
#[must_use]
pub fn raised(text: &str) -> String {
    let one = |c: char| match c {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        _ => c.to_digit(10).and_then(|digit| char::from_u32(0x2070 + digit)).unwrap_or(c),
    };
    text.chars().map(one).collect()
}

/// The whole number that a text begins with, and what follows; `None` if it begins with another number.
fn whole_power(text: &str) -> Option<(&str, &str)> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let count = digits.chars().take_while(char::is_ascii_digit).count();
    let (power, behind) = text.split_at(text.len() - digits.len() + count);
    (count > 0 && !behind.starts_with(['.', 'e'])).then_some((power, behind))
}

#[cfg(test)]
mod tests {
    use super::printed_unit;

    #[test]
    fn units_of_pages_have_raised_powers_and_products_that_hold_together() {
        let pairs = [
            ("m^2/s^2", "m²/s²"),
            ("kg*m^-1", "kg·m⁻¹"),
            ("(N m)^2", "(N·m)²"),
            ("N m s/rad", "N·m·s/rad"),
            ("N m/rad^10", "N·m/rad¹⁰"),
            ("kg m**2 / s", "kg·m²/s"),
            (" N * m ", "N·m"),
            ("N·m", "N·m"),
            ("m/s²", "m/s²"),
            ("V/Hz^0.5", "V/Hz^0.5"),
            ("V/Hz^(1/2)", "V/Hz^(1/2)"),
            ("m^", "m^"),
            ("×", "×"),
            ("", ""),
        ];
        for (written, shown) in pairs {
            assert_eq!(printed_unit(written), shown, "{written}");
            assert_eq!(printed_unit(shown), shown, "{shown} once more");
        }
    }
}
