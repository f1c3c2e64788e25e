//! Compares texts with numbers in them.

/// Panics where two texts differ in anything but spaces at line ends or the last digit of a number.
pub fn assert_same_text(shown: &str, given: &str) {
    let (shown_lines, given_lines): (Vec<_>, Vec<_>) =
        (shown.trim_end().lines().collect(), given.trim_end().lines().collect());
    assert_eq!(shown_lines.len(), given_lines.len(), "the text has another number of lines:\n{given}");
    for (shown, given) in shown_lines.into_iter().zip(given_lines) {
        let (shown_parts, given_parts) = (parts(shown), parts(given));
        let same = shown_parts.len() == given_parts.len()
            && shown_parts.iter().zip(&given_parts).all(|(shown, given)| same_part(shown, given));
        assert!(same, "shown:  {shown}\ngiven: {given}");
    }
}

/// A line cut into numbers and what stands between them, without spaces.
pub fn parts(line: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    let mut in_number = None;
    for (place, c) in line.char_indices() {
        let number = c.is_ascii_digit()
            || c == '.' && line[place + 1..].starts_with(|next: char| next.is_ascii_digit()) && in_number == Some(true);
        if !c.is_whitespace() {
            match parts.last_mut() {
                Some(part) if in_number == Some(number) => part.push(c),
                _ => parts.push(c.into()),
            }
        }
        in_number = (!c.is_whitespace()).then_some(number);
    }
    parts
}

fn same_part(shown: &str, given: &str) -> bool {
    match (shown.parse::<f64>(), given.parse::<f64>()) {
        (Ok(a), Ok(b)) => {
            let digits = |text: &str| text.split_once('.').map_or(0, |(_, digits)| digits.len());
            let unit = 0.1_f64.powi(digits(shown).max(digits(given)) as i32);
            (a - b).abs() <= 1.001 * unit || (a - b).abs() <= 1e-4 * a.abs()
        }
        _ => shown == given,
    }
}
