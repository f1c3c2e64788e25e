//! What a file says that is not modelled, or looks like a mistake: each once.

use std::collections::HashMap;

use super::words::{listed, near, shown};
use super::xml::Element;

/// Kinds of warnings, at most; further kinds are counted.
const MOST_KINDS: usize = 100;

/// Warnings of one file, in the order in which they first arose.
#[derive(Default)]
pub(super) struct Warnings {
    kinds: Vec<Kind>,
    /// By tag, or by the text of a warning, the index in `kinds`.
    index: HashMap<String, usize>,
    /// Warnings of kinds beyond the limit.
    beyond: usize,
}

/// A kind of warning.
struct Kind {
    text: Text,
    count: usize,
    /// Where the first one is: `line 5`.
    place: String,
}

/// What is said.
enum Text {
    /// Elements of this tag are ignored.
    Ignored(String),
    /// Another thing is: what, and what it is that there are more of.
    Note(String),
}

impl Warnings {
    /// An element that is known and not modelled.
    pub(super) fn ignore(&mut self, element: Element) {
        let tag = element.tag();
        self.add(format!("<{tag}>"), element, || Text::Ignored(shown(tag)));
    }

    /// An element that is not known, where `valid` are: most often a misspelt one.
    pub(super) fn unknown<T: AsRef<str>>(&mut self, element: Element, valid: &[T]) {
        let (tag, within) = (element.tag(), element.parent().map_or("", |parent| parent.tag()));
        self.add(format!("<{within}> <{tag}>"), element, || {
            let valid = near(tag, valid).unwrap_or_else(|| format!("known are {}", listed(valid)));
            Text::Note(format!("{} in {} is not known and is ignored; {valid}", shown(tag), shown(within)))
        });
    }

    /// An attribute that is known and not modelled.
    pub(super) fn ignore_attribute(&mut self, element: Element, attribute: &str) {
        self.add(format!("{}@{attribute}", element.tag()), element, || {
            Text::Note(format!("attribute {} of {} is ignored", shown(attribute), shown(element.tag())))
        });
    }

    /// Another warning about an element. Those of the same `kind` are counted, and the text of the first one is kept:
    /// a sentence without a dot.
    pub(super) fn note(&mut self, kind: &str, element: Element, text: impl FnOnce() -> String) {
        self.add(format!("!{kind}"), element, || Text::Note(format!("{}: {}", element.key(), text())));
    }

    fn add(&mut self, key: String, element: Element, text: impl FnOnce() -> Text) {
        if let Some(kind) = self.index.get(&key).and_then(|&index| self.kinds.get_mut(index)) {
            kind.count += 1;
        } else if self.kinds.len() < MOST_KINDS {
            self.index.insert(key, self.kinds.len());
            self.kinds.push(Kind { text: text(), count: 1, place: element.place() });
        } else {
            self.beyond += 1;
        }
    }

    /// The warnings as sentences.
    pub(super) fn into_texts(self) -> Vec<String> {
        let text = |Kind { text, count, place }| match (text, count) {
            (Text::Ignored(tag), 1) => format!("element {tag} is ignored ({place})"),
            (Text::Ignored(tag), _) => format!("{tag} elements are ignored ({count} of them, first at {place})"),
            (Text::Note(text), 1) => format!("{text} ({place})"),
            (Text::Note(text), _) => format!("{text} ({place}, and {} more such)", count - 1),
        };
        let mut texts: Vec<_> = self.kinds.into_iter().map(text).collect();
        if self.beyond > 0 {
            texts.push(format!("{} warnings of further kinds are left out", self.beyond));
        }
        texts
    }
}
