use supple_text::{FileError, nearest, owned};

use super::{Document, Place};

/// What does not fit, below a table: the keys and indices that lead to it, and what is valid.
///
/// ```
/// use supple_model::document::Unfit;
///
/// let wrong = Unfit::new("measurement", "must be above 0; found -1").entry(2).below("noise");
/// assert_eq!(wrong.to_string(), "noise.measurement[2]: must be above 0; found -1");
/// ```
#[derive(Clone, Debug)]
pub struct Unfit {
    /// From the table to what is wrong; empty if that is the table itself.
    pub place: Vec<Place<'static>>,
    /// What was found and what is valid.
    pub message: String,
    /// Advice, where there is any.
    pub help: Option<String>,
}

impl Unfit {
    /// What is wrong with the value of a key.
    pub fn new(key: &'static str, message: impl Into<String>) -> Self {
        Self { place: vec![Place::Key(key)], ..Self::here(message) }
    }

    /// What is wrong with the table itself.
    pub fn here(message: impl Into<String>) -> Self {
        Self { place: Vec::new(), message: message.into(), help: None }
    }

    /// The error for a name that is not in `valid`, with the nearest valid name as help.
    pub fn unknown<T: AsRef<str>>(key: &'static str, what: &str, name: &str, valid: &[T]) -> Self {
        Self { help: nearest(name, valid), ..Self::new(key, format!("{what}: {}", owned(valid))) }
    }

    /// The same with advice.
    #[must_use]
    pub fn with_help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }

    /// The same of an entry of the list there.
    #[must_use]
    pub fn entry(mut self, index: usize) -> Self {
        self.place.push(Place::Index(index));
        self
    }

    /// The same seen from where a key or an index leads to its table.
    #[must_use]
    pub fn below(mut self, place: impl Into<Place<'static>>) -> Self {
        self.place.insert(0, place.into());
        self
    }

    /// The key that it is about, without those that lead there.
    #[must_use]
    pub fn key(&self) -> &'static str {
        let key = |place: &Place<'static>| if let Place::Key(key) = *place { Some(key) } else { None };
        self.place.iter().rev().find_map(key).unwrap_or_default()
    }

    /// The corresponding file error, for a table at a place.
    #[must_use]
    pub fn at(self, document: &Document, at: &[Place]) -> FileError {
        let at: Vec<Place> = at.iter().copied().chain(self.place).collect();
        FileError { help: self.help, ..document.error(&at, self.message) }
    }
}

impl std::fmt::Display for Unfit {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        for (number, place) in self.place.iter().enumerate() {
            match place {
                Place::Key(key) if number > 0 => write!(f, ".{key}")?,
                Place::Key(key) => f.write_str(key)?,
                Place::Index(index) => write!(f, "[{index}]")?,
            }
        }
        if !self.place.is_empty() {
            f.write_str(": ")?;
        }
        f.write_str(&self.message)?;
        self.help.as_ref().map_or(Ok(()), |help| write!(f, "; {help}"))
    }
}

impl std::error::Error for Unfit {}
