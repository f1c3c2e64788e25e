//! Units of work: what worker processes do of a study, from bytes to bytes, on one thread.

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use rayon::ThreadPoolBuilder;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use supple::Stop;
use supple::design::StartSummary;
use supple::simulate::Estimate;
use supple::{Dimensions, Level};
use supple_study::StudyError;
use supple_study::study::{Unit, Work};

use crate::errors;
use crate::pool;
use crate::task::NativeTask;
use crate::watch::long_study;

/// The data that all units of a study share, beside the task.
#[derive(Serialize, Deserialize)]
pub struct Shared {
    pub work: Work,
    /// Of the optimum, where that is one of the designs.
    pub starts: Vec<StartSummary>,
}

impl From<Work> for Shared {
    fn from(work: Work) -> Self {
        Self { work, starts: Vec::new() }
    }
}

/// Does units of one study.
#[pyclass(name = "Units", module = "supple._supple", frozen)]
pub struct Units {
    task: Py<NativeTask>,
    units: supple_study::study::Units,
}

#[pymethods]
impl Units {
    #[new]
    fn new(py: Python<'_>, task: Py<NativeTask>, shared: &[u8]) -> PyResult<Self> {
        let Shared { work, starts } = from_bytes(py, shared)?;
        let loaded = &task.get().task;
        let pool = pool::pool(py)?;
        let units = py.detach(|| pool.install(|| supple_study::study::Units::new(loaded, &work, starts)));
        let units = units.map_err(|error| errors::of_study(py, &error))?;
        Ok(Self { task, units })
    }

    /// Does units, one after the other; the bytes of what each found.
    fn work<'py>(&self, py: Python<'py>, units: Vec<Vec<u8>>) -> PyResult<Vec<Bound<'py, PyBytes>>> {
        let units = units.iter().map(|unit| from_bytes(py, unit)).collect::<PyResult<Vec<Unit>>>()?;
        let NativeTask { task, failures } = self.task.get();
        // Units on one machine must not compete for its cores.
        let alone = ThreadPoolBuilder::new().num_threads(1).build();
        let alone = alone.map_err(|error| errors::usage(py, &format!("a thread cannot be made: {error}")))?;
        let work = |stop: Stop| {
            let found = units.into_iter().map(|unit| to_bytes(&self.units.work(task, unit, stop)?));
            found.collect::<Result<Vec<_>, _>>()
        };
        let found = long_study(py, None, failures, |watch| alone.install(|| work(watch.stop)))?;
        Ok(found.iter().map(|bytes| PyBytes::new(py, bytes)).collect())
    }
}

/// The instructions that numbers are computed with: results of others differ by rounding.
#[pyfunction]
pub fn instructions() -> String {
    name(Level::current())
}

/// Computes with these instructions from now on; false where this machine has none of that name.
#[pyfunction]
pub fn use_instructions(wanted: &str) -> bool {
    Level::ALL.into_iter().any(|level| name(level) == wanted && level.force())
}

/// The most steps that a task of a system of these sizes has.
#[pyfunction]
pub fn most_steps(states: usize, controls: usize) -> usize {
    supple::most_steps(Dimensions { states, controls, measurements: 1 })
}

/// Times of the steps 0 to N of a task, s, as results give them.
#[pyfunction]
pub fn times(steps: usize, time_step: f64) -> Vec<f64> {
    (0..=steps).map(|step| supple::time_of(step, time_step)).collect()
}

/// Mean of samples, and the 95 % confidence interval of their expectation; no interval of fewer than two.
#[pyfunction]
pub fn mean_and_interval(samples: Vec<f64>) -> (f64, Option<(f64, f64)>) {
    let found = Estimate::of(samples.into_iter());
    (found.mean, found.interval_95.map(|[low, high]| (low, high)))
}

fn name(level: Level) -> String {
    format!("{level:?}").to_lowercase()
}

/// A value as bytes for another process; every number keeps its bits.
pub fn to_bytes<T: Serialize>(value: &T) -> Result<Vec<u8>, StudyError> {
    let mut bytes = Vec::new();
    match ciborium::into_writer(value, &mut bytes) {
        Ok(()) => Ok(bytes),
        Err(error) => Err(StudyError::Usage(format!("a unit of work cannot be written: {error}"))),
    }
}

/// The value of bytes that another process wrote.
pub fn from_bytes<T: DeserializeOwned>(py: Python<'_>, bytes: &[u8]) -> PyResult<T> {
    let wrong = |error| errors::usage(py, &format!("a unit of work cannot be read: {error}"));
    ciborium::from_reader(bytes).map_err(wrong)
}
