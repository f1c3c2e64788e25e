//! Names of tasks and channels as identifiers and comments of C.

use supple::Channel;

/// A name as an identifier: letters, digits and `_`, the first one a letter.
pub fn identifier(name: &str) -> String {
    let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if plain.starts_with(|c: char| c.is_ascii_alphabetic()) { plain } else { format!("task_{plain}") }
}

/// Constants for the places of channels, all different: the prefix, then the channel's name.
pub fn constants(prefix: &str, channels: &[Channel]) -> Vec<String> {
    let mut found: Vec<String> = Vec::with_capacity(channels.len());
    for channel in channels {
        let letters =
            channel.name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' });
        let name = prefix.chars().chain(letters).collect::<String>();
        let numbered = (2..).map(|number| format!("{name}_{number}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|name| !found.contains(name));
        found.extend(free);
    }
    found
}

/// A text as a comment can hold it, on one line.
pub fn comment(text: &str) -> String {
    let plain: String = text.chars().map(|c| if c.is_control() || c == '\\' { ' ' } else { c }).collect();
    plain.replace("*/", "* /").replace("/*", "/ *")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_identifiers() {
        let cases = [("press", "press"), ("pick & place", "pick___place"), ("2nd", "task_2nd"), ("", "task_")];
        cases.iter().for_each(|(name, expected)| assert_eq!(identifier(name), *expected));
        assert_eq!(identifier("_a"), "task__a");
        assert_eq!(identifier("Tür"), "T_r");
    }

    #[test]
    fn constants_of_alike_names_differ() {
        let channels = ["a.b", "a b", "a_b"].map(|name| Channel::new(name, ""));
        assert_eq!(constants("X_Y_", &channels), ["X_Y_A_B", "X_Y_A_B_2", "X_Y_A_B_3"]);
    }

    #[test]
    fn comments_end_where_they_should() {
        assert_eq!(comment("a */ b\n/* c */*/"), "a * / b / * c * / * /");
        assert!(!comment("*/*/").contains("*/") && !comment("/*/").contains("/*"));
    }
}
