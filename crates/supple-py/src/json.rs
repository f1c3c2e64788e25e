//! What Python passes as JSON.

use pyo3::prelude::*;
use serde::de::DeserializeOwned;

use crate::errors;

/// Reads it; errors name the key that is wrong.
pub fn from_json<T: DeserializeOwned>(py: Python<'_>, json: &str) -> PyResult<T> {
    let mut deserializer = serde_json::Deserializer::from_str(json);
    serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let place = error.path().to_string();
        // Options of a study are arguments in Python.
        let place = place.strip_prefix("options.").unwrap_or(&place).to_owned();
        let error = error.into_inner();
        // Python writes numbers that are not finite as names, which JSON does not have. The position in the text means
        // nothing to the user.
        let message = if error.is_syntax() { "must be a finite number".to_owned() } else { error.to_string() };
        let what = message.split(" at line ").next().unwrap_or(&message);
        errors::usage(py, &if place.starts_with(['.', '?']) { what.to_owned() } else { format!("{place}: {what}") })
    })
}
