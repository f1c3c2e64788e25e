//! XML with user-friendly errors: elements whose attributes and texts are read as numbers, vectors and names.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;

use roxmltree::{Error, Node, ParsingOptions};
use supple_text::FileError;

use super::scan::{MOST_NODES, Refusal, scan};
use super::words::{RUN_XACRO, XACRO, clipped, shown};

/// A text with harmless content around the root element blanked out, so that lines and columns stay, and messages about
/// it. Whitespace, byte order marks and comments may precede the XML declaration, and text without elements may
/// follow the root element.
pub(super) fn cleaned(text: &str) -> (Cow<'_, str>, Vec<String>) {
    let (mut blank, mut said) = (Vec::new(), Vec::new());
    let line = |byte: usize| text[..byte].matches('\n').count() + 1;
    // The parser skips one mark.
    let begin = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
    let mut at = begin;
    loop {
        let rest = &text[at..];
        if let Some(after) = rest.strip_prefix('\u{feff}') {
            blank.push(at..text.len() - after.len());
            at = text.len() - after.len();
        } else if rest.starts_with(char::is_whitespace) {
            at = text.len() - rest.trim_start().len();
        } else if let Some(end) = rest.strip_prefix("<!--").and_then(|inside| inside.find("-->")) {
            at += "<!--".len() + end + "-->".len();
        } else {
            break;
        }
    }
    let is_declared = |rest: &str| rest.strip_prefix("<?xml").is_some_and(|more| more.starts_with(char::is_whitespace));
    if at > begin
        && is_declared(&text[at..])
        && let Some(length) = text[at..].find("?>")
    {
        said.push(format!("the XML declaration should come first (line {})", line(at)));
        blank.push(at..at + length + "?>".len());
    }
    if let Some(end) = text.rfind('>').map(|end| end + 1)
        && !text[end..].contains('<')
        && text[end..].contains(|sign: char| !sign.is_whitespace())
    {
        let from = text.len() - text[end..].trim_start().len();
        said.push(format!("text after the root element is ignored (line {})", line(from)));
        blank.push(from..text.len());
    }
    if blank.is_empty() {
        return (Cow::Borrowed(text), said);
    }
    let (mut cleaned, mut from) = (String::with_capacity(text.len()), 0);
    for range in blank {
        cleaned.push_str(&text[from..range.start]);
        // Each byte is replaced by one byte.
        cleaned.extend(text[range.clone()].bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' }));
        from = range.end;
    }
    cleaned.push_str(&text[from..]);
    (Cow::Owned(cleaned), said)
}

/// A parsed XML file.
pub(super) struct Document<'t> {
    tree: roxmltree::Document<'t>,
    text: &'t str,
    file: String,
    /// Where each line begins, by byte.
    lines: Vec<usize>,
    /// Documents that replace an element, by the byte offset of that element.
    included: HashMap<usize, Document<'t>>,
    /// Whether another file includes this one.
    is_included: bool,
}

impl<'t> Document<'t> {
    /// Parses a text; errors call the file `file`. A byte order mark is skipped.
    ///
    /// # Errors
    /// If the text is not well-formed XML, defines a document type or entities, or exceeds a limit of size or
    /// depth.
    pub(super) fn parse(text: &'t str, file: &str) -> Result<Self, FileError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let fail = |span, message| FileError::at(file, text, span, String::new(), message);
        if text.trim().is_empty() {
            return Err(fail(0..0, "the file is empty".to_owned()).with_help("a robot file is URDF, SDF or MJCF"));
        }
        if text.trim_start().starts_with(|first| first != '<') {
            return Err(fail(0..0, "this is not XML: a robot file begins with `<`".to_owned()));
        }
        let unclosed = scan(text).map_err(|Refusal { span, message }| fail(span, message))?;
        let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
        let tree = roxmltree::Document::parse_with_options(text, options).map_err(|error| {
            let (span, message) = explain(&error, text, &unclosed);
            let help = (message == XACRO).then(|| RUN_XACRO.to_owned());
            FileError { help, ..fail(span, message) }
        })?;
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Ok(Self { tree, text, file: file.to_owned(), lines, included: HashMap::new(), is_included: false })
    }

    /// Replaces the element that begins at a byte by the elements of another document.
    pub(super) fn include(&mut self, byte: usize, document: Document<'t>) {
        self.included.insert(byte, Document { is_included: true, ..document });
    }

    /// The outermost element.
    pub(super) fn root(&self) -> Element<'_> {
        Element { document: self, node: self.tree.root_element() }
    }

    /// The whole text.
    pub(super) fn text(&self) -> &str {
        self.text
    }

    /// The line of a byte, from 1.
    fn line(&self, byte: usize) -> usize {
        self.lines.partition_point(|&start| start <= byte)
    }

    /// An error about bytes of the text.
    fn error(&self, span: Range<usize>, key: String, message: impl Into<String>) -> FileError {
        FileError::at(&self.file, self.text, span, key, message)
    }
}

/// A parser error in plain words, and its location.
fn explain(error: &Error, text: &str, unclosed: &[usize]) -> (Range<usize>, String) {
    let end = text.len()..text.len();
    let at = byte_at(text, &error.pos());
    match error {
        Error::NoRootNode => (end, "there is no element in this file".to_owned()),
        Error::UnclosedRootNode => {
            let start = unclosed.last().copied().unwrap_or(0);
            let tag = tag_at(text, start);
            (start..start + 1 + tag.len(), format!("the file ends before element {} is closed", shown(tag)))
        }
        Error::UnexpectedEndOfStream => (end, "the file ends within a tag, a comment or a text".to_owned()),
        Error::NodesLimitReached => {
            (end, format!("a robot file has at most {MOST_NODES} elements, texts and comments"))
        }
        Error::UnknownNamespace(prefix, _) if prefix == "xacro" => (at, XACRO.to_owned()),
        Error::UnknownNamespace(prefix, _) => {
            let prefix = clipped(prefix);
            (at, format!("the prefix `{prefix}` is not declared; `xmlns:{prefix}` in an outer element declares it"))
        }
        Error::DuplicatedAttribute(name, _) => (at, format!("attribute {} is given twice", shown(name))),
        Error::UnexpectedCloseTag(open, found, _) => {
            (at, format!("{} is closed here, but the innermost open element is {}", shown(found), shown(open)))
        }
        Error::UnknownEntityReference(name, _) => (at, format!("there is no entity {}", shown(name))),
        Error::UnexpectedDeclaration(_) => (at, "the XML declaration must come first".to_owned()),
        Error::UnknownToken(_) if unclosed.is_empty() => (at, "content after the root element".to_owned()),
        _ => {
            let said = error.to_string();
            let said = said.strip_suffix(&format!(" at {}", error.pos())).unwrap_or(&said);
            (at, format!("this is not well-formed XML: {}", clipped(said)))
        }
    }
}

/// The bytes at a place that the parser names.
fn byte_at(text: &str, at: &roxmltree::TextPos) -> Range<usize> {
    let (row, column) = (at.row.saturating_sub(1) as usize, at.col.saturating_sub(1) as usize);
    let start: usize = text.split_inclusive('\n').take(row).map(str::len).sum();
    let rest = &text[start..];
    let start = rest.char_indices().nth(column).map_or(text.len(), |(at, _)| start + at);
    start..start
}

/// The tag of the element that begins at byte `start`, with its prefix.
fn tag_at(text: &str, start: usize) -> &str {
    let rest = text.get(start + 1..).unwrap_or("");
    rest.split([' ', '\t', '\r', '\n', '/', '>']).next().unwrap_or("")
}

/// An element of a document.
#[derive(Clone, Copy)]
pub(super) struct Element<'a> {
    document: &'a Document<'a>,
    pub(super) node: Node<'a, 'a>,
}

impl<'a> Element<'a> {
    /// Its tag as written, with a prefix where it has one.
    pub(super) fn tag(self) -> &'a str {
        tag_at(self.document.text, self.node.range().start)
    }

    /// The line it begins in, from 1.
    pub(super) fn line(self) -> usize {
        self.document.line(self.node.range().start)
    }

    /// The byte it begins at.
    pub(super) fn start(self) -> usize {
        self.node.range().start
    }

    /// Its location for messages: `line 5`, or ``line 5 of `arm.xml` `` in an included file.
    pub(super) fn place(self) -> String {
        let file =
            if self.document.is_included { format!(" of {}", shown(&self.document.file)) } else { String::new() };
        format!("line {}{file}", self.line())
    }

    /// The element it is in.
    pub(super) fn parent(self) -> Option<Self> {
        self.node.parent_element().map(|node| Self { node, ..self })
    }

    /// What it is called in errors: ``joint `elbow` ``, or ``origin of joint `elbow` ``.
    pub(super) fn key(self) -> String {
        let named = std::iter::successors(Some(self), |element| element.parent()).find_map(|element| {
            Some((element, element.node.attribute("name").filter(|name| !name.trim().is_empty())?))
        });
        match named {
            Some((element, name)) if element.node == self.node => format!("{} {}", self.tag(), shown(name)),
            Some((element, name)) => format!("{} of {} {}", self.tag(), element.tag(), shown(name)),
            None => self.tag().to_owned(),
        }
    }

    /// An error about the element.
    pub(super) fn error(self, message: impl Into<String>) -> FileError {
        let start = self.node.range().start;
        self.document.error(start..start + 1 + self.tag().len(), self.key(), message)
    }

    /// An error about the value of an attribute; about the element where it has no such attribute.
    pub(super) fn error_at(self, attribute: &str, message: impl Into<String>) -> FileError {
        match self.node.attribute_node(attribute) {
            Some(found) => self.document.error(found.range_value(), self.key(), message),
            None => self.error(message),
        }
    }

    /// An error about the attribute or text with this value; about the element if there is none.
    pub(super) fn error_naming(self, value: &str, message: impl Into<String>) -> FileError {
        match self.node.attributes().find(|attribute| attribute.value() == value) {
            Some(attribute) => self.document.error(attribute.range_value(), self.key(), message),
            None if self.content().is_ok_and(|content| content == value) => self.error_in_content(message),
            None => self.error(message),
        }
    }

    /// An error about the attribute or element `name` within this element, at any depth; about the
    /// element itself if there is none.
    pub(super) fn error_about(self, name: &str, message: impl Into<String>) -> FileError {
        let about = self.descendants().find(|inner| inner.tag() == name || inner.attribute(name).is_some());
        about.unwrap_or(self).error_at(name, message)
    }

    /// An error about the text in the element.
    pub(super) fn error_in_content(self, message: impl Into<String>) -> FileError {
        let text = self.node.children().find(|child| child.text().is_some_and(|text| !text.trim().is_empty()));
        match text {
            Some(text) => {
                let (all, said) = (text.range(), text.text().unwrap_or(""));
                let blank = said.len() - said.trim_start().len();
                self.document.error(all.start + blank..all.start + said.trim_end().len(), self.key(), message)
            }
            None => self.error(message),
        }
    }

    /// Itself and all elements in it, at any depth, in the order of the file.
    pub(super) fn descendants(self) -> impl Iterator<Item = Self> {
        self.node.descendants().filter(Node::is_element).map(move |node| Self { node, ..self })
    }

    /// The child elements; an element that includes a file is replaced by the elements of that file.
    pub(super) fn children(self) -> impl Iterator<Item = Self> {
        let own = |outer: Self| outer.node.children().filter(Node::is_element).map(move |node| Self { node, ..outer });
        // Files that are open, the innermost last.
        let mut open: Vec<Box<dyn Iterator<Item = Self> + 'a>> = vec![Box::new(own(self))];
        std::iter::from_fn(move || {
            loop {
                let Some(child) = open.last_mut()?.next() else {
                    open.pop();
                    continue;
                };
                match child.document.included.get(&child.start()) {
                    Some(document) => open.push(Box::new(own(document.root()))),
                    None => return Some(child),
                }
            }
        })
    }

    /// The elements in it with this tag.
    pub(super) fn all(self, tag: &str) -> impl Iterator<Item = Self> {
        self.children().filter(move |child| child.tag() == tag)
    }

    /// The element in it with this tag, where there is one.
    ///
    /// # Errors
    /// Where there is more than one.
    pub(super) fn child(self, tag: &str) -> Result<Option<Self>, FileError> {
        let mut all = self.all(tag);
        let first = all.next();
        match (first, all.next()) {
            (Some(first), Some(second)) => Err(second.error(format!(
                "only one {} is allowed in a {}; the first is at {}",
                shown(tag),
                shown(self.tag()),
                first.place()
            ))),
            _ => Ok(first),
        }
    }

    /// The one element in it with this tag.
    ///
    /// # Errors
    /// Where there is none, or more than one.
    pub(super) fn required_child(self, tag: &str) -> Result<Self, FileError> {
        self.child(tag)?.ok_or_else(|| self.error(format!("a {} element is missing", shown(tag))))
    }
}
