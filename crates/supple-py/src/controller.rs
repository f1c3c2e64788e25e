//! Controllers taken from results, run a step at a time.

use std::path::PathBuf;

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use supple::ControllerRun;
use supple::simulate::Rollouts;
use supple_study::controller::{At, ControllerFile, ControllerFormat, ExportedController};

use crate::arrays::to_python;
use crate::errors;
use crate::own::Failures;
use crate::result::Kept;
use crate::task::NativeTask;
use crate::watch::long;

/// A controller and one run of it.
#[pyclass(name = "NativeController", module = "supple._supple")]
pub struct NativeController {
    exported: ExportedController,
    failures: Failures,
    run: ControllerRun,
    /// The measurement of a step.
    measured: Vec<f64>,
}

#[pymethods]
impl NativeController {
    /// That of a task of a result, at its `start` or `optimum` where it has both; `task` is what the result was made
    /// of, where that is at hand.
    #[staticmethod]
    #[pyo3(signature = (result, task, *, name, at))]
    fn of(
        py: Python<'_>,
        result: &Kept,
        task: Option<&NativeTask>,
        name: Option<String>,
        at: Option<&str>,
    ) -> PyResult<Self> {
        let at = match at {
            None => None,
            Some("start") => Some(At::Start),
            Some("optimum") => Some(At::Optimum),
            Some(other) => {
                return Err(errors::usage(py, &format!("at={other:?} is invalid; valid: \"start\", \"optimum\"")));
            }
        };
        let failures = task.map_or_else(Failures::default, |task| task.failures.clone());
        let folder = &result.0;
        let loaded = task.map(|task| &task.task);
        let made = long(py, None, &failures, |_| ExportedController::of(folder, loaded, name.as_deref(), at))?;
        let exported = made.map_err(|error| errors::of_study(py, &error))?;
        let run = exported.controller.start();
        let measured = vec![0.0; exported.controller.dimensions.measurements];
        Ok(Self { exported, failures, run, measured })
    }

    /// Names, units and arrays, as a dict.
    fn data(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        to_python(py, &ControllerFile::of(&self.exported))
    }

    /// The controls of the next step, given its measurement; `None` once the plan is over.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        y: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let y = y.as_array();
        if y.len() != self.measured.len() {
            let what = "the measurement".to_owned();
            let error = supple::lqg::Error::Shape { what, found: y.len(), expected: self.measured.len() };
            return Err(errors::of_compute(py, &error.into()));
        }
        self.measured.iter_mut().zip(y).for_each(|(to, &y)| *to = y);
        match self.exported.controller.step(&mut self.run, &self.measured) {
            Ok(true) => Ok(Some(PyArray1::from_slice(py, &self.run.controls))),
            Ok(false) => Ok(None),
            Err(error) => Err(errors::of_compute(py, &error)),
        }
    }

    /// Begins the plan anew.
    fn reset(&mut self) {
        self.run = self.exported.controller.start();
    }

    /// The step whose measurement comes next.
    #[getter]
    fn position(&self) -> usize {
        self.run.step
    }

    /// The state at the last measurement, as estimated with it.
    #[getter]
    fn estimate<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.run.estimate)
    }

    /// What it costs in closed loop with the model, as a dict.
    fn monte_carlo(&self, py: Python<'_>, rollouts: usize, seed: u64) -> PyResult<Py<PyAny>> {
        let rollouts = Rollouts { count: rollouts, seed };
        let found = long(py, None, &self.failures, |_| self.exported.monte_carlo(rollouts))?;
        to_python(py, &found.map_err(|error| errors::of_study(py, &error))?)
    }

    /// Writes it as `c`, `json` or `npz`; the files written.
    fn write(&self, py: Python<'_>, format: &str, path: PathBuf) -> PyResult<Vec<PathBuf>> {
        let formats = [ControllerFormat::C, ControllerFormat::Json, ControllerFormat::Npz];
        let known = formats.into_iter().find(|known| known.extension() == format);
        let format = known.ok_or_else(|| errors::usage(py, &format!("unknown format `{format}`")))?;
        py.detach(|| self.exported.write(format, &path)).map_err(|error| errors::of_study(py, &error))
    }
}
