//! Writes indented XML elements and their attributes.

use std::fmt::Write;

use supple_text::exact;

/// XML as it is written.
#[derive(Default)]
pub(super) struct Text {
    out: String,
    open: Vec<&'static str>,
}

/// The attributes of an element.
#[derive(Default)]
pub(super) struct Attributes(String);

impl Attributes {
    /// Adds a text attribute.
    pub fn text(mut self, name: &str, value: &str) -> Self {
        let _ = write!(self.0, " {name}=\"{}\"", escaped(value));
        self
    }

    /// Adds numbers with just enough digits to read back the same values.
    pub fn numbers(self, name: &str, values: &[f64]) -> Self {
        let values: Vec<String> = values.iter().map(|&value| exact(value)).collect();
        self.text(name, &values.join(" "))
    }

    /// Adds a number unless it equals MuJoCo's default.
    pub fn unless(self, name: &str, value: f64, default: f64) -> Self {
        if value == default { self } else { self.numbers(name, &[value]) }
    }

    /// Adds a range if it is a limit.
    pub fn range(self, name: &str, range: [f64; 2]) -> Self {
        if range.iter().all(|bound| bound.is_finite()) { self.numbers(name, &range) } else { self }
    }
}

/// An attribute that holds a text.
pub(super) fn named(name: &str) -> Attributes {
    Attributes::default().text("name", name)
}

impl Text {
    /// An element with others in it, until [`Text::close`].
    pub fn open(&mut self, tag: &'static str, attributes: Attributes) {
        let _ = writeln!(self.out, "{:indent$}<{tag}{}>", "", attributes.0, indent = 2 * self.open.len());
        self.open.push(tag);
    }

    /// The end of the element that was opened last.
    pub fn close(&mut self) {
        if let Some(tag) = self.open.pop() {
            let _ = writeln!(self.out, "{:indent$}</{tag}>", "", indent = 2 * self.open.len());
        }
    }

    /// An element with nothing in it.
    pub fn element(&mut self, tag: &str, attributes: Attributes) {
        let _ = writeln!(self.out, "{:indent$}<{tag}{}/>", "", attributes.0, indent = 2 * self.open.len());
    }

    /// Adds a comment for human readers.
    pub fn comment(&mut self, words: &str) {
        // XML comments must not contain two hyphens in a row.
        let words = words.replace("--", "- -");
        let _ = writeln!(self.out, "{:indent$}<!-- {words} -->", "", indent = 2 * self.open.len());
    }

    /// The complete text, after closing all open elements.
    pub fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.close();
        }
        self.out
    }
}

fn escaped(value: &str) -> String {
    let mut out = String::with_capacity(value.len());
    for letter in value.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' | '\r' => {
                let _ = write!(out, "&#{};", letter as u32);
            }
            _ => out.push(letter),
        }
    }
    out
}
