use std::collections::BTreeMap;

use supple_model::Value;
use supple_model::document::{Document, Place, Unfit};
use supple_model::model::Kinds;
use supple_model::parameters::Parameters;
use supple_text::{FileError, quoted};

use crate::rows::by_name;

/// Reads one task.
pub(super) struct Reader<'a> {
    pub(super) document: &'a Document<'a>,
    pub(super) index: usize,
    pub(super) parameters: &'a Parameters,
    pub(super) kinds: &'a Kinds,
}

impl Reader<'_> {
    /// The error of what does not fit in the task.
    pub(super) fn unfit(&self, unfit: Unfit) -> FileError {
        unfit.at(self.document, &["tasks".into(), self.index.into()])
    }

    pub(super) fn error(&self, keys: &[Place], message: impl Into<String>) -> FileError {
        let at: Vec<Place> = ["tasks".into(), self.index.into()].into_iter().chain(keys.iter().copied()).collect();
        self.document.error(&at, message)
    }

    /// Numbers by the names of states.
    pub(super) fn named(
        &self,
        keys: &[Place],
        given: &BTreeMap<String, Value>,
        states: &[String],
    ) -> Result<Vec<Value>, FileError> {
        by_name(given, states).map_err(|(key, help)| {
            let keys: Vec<Place> = keys.iter().copied().chain([Place::Key(&key)]).collect();
            let fits = if key.contains('*') { "fits" } else { "is" };
            let message = format!("no state {fits} `{key}`; states: {}", quoted(states));
            FileError { help, ..self.error(&keys, message) }
        })
    }
}
