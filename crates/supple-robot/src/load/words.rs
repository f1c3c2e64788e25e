//! Formatting of names and text from files in messages.

use std::borrow::Cow;

use supple_text::{nearest, quoted};

/// Message for files that must be expanded by a program first.
pub(super) const XACRO: &str = "this is a macro for the program xacro, not yet a robot";
/// Advice for [`XACRO`].
pub(super) const RUN_XACRO: &str = "run `xacro robot.xacro > robot.urdf` first";

/// Text shortened to one line for a message.
pub(super) fn clipped(text: &str) -> Cow<'_, str> {
    const MOST: usize = 60;
    let clipped = match text.char_indices().nth(MOST) {
        Some((end, _)) => Cow::Owned(format!("{}...", &text[..end])),
        None => Cow::Borrowed(text),
    };
    if clipped.contains(char::is_control) { clipped.replace(char::is_control, " ").into() } else { clipped }
}

/// A text for a message, short and in back quotes.
pub(super) fn shown(text: &str) -> String {
    format!("`{}`", clipped(text))
}

/// Names for a message, each shortened; only the first ten if there are many, but never omitting just one.
pub(super) fn listed<T: AsRef<str>>(names: &[T]) -> String {
    let most = supple_text::most(names.len(), 10);
    let shown: Vec<_> = names.iter().take(most).map(|name| clipped(name.as_ref())).collect();
    let rest = names.len() - most;
    if rest == 0 { quoted(&shown) } else { format!("{} and {rest} more", quoted(&shown)) }
}

/// Suggests the valid name most similar to an invalid one. Very long names are not compared.
pub(super) fn near<T: AsRef<str>>(found: &str, valid: &[T]) -> Option<String> {
    const LONGEST: usize = 100;
    let valid: Vec<_> = valid.iter().map(AsRef::as_ref).filter(|name| name.len() <= LONGEST).collect();
    if found.len() > LONGEST { None } else { nearest(found, &valid) }
}
