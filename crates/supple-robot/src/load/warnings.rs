//! Warnings about ignored or suspicious parts of a file, each reported once.

use std::collections::HashMap;

use super::words::{clipped, listed, near, shown};
use super::xml::Element;

/// Greatest number of kinds of warnings that are listed; further kinds are only counted.
const MOST_KINDS: usize = 100;
/// Greatest number of individual warnings that are kept; further ones are only counted.
const MOST_SINGLE: usize = 10_000;

/// Warnings of one file, in the order in which they first arose.
#[derive(Default)]
pub(super) struct Warnings {
    kinds: Vec<Kind>,
    /// Index in `kinds` for each tag or warning text.
    index: HashMap<String, usize>,
    /// Warnings of kinds beyond the limit.
    beyond: usize,
    /// Every individual warning.
    single: Vec<String>,
    /// Number of individual warnings beyond the limit.
    uncounted: usize,
    /// Parts that exert forces and are left out, one sentence for each kind.
    forces: Vec<String>,
}

/// Warnings as sentences.
pub(super) struct Sentences {
    /// One by kind.
    pub(super) kinds: Vec<String>,
    /// Every single one.
    pub(super) every: Vec<String>,
    /// Those about parts that exert forces and are left out.
    pub(super) forces: Vec<String>,
}

/// A kind of warning.
struct Kind {
    text: Text,
    count: usize,
    /// Where the first one is: `line 5`.
    place: String,
}

/// The text of a warning.
enum Text {
    /// Elements of this tag are ignored.
    Ignored(String),
    /// Any other warning: its text.
    Note(String),
    /// These meshes are left out: why, and their names.
    Meshes(&'static str, Vec<String>),
}

impl Text {
    /// The sentence about one element at a place.
    fn single(&self, place: &str) -> String {
        match self {
            Self::Ignored(tag) => format!("element {tag} is ignored ({place})"),
            Self::Note(text) => format!("{text} ({place})"),
            Self::Meshes(why, names) => format!("mesh {} is left out: it {why} ({place})", listed(names)),
        }
    }

    /// The sentence about `count` of them, the first at a place.
    fn several(&self, count: usize, place: &str) -> String {
        match self {
            Self::Ignored(tag) => format!("{tag} elements are ignored ({count} of them, first at {place})"),
            Self::Note(text) => format!("{text} ({place}, and {} more)", count - 1),
            Self::Meshes(why, names) => {
                format!("{count} meshes are ignored, because each {why}: {} (first at {place})", listed(names))
            }
        }
    }
}

impl Warnings {
    /// Reports an element that is known but not modelled.
    pub(super) fn ignore(&mut self, element: Element) {
        let tag = element.tag();
        self.add(format!("<{tag}>"), element, || Text::Ignored(shown(tag)));
    }

    /// Reports an unknown element, usually a typo; `valid` are the known ones.
    pub(super) fn unknown<T: AsRef<str>>(&mut self, element: Element, valid: &[T]) {
        let (tag, within) = (element.tag(), element.parent().map_or("", |parent| parent.tag()));
        self.add(format!("<{within}> <{tag}>"), element, || {
            let valid = near(tag, valid).unwrap_or_else(|| format!("known: {}", listed(valid)));
            Text::Note(format!("unknown {} in {} is ignored; {valid}", shown(tag), shown(within)))
        });
    }

    /// Reports attributes of an element that are not among these, usually typos; `kind` is what the element is.
    pub(super) fn unknown_attributes(&mut self, element: Element, kind: &str, known: &[&str]) {
        for name in element.attributes().filter(|name| !known.contains(name)) {
            self.note(&format!("{kind}@{name}"), element, || {
                let near = near(name, known).map_or_else(String::new, |help| format!("; {help}"));
                format!("attribute {} is not known and is ignored{near}", shown(name))
            });
        }
    }

    /// Reports an attribute that is known but not modelled.
    pub(super) fn ignore_attribute(&mut self, element: Element, attribute: &str) {
        self.add(format!("{}@{attribute}", element.tag()), element, || {
            Text::Note(format!("attribute {} of {} is ignored", shown(attribute), shown(element.tag())))
        });
    }

    /// Reports another warning about an element. Warnings of the same `kind` are counted, with the text of the first one:
    /// a sentence without a full stop.
    pub(super) fn note(&mut self, kind: &str, element: Element, text: impl FnOnce() -> String) {
        self.add(format!("!{kind}"), element, || Text::Note(format!("{}: {}", element.key(), text())));
    }

    /// Reports another warning not about the element alone: a sentence without a full stop.
    pub(super) fn say(&mut self, kind: &str, element: Element, text: impl FnOnce() -> String) {
        self.add(format!("!{kind}"), element, || Text::Note(text()));
    }

    /// Reports a part that exerts forces and is left out, so that the robot moves differently: a sentence without a full stop.
    pub(super) fn leave_out_force(&mut self, kind: &str, element: Element, text: impl Fn() -> String) {
        if !self.index.contains_key(&format!("!{kind}")) && self.forces.len() < MOST_KINDS {
            self.forces.push(format!("{} ({})", text(), element.place()));
        }
        self.say(kind, element, text);
    }

    /// Reports a mesh that is left out, and why: the end of a sentence about it.
    pub(super) fn leave_out_mesh(&mut self, element: Element, name: &str, why: &'static str) {
        let name = clipped(name).into_owned();
        self.add(format!("mesh {why}"), element, || Text::Meshes(why, vec![name]));
    }

    fn add(&mut self, key: String, element: Element, text: impl FnOnce() -> Text) {
        let known = self.index.get(&key).copied();
        let is_new = known.is_none() && self.kinds.len() < MOST_KINDS;
        let keeps = self.single.len() < MOST_SINGLE;
        self.uncounted += usize::from(!keeps);
        self.beyond += usize::from(known.is_none() && !is_new);
        let kind = known.and_then(|index| self.kinds.get_mut(index));
        let text = (is_new || keeps).then(text);
        if let Some(text) = text.as_ref().filter(|_| keeps) {
            self.single.push(text.single(&element.place()));
        }
        match (kind, text) {
            (Some(kind), text) => {
                kind.count += 1;
                if let (Text::Meshes(_, names), Some(Text::Meshes(_, more))) = (&mut kind.text, text) {
                    names.extend(more);
                }
            }
            (None, Some(text)) if is_new => {
                self.index.insert(key, self.kinds.len());
                self.kinds.push(Kind { text, count: 1, place: element.place() });
            }
            _ => {}
        }
    }

    /// The warnings as sentences.
    pub(super) fn into_sentences(self) -> Sentences {
        let text = |Kind { text, count, place }: Kind| match count {
            1 => text.single(&place),
            _ => text.several(count, &place),
        };
        let mut kinds: Vec<_> = self.kinds.into_iter().map(text).collect();
        if self.beyond > 0 {
            kinds.push(format!("{} further kinds of warnings are omitted", self.beyond));
        }
        let mut every = self.single;
        if self.uncounted > 0 {
            every.push(format!("{} further warnings are left out", self.uncounted));
        }
        Sentences { kinds, every, forces: self.forces }
    }
}
