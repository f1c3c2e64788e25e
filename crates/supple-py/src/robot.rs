//! Robot files.

use pyo3::prelude::*;
use supple_robot::{LoadOptions, mjcf, parse};

use crate::errors;

/// A robot file's text as MJCF.
#[pyfunction]
pub fn as_mjcf(py: Python<'_>, text: &str, file: &str) -> PyResult<String> {
    let robot = parse(text, file, &LoadOptions::default()).map_err(|error| errors::of_file(py, &error))?;
    Ok(mjcf(&robot).text)
}
