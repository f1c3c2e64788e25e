//! Patterns of names.

/// Whether a name matches a pattern in which `*` stands for any sequence of characters.
///
/// ```
/// use supple_model::document::matches;
///
/// assert!(matches("v.*", "v.elbow") && !matches("v.*", "q.elbow"));
/// ```
#[must_use]
pub fn matches(pattern: &str, name: &str) -> bool {
    let Some((head, tail)) = pattern.split_once('*') else { return pattern == name };
    let Some(rest) = name.strip_prefix(head) else { return false };
    (0..=rest.len()).filter(|&i| rest.is_char_boundary(i)).any(|i| matches(tail, &rest[i..]))
}
