//! Angles of a task file that are probably in degrees.

use supple_model::document::{Content, Document, Place, Spanned};
use supple_text::{FileError, degrees};

/// Keys of roll, pitch and yaw.
const KEYS: [&str; 2] = ["rpy", "reference"];

/// A warning for each roll, pitch and yaw of a file of which an angle is more than a full turn.
pub(super) fn in_degrees(document: &Document) -> Vec<String> {
    let mut warnings = Vec::new();
    if let Some(root) = document.get(&[]) {
        search(document, root, &mut Vec::new(), &mut warnings);
    }
    warnings
}

/// Searches a value at a place of the file.
fn search<'a>(
    document: &Document,
    value: &'a Spanned<Content<'a>>,
    at: &mut Vec<Place<'a>>,
    warnings: &mut Vec<String>,
) {
    let (mut tables, mut lists) = (Vec::new(), Vec::new());
    match value.get_ref() {
        Content::Table(table) => tables.extend(table.iter().map(|(key, value)| (Place::Key(key.get_ref()), value))),
        Content::List(list) => {
            if let Some(advice) = is_turn(at).then(|| list.iter().find_map(|entry| degrees(number(entry)?))).flatten() {
                let message = "an angle is more than a full turn";
                warnings.push(FileError { help: Some(advice), ..document.error(at, message) }.to_string());
            }
            lists.extend(list.iter().enumerate().map(|(index, value)| (Place::Index(index), value)));
        }
        _ => {}
    }
    for (place, value) in tables.into_iter().chain(lists) {
        at.push(place);
        search(document, value, at, warnings);
        at.pop();
    }
}

/// Whether the value at a place is a roll, pitch and yaw.
fn is_turn(at: &[Place]) -> bool {
    matches!(at.last(), Some(Place::Key(key)) if KEYS.contains(key))
}

/// A number that is not an expression.
fn number(value: &Spanned<Content>) -> Option<f64> {
    match value.get_ref() {
        Content::Whole { digits: number, .. } | Content::Decimal(number) => number.parse().ok(),
        _ => None,
    }
}
