//! Reading hand-written text files, with limits against malicious input and errors that name the file, line, key and
//! valid alternatives; also formats numbers and units as text.
//!
//! The crate depends on no other crate of supple. `supple-robot` reads robot files with it, `supple-model` and
//! `supple-file` task files; all crates that print use its numbers.
//!
//! | what | main items |
//! |---|---|
//! | a file of at most 64 MiB; texts in place of files | [`read_text`], [`Files`] |
//! | something wrong in a file, and where | [`FileError`] |
//! | names in messages, and the valid name nearest to a wrong one | [`nearest`], [`quoted`], [`owned`] |
//! | words of a command line | [`shell_word`] |
//! | untrusted text without control characters | [`plain`] |
//! | numbers as text, short or exact | [`short`], [`digits`], [`exact`], [`significant`] |
//! | units on pages and in figures | [`printed_unit`] |
//!
//! # An error with its place and advice
//!
//! ```
//! use supple_text::{FileError, nearest, short};
//!
//! let text = "mass = 2.0\nstifness = 500.0\n";
//! let key = "stifness";
//! let start = text.find(key).ok_or("the key is in the text")?;
//! let mut error = FileError::at("spring.toml", text, start..start + key.len(), key.to_owned(), "unknown key");
//! if let Some(help) = nearest(key, &["mass", "stiffness"]) {
//!     error = error.with_help(help);
//! }
//! assert_eq!(error.to_string(), "spring.toml:2:1: stifness: unknown key (did you mean `stiffness`?)");
//! assert_eq!(short(1.0 / 3.0, 3), "0.333");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Read;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

mod numbers;
mod units;

pub use numbers::{
    degrees, digits, exact, exponent, interval_95, padded, printed, saves, short, significant, tabular, trimmed,
};
pub use units::{printed_unit, raised};

/// Maximum file size, bytes: anything larger cannot be a task or robot file.
const LARGEST: u64 = 64 << 20;

/// Text that is safe to print: titles, names and messages may come from untrusted files and contain terminal commands.
/// Control characters other than line breaks and tabs, Unicode's own line breaks, and what changes the text direction, become
/// `\u{fffd}`.
///
/// ```
/// assert_eq!(supple_text::plain("a title\u{1b}[31m"), "a title\u{fffd}[31m");
/// assert_eq!(supple_text::plain("two\u{2028}lines\u{200f}"), "two\u{fffd}lines\u{fffd}");
/// ```
#[must_use]
pub fn plain(text: &str) -> Cow<'_, str> {
    let is_command = |c: char| {
        c.is_control() && !matches!(c, '\n' | '\t')
            || matches!(c, '\u{061c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if text.contains(is_command) { text.replace(is_command, "\u{fffd}").into() } else { text.into() }
}

/// An error in a file, with its location.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    /// The file's name.
    pub file: String,
    /// Line, from 1; 0 where the file could not be read.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// What the error refers to: a key as a path from the top, `tasks[0].noise.initial`, or an element, ``joint `elbow` ``.
    pub key: String,
    /// What was found, and what is valid.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// The byte range in the text that the error refers to.
    pub span: Range<usize>,
    /// The text of the file.
    pub text: String,
}

impl std::fmt::Display for FileError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}", self.file)?;
        if self.line > 0 {
            write!(f, ":{}:{}", self.line, self.column)?;
        }
        if !self.key.is_empty() {
            write!(f, ": {}", self.key)?;
        }
        write!(f, ": {}", self.message)?;
        match &self.help {
            Some(help) => write!(f, " ({help})"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for FileError {}

impl FileError {
    /// The error for a file that cannot be read.
    pub fn unreadable(file: &str, why: impl std::fmt::Display) -> Self {
        Self {
            file: file.to_owned(),
            line: 0,
            column: 0,
            key: String::new(),
            message: format!("cannot be read: {why}"),
            help: None,
            span: 0..0,
            text: String::new(),
        }
    }

    /// An error at a byte range of the text.
    pub fn at(file: &str, text: &str, span: Range<usize>, key: String, message: impl Into<String>) -> Self {
        // A parser may point into the middle of a character.
        let boundary = |byte: usize| (0..=byte.min(text.len())).rev().find(|&byte| text.is_char_boundary(byte));
        let (start, end) = (boundary(span.start).unwrap_or(0), boundary(span.end).unwrap_or(0));
        let before = &text[..start];
        Self {
            file: file.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before.chars().rev().take_while(|&c| c != '\n').count() + 1,
            key,
            message: message.into(),
            help: None,
            span: start..end.max(start),
            text: text.to_owned(),
        }
    }

    /// The same error with advice.
    #[must_use]
    pub fn with_help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }
}

/// Where the texts of files are read: on the disk, or where texts are given for some paths, those first.
///
/// ```
/// use supple_text::Files;
///
/// // Texts that were read on another machine.
/// let files = Files::given([("task.toml".to_owned(), "title = \"Reach\"".to_owned())]);
/// assert!(files.has("task.toml") && !Files::default().has("task.toml"));
/// assert_eq!(files.read("task.toml")?, "title = \"Reach\"");
/// # Ok::<(), supple_text::FileError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Files {
    /// Texts by path.
    given: Arc<HashMap<String, String>>,
}

impl Files {
    /// These texts in place of the files at their paths.
    #[must_use]
    pub fn given(texts: impl IntoIterator<Item = (String, String)>) -> Self {
        Self { given: Arc::new(texts.into_iter().collect()) }
    }

    /// Whether there is such a file.
    #[must_use]
    pub fn has(&self, path: impl AsRef<Path>) -> bool {
        let path = path.as_ref();
        self.given.contains_key(&path.display().to_string()) || path.is_file()
    }

    /// The text of a file.
    ///
    /// # Errors
    /// If it cannot be read, is not a regular file (reading a pipe could block), is not UTF-8 text, or is larger than
    /// 64 MiB.
    pub fn read(&self, path: impl AsRef<Path>) -> Result<String, FileError> {
        let path = path.as_ref();
        if std::fs::metadata(path).is_ok_and(|about| !about.is_file() && !about.is_dir()) {
            return Err(FileError::unreadable(
                &path.display().to_string(),
                "it is not a regular file but a pipe, socket or device",
            ));
        }
        self.read_named(path)
    }

    /// Like [`read`](Self::read), for a path that the user named: it may also be a pipe.
    ///
    /// # Errors
    /// Those of [`read`](Self::read), except that pipes are allowed.
    pub fn read_named(&self, path: impl AsRef<Path>) -> Result<String, FileError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        if let Some(text) = self.given.get(&name) {
            return Ok(text.clone());
        }
        if path.is_dir() {
            return Err(FileError::unreadable(&name, "it is a folder, not a file"));
        }
        let unreadable = |error| FileError::unreadable(&name, error);
        let mut bytes = Vec::new();
        let file = std::fs::File::open(path).map_err(unreadable)?;
        file.take(LARGEST + 1).read_to_end(&mut bytes).map_err(unreadable)?;
        if bytes.len() as u64 > LARGEST {
            return Err(FileError::unreadable(&name, "it is larger than 64 MiB"));
        }
        String::from_utf8(bytes).map_err(|error| {
            let start = error.utf8_error().valid_up_to();
            let text = String::from_utf8_lossy(error.as_bytes());
            FileError::at(&name, &text, start..start + 1, String::new(), "must be UTF-8; this byte is invalid")
        })
    }
}

/// The text of a file on the disk: [`Files::read`].
///
/// # Errors
/// Those of [`Files::read`].
pub fn read_text(path: impl AsRef<Path>) -> Result<String, FileError> {
    Files::default().read(path)
}

/// A word as a shell takes it.
///
/// ```
/// use supple_text::shell_word;
///
/// assert_eq!(shell_word("--set"), "--set");
/// assert_eq!(shell_word("k 1"), "'k 1'");
/// assert_eq!(shell_word("it's"), "'it'\\''s'");
/// assert_eq!(shell_word(""), "''");
/// ```
#[must_use]
pub fn shell_word(word: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "-_./=:,+@%".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// Suggests the valid name closest to an invalid one, if one is close enough.
///
/// Example: the [front page](crate).
pub fn nearest<T: AsRef<str>>(found: &str, valid: &[T]) -> Option<String> {
    let found = found.to_lowercase();
    let likeness = |name: &str| strsim::jaro_winkler(&found, &name.to_lowercase());
    let named = valid.iter().map(|name| (likeness(name.as_ref()), name.as_ref()));
    let (best, name) = named.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best > 0.7 && 3 * name.len() >= found.len()).then(|| format!("did you mean `{name}`?"))
}

/// The valid names most like an invalid one, the most alike first, `most` of them.
///
/// ```
/// let valid = ["arm.force_x", "arm.force_y", "hand.x", "hand.y"];
/// assert_eq!(supple_text::nearest_few("arm.force", &valid, 2), ["arm.force_x", "arm.force_y"]);
/// ```
pub fn nearest_few<'a, T: AsRef<str>>(found: &str, valid: &'a [T], most: usize) -> Vec<&'a str> {
    let found = found.to_lowercase();
    let likeness = |name: &str| strsim::jaro_winkler(&found, &name.to_lowercase());
    let mut named: Vec<_> = valid.iter().map(|name| (likeness(name.as_ref()), name.as_ref())).collect();
    named.sort_by(|a, b| b.0.total_cmp(&a.0));
    named.into_iter().take(most).map(|(_, name)| name).collect()
}

/// The list of valid names for an error message: `it has a, b`, or `none are defined`.
///
/// Example: [`quoted`].
pub fn owned<T: AsRef<str>>(names: &[T]) -> String {
    if names.is_empty() { "none are defined".to_owned() } else { format!("it has {}", quoted(names)) }
}

/// A text with its first letter in upper case.
///
/// ```
/// assert_eq!(supple_text::capitalised("two masses"), "Two masses");
/// ```
#[must_use]
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A count of things.
///
/// ```
/// assert_eq!([1, 4].map(|number| supple_text::count(number, "start")), ["1 start", "4 starts"]);
/// ```
#[must_use]
pub fn count(number: usize, thing: &str) -> String {
    if number == 1 { format!("1 {thing}") } else { format!("{number} {thing}s") }
}

/// Names in backquotes, separated by commas: the first forty, or all if that would leave out only one.
///
/// Lists are long enough for all kinds of sensors, costs and compliance: a user who mistypes a kind should not have to
/// look up the valid ones.
///
/// ```
/// use supple_text::{owned, quoted};
///
/// assert_eq!(quoted(&["shoulder", "elbow"]), "`shoulder`, `elbow`");
/// assert_eq!(owned(&["shoulder", "elbow"]), "it has `shoulder`, `elbow`");
/// ```
pub fn quoted<T: AsRef<str>>(names: &[T]) -> String {
    let most = most(names.len(), 40);
    let shown: Vec<_> = names.iter().take(most).map(|name| format!("`{}`", name.as_ref())).collect();
    let rest = names.len() - most;
    if rest == 0 { shown.join(", ") } else { format!("{} and {rest} more", shown.join(", ")) }
}

/// How many of `count` names a message limited to `most` shows: one extra name is shorter than "and 1 more".
///
/// ```
/// use supple_text::most;
///
/// assert_eq!([most(40, 40), most(41, 40), most(42, 40)], [40, 41, 40]);
/// ```
#[must_use]
pub fn most(count: usize, most: usize) -> usize {
    if count <= most + 1 { count } else { most }
}

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;

#[cfg(test)]
mod tests {
    use super::quoted;

    /// Regression test: twenty-one kinds were listed as twenty "and 1 more".
    #[test]
    fn lists_of_names_never_hide_a_single_one() {
        let names = |count: usize| (0..count).map(|name| name.to_string()).collect::<Vec<_>>();
        for count in [1, 21, 40, 41] {
            assert_eq!(quoted(&names(count)).matches('`').count(), 2 * count);
        }
        assert!(quoted(&names(42)).ends_with("`39` and 2 more"));
    }
}
