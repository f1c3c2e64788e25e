//! What the systems of a description have in common: the problem that they belong to, and their entries.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;

/// The first exception raised by a user-supplied function, and the first number of one that is not finite, until they are
/// taken.
#[derive(Clone, Default)]
pub struct Failures(Arc<Mutex<Kept>>);

#[derive(Default)]
struct Kept {
    raised: Option<PyErr>,
    not_finite: Option<PyErr>,
}

impl Failures {
    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps an exception, unless there is one already: all work ends.
    pub fn keep(&self, error: PyErr) {
        self.lock().raised.get_or_insert(error);
    }

    /// Keeps what is to be said of a number that is not finite, unless there is something already: one design cannot be
    /// evaluated, others may.
    pub fn keep_not_finite(&self, error: PyErr) {
        self.lock().not_finite.get_or_insert(error);
    }

    /// Whether there is an exception.
    pub fn any(&self) -> bool {
        self.lock().raised.is_some()
    }

    /// Takes the exception away.
    pub fn take(&self) -> Option<PyErr> {
        self.lock().raised.take()
    }

    /// Takes away what was not finite.
    pub fn take_not_finite(&self) -> Option<PyErr> {
        self.lock().not_finite.take()
    }
}

/// What a system may need to know of the problem that it belongs to.
pub struct Context<'a> {
    /// Names of all parameters.
    pub parameters: &'a [String],
    /// How many steps its task lasts.
    pub steps: usize,
    /// Where exceptions of callbacks go.
    pub failures: &'a Failures,
}

/// An entry that has to be there.
pub fn field<'py>(dict: &Bound<'py, PyDict>, key: &str) -> PyResult<Bound<'py, PyAny>> {
    let missing = || errors::usage(dict.py(), &format!("the description of the task has no `{key}`"));
    dict.get_item(key)?.ok_or_else(missing)
}
