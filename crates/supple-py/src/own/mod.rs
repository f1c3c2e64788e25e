//! Tasks that are not read from a file: what Python describes, as a problem.
//!
//! A description is a dict. All but the systems is plain data and read by serde from JSON (`own/describe.rs`); each task
//! has a system under the key `system`, a dict whose `kind` says which of the files here makes it.

mod callback;
mod context;
mod describe;
mod linear;
mod recorded;

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use supple::system::System;
use supple::{Dimensions, Problem};

use crate::errors;
use crate::json::from_json;

pub use callback::{fill, read, vectors};
pub use context::Failures;
use context::{Context, field};
pub use linear::check_covariance;

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
