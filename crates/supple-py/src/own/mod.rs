//! Tasks that are not read from a file: what Python describes, as a problem.
//!
//! A description is a dict. All but the systems is plain data and read by serde from JSON (`own/describe.rs`); each task
//! has a system under the key `system`, a dict whose `kind` says which of the files here makes it.

mod callback;
mod describe;
mod linear;
mod recorded;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use supple::system::System;
use supple::{Dimensions, Problem};

use crate::errors;
use crate::json::from_json;

pub use callback::{fill, read, vectors};
pub use linear::check_covariance;

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

/// The problem of a description.
///
/// # Errors
/// Where something in it is missing, of the wrong shape or not valid.
pub fn problem(description: &Bound<'_, PyDict>, failures: &Failures) -> PyResult<Problem> {
    let py = description.py();
    let wrong = |message: String| errors::usage(py, &message);
    let plain: String = field(description, "plain")?.extract()?;
    let described: describe::Described = from_json(py, &plain)?;
    let names = described.parameter_names();
    let systems = field(description, "systems")?.cast_into::<PyList>()?;
    let mut made = Vec::new();
    for (entry, steps) in systems.iter().zip(described.steps()) {
        let most = supple::most_steps(Dimensions::default());
        if steps > most {
            return Err(wrong(format!("steps: {steps} is too many; at most {most}")));
        }
        let context = Context { parameters: &names, steps, failures };
        made.push(system(&entry.cast_into::<PyDict>()?, &context)?);
    }
    described.problem(made).map_err(wrong)
}

/// An entry that has to be there.
pub fn field<'py>(dict: &Bound<'py, PyDict>, key: &str) -> PyResult<Bound<'py, PyAny>> {
    let missing = || errors::usage(dict.py(), &format!("the description of the task has no `{key}`"));
    dict.get_item(key)?.ok_or_else(missing)
}

/// The system of a description, by its kind.
fn system(description: &Bound<'_, PyDict>, context: &Context<'_>) -> PyResult<Arc<dyn System>> {
    let kind: String = field(description, "kind")?.extract()?;
    match &*kind {
        "callback" => Ok(Arc::new(callback::Callback::new(description, context)?)),
        "linear" => linear::system(description, context),
        "recorded" => recorded::system(description, context),
        _ => Err(errors::usage(description.py(), &format!("no kind of system `{kind}`"))),
    }
}
