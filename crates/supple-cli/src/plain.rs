//! Text of others, safe to print.

use std::borrow::Cow;

/// Text without what a terminal or a reader would take for commands: titles, names and messages may come from files of others.
/// Control characters but for line breaks and tabs, and those that change the direction of text, become `\u{fffd}`.
pub fn plain(text: &str) -> Cow<'_, str> {
    let is_command = |c: char| {
        c.is_control() && !matches!(c, '\n' | '\t') || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if text.contains(is_command) { text.replace(is_command, "\u{fffd}").into() } else { text.into() }
}
