//! Errors of the library as exceptions of the package, with the same words.

use std::any::Any;

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyType};
use supple::FileError;
use supple_study::{StudyError, picture};

/// Makes an exception of `supple.errors`, with keyword arguments.
fn exception(py: Python<'_>, name: &str, message: &str, details: &Bound<'_, PyDict>) -> PyErr {
    static MODULE: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    let make = || {
        let module = MODULE.get_or_try_init(py, || py.import("supple.errors").map(Bound::unbind))?;
        let class = module.bind(py).getattr(name)?.cast_into::<PyType>()?;
        class.call((message,), Some(details))
    };
    make().map_or_else(|error| error, PyErr::from_value)
}

/// The exception for an error of a study.
pub fn of_study(py: Python<'_>, error: &StudyError) -> PyErr {
    let plain = |name| exception(py, name, &error.to_string(), &PyDict::new(py));
    match error {
        StudyError::File(error) => of_file(py, error),
        StudyError::Usage(_) => plain("UsageError"),
        StudyError::Compute(error) => of_compute(py, error),
        StudyError::Io { .. } => plain("StorageError"),
        StudyError::Kept { .. } => plain("KeptError"),
        StudyError::Stopped => plain("Interrupted"),
        // `ComputeOf`, and errors that are added to the library.
        _ => plain("ComputeError"),
    }
}

/// The exception for a file that is wrong or cannot be read.
pub fn of_file(py: Python<'_>, error: &FileError) -> PyErr {
    let details = PyDict::new(py);
    let FileError { file, line, column, key, help, .. } = error;
    let set = || -> PyResult<()> {
        details.set_item("file", file)?;
        details.set_item("line", line)?;
        details.set_item("column", column)?;
        details.set_item("key", key)?;
        details.set_item("help", help.as_deref())?;
        details.set_item("picture", picture(error).unwrap_or_default())
    };
    match set() {
        Ok(()) => exception(py, "FileError", &error.to_string(), &details),
        Err(error) => error,
    }
}

/// The exception for what could not be computed, or was asked for wrongly.
pub fn of_compute(py: Python<'_>, error: &supple::Error) -> PyErr {
    if matches!(error, supple::Error::Stopped) {
        return exception(py, "Interrupted", &error.to_string(), &PyDict::new(py));
    }
    let name = if error.is_of_request() { "UsageError" } else { "ComputeError" };
    exception(py, name, &error.to_string(), &PyDict::new(py))
}

/// The exception for a defect of the library, in place of one that `except Exception` does not see.
pub fn of_panic(py: Python<'_>, panic: &(dyn Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    let message = format!("internal error in supple, please report it: {}", text.unwrap_or("no message"));
    exception(py, "ComputeError", &message, &PyDict::new(py))
}

/// The exception for something wrong with what was asked for.
pub fn usage(py: Python<'_>, message: &str) -> PyErr {
    exception(py, "UsageError", message, &PyDict::new(py))
}
