//! Links, joints and frames by their names in a file.

use std::collections::HashMap;

use supple_text::FileError;

use super::parts::Reference;
use super::words::{listed, near, shown};
use super::xml::Element;

/// The index of each link or joint by its name.
pub(super) struct Names<'n> {
    index: HashMap<&'n str, usize>,
    /// `link` or `joint`.
    what: &'static str,
}

impl<'n> Names<'n> {
    /// # Errors
    /// Where a name is used twice.
    pub(super) fn new<'a>(
        all: impl Iterator<Item = (&'n str, Element<'a>)> + Clone,
        what: &'static str,
    ) -> Result<Self, FileError> {
        let mut index = HashMap::new();
        for (i, (name, at)) in all.clone().enumerate() {
            if let Some(first) = index.insert(name, i) {
                let place = all.clone().nth(first).map_or_else(String::new, |(_, at)| at.place());
                let message = format!("there is another {what} {}, at {place}; names must differ", shown(name));
                return Err(at.error_at("name", message));
            }
        }
        Ok(Self { index, what })
    }

    /// # Errors
    /// Where there is nothing of that name.
    pub(super) fn find(&self, reference: &Reference) -> Result<usize, FileError> {
        let Reference { at, name } = reference;
        self.index.get(name.as_str()).copied().ok_or_else(|| {
            let mut valid: Vec<_> = self.index.iter().map(|(name, index)| (*index, *name)).collect();
            valid.sort_unstable();
            let valid: Vec<_> = valid.into_iter().map(|(_, name)| name).collect();
            let known = if valid.is_empty() { "there are none".into() } else { format!("known: {}", listed(&valid)) };
            let error = at.error_naming(name, format!("there is no {} {}; {known}", self.what, shown(name)));
            match near(name, &valid) {
                Some(help) => error.with_help(help),
                None => error,
            }
        })
    }
}
