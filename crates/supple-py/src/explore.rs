//! The explorer, served from threads of this process.

use std::any::Any;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use supple_explore::{Explorer, Surroundings};

use crate::errors;
use crate::own::Failures;
use crate::pool::Running;
use crate::task::NativeTask;

/// The process that opened the first explorer. Its threads do not exist in a forked child.
static FIRST: AtomicU32 = AtomicU32::new(0);

/// The interpreter, around computations of an explorer: Ctrl-C ends a study without affecting them, and exceptions
/// of a model in Python are sent to the page.
struct Interpreter(Failures);

impl Surroundings for Interpreter {
    fn enter(&self) -> Box<dyn Any> {
        Box::new(Running::begin())
    }

    fn failure(&self) -> Option<String> {
        self.0.take().map(|error| format!("the model's own functions failed: {error}"))
    }
}

/// A server of a page with sliders.
#[pyclass(name = "NativeExplorer", module = "supple._supple", frozen)]
pub struct NativeExplorer {
    explorer: Arc<Explorer>,
    failures: Failures,
    process: u32,
    serving: Mutex<Option<JoinHandle<()>>>,
}

#[pymethods]
impl NativeExplorer {
    /// Opens a page for a task; where `file` is given, it is watched.
    #[staticmethod]
    fn open(py: Python<'_>, task: &NativeTask, file: Option<PathBuf>, port: Option<u16>) -> PyResult<Self> {
        let process = std::process::id();
        let first =
            FIRST.compare_exchange(0, process, Ordering::Relaxed, Ordering::Relaxed).unwrap_or_else(|first| first);
        if first != 0 && first != process {
            return Err(errors::usage(
                py,
                "an explorer was opened before this process was forked, and its threads do not exist in the child; use the start method `spawn`",
            ));
        }
        // An earlier exception must not be attributed to the page.
        drop(task.failures.take());
        let surroundings = Arc::new(Interpreter(task.failures.clone()));
        let loaded = task.task.clone();
        let opened = py.detach(|| Explorer::open_within(surroundings, loaded, file, port));
        let explorer = Arc::new(opened.map_err(|error| errors::usage(py, &in_python(&error.to_string())))?);
        let serving = Arc::clone(&explorer);
        let serving = std::thread::spawn(move || serving.serve());
        Ok(Self { explorer, failures: task.failures.clone(), process, serving: Mutex::new(Some(serving)) })
    }

    /// The address of the page, with its token.
    fn address(&self) -> String {
        self.explorer.address()
    }

    /// The design on screen: dicts `parameters`, `limits` and `noise`, and whether the file was read again.
    fn screen<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let screen = self.explorer.screen();
        let found = PyDict::new(py);
        for (key, list) in [("parameters", screen.parameters), ("limits", screen.limits), ("noise", screen.noise)] {
            let values = PyDict::new(py);
            list.into_iter().try_for_each(|(name, value)| values.set_item(name, value))?;
            found.set_item(key, values)?;
        }
        found.set_item("reread", screen.reread)?;
        Ok(found)
    }

    /// The design on screen as a task.
    fn task(&self, py: Python<'_>) -> PyResult<NativeTask> {
        let task = py.detach(|| self.explorer.task()).map_err(|error| errors::of_study(py, &error))?;
        Ok(NativeTask { task, failures: self.failures.clone() })
    }

    /// Whether it was closed.
    fn is_closed(&self) -> bool {
        self.explorer.is_closed()
    }

    /// Ends pages and server. A forked child leaves those of its parent alone.
    fn close(&self, py: Python<'_>) {
        if self.process != std::process::id() || self.explorer.is_closed() {
            return;
        }
        py.detach(|| {
            self.explorer.close();
            let serving = self.serving.lock().unwrap_or_else(PoisonError::into_inner).take();
            // A server that panicked has ended too.
            let _ = serving.map(JoinHandle::join);
        });
    }
}

/// A sentence about options of the program in the words of Python.
fn in_python(text: &str) -> String {
    text.replace("--port", "port=")
}
