//! What made the results.

use maud::{Markup, html};
use supple_study::Made;

use super::Context;
use crate::html::{table, words};

/// Bytes of a file up to which its text is in the page.
const LONGEST: usize = 100_000;

/// Commands, versions, seeds and files.
pub fn section(context: &mut Context) -> Option<Markup> {
    let part = context.part;
    let head = words(["folder", "command", "version", "seed"]);
    let rows: Vec<Vec<String>> = part
        .folders
        .iter()
        .map(|(name, folder)| {
            let made = &folder.made;
            vec![name.clone(), command(made), made.supple.clone(), made.seed.to_string()]
        })
        .collect();
    Some(html! {
        (table("Commands", &head, &rows))
        @for source in part.sources {
            details {
                summary { (source.path) }
                @if source.text.len() <= LONGEST {
                    pre tabindex="0" { (source.text) }
                } @else {
                    p { "The file has " (source.text.len()) " bytes and is omitted here; the result folders contain it." }
                }
            }
        }
    })
}

/// The command line that made a result; what Python was asked where there is none.
fn command(made: &Made) -> String {
    if made.arguments.is_empty() {
        return format!("{} in Python", made.command);
    }
    let words = std::iter::once("supple").chain(made.arguments.iter().map(String::as_str));
    words.map(quoted).collect::<Vec<_>>().join(" ")
}

/// An argument as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "-_./=:,+@%".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn arguments_can_be_pasted_into_a_shell() {
        assert_eq!(quoted("--set"), "--set");
        assert_eq!(quoted("k 1"), "'k 1'");
        assert_eq!(quoted("it's"), "'it'\\''s'");
        assert_eq!(quoted(""), "''");
    }
}
