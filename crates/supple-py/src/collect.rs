//! Studies whose units of work are done by other processes: they hand out units and combine the results.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use supple::design::{Control, DesignSettings};
use supple::simulate::Rollouts;
use supple_study::robustness::{DesignChoice, RobustnessOptions};
use supple_study::study::{Found, Unit, Work};
use supple_study::sweep::{Collector, SweepOptions, SweepUnit};
use supple_study::{Folder, Made, StudyError, StudyResult, robustness};

use crate::errors;
use crate::options::{AxisValues, Designed};
use crate::result::Kept;
use crate::task::{NativeTask, design_settings};
use crate::unit::{Shared, from_bytes, to_bytes};

/// A unit: its bytes, how many parts of the work it is, and its name in words.
type Given<'py> = (Bound<'py, PyBytes>, usize, String);

fn pack<'py, T: serde::Serialize>(py: Python<'py>, value: &T) -> PyResult<Bound<'py, PyBytes>> {
    let bytes = to_bytes(value).map_err(|error| errors::of_study(py, &error))?;
    Ok(PyBytes::new(py, &bytes))
}

/// The results of units, of the kind that `of` takes.
fn unpack<T>(py: Python<'_>, all: &[Vec<u8>], of: impl Fn(Found) -> Result<T, StudyError>) -> PyResult<Vec<T>> {
    let read = |bytes| of(from_bytes(py, bytes)?).map_err(|error| errors::of_study(py, &error));
    all.iter().map(|bytes: &Vec<u8>| read(bytes)).collect()
}

/// A sweep.
#[pyclass(name = "SweepCollector", module = "supple._supple", frozen)]
pub struct SweepCollector {
    task: Py<NativeTask>,
    options: SweepOptions,
    /// There until it is finished.
    collector: Mutex<Option<Collector>>,
}

impl SweepCollector {
    fn lock(&self) -> MutexGuard<'_, Option<Collector>> {
        self.collector.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Collector) -> Result<T, StudyError> + Send,
    ) -> PyResult<T> {
        let done = py.detach(|| match &mut *self.lock() {
            Some(collector) => work(collector),
            None => Err(closed()),
        });
        done.map_err(|error| errors::of_study(py, &error))
    }
}

fn closed() -> StudyError {
    StudyError::usage("this sweep is closed")
}

#[pymethods]
impl SweepCollector {
    #[new]
    #[pyo3(signature = (task, grid, *, sizes, out))]
    fn new(
        py: Python<'_>,
        task: Py<NativeTask>,
        grid: Vec<(String, AxisValues)>,
        sizes: (usize, usize, usize, u64),
        out: Option<PathBuf>,
    ) -> PyResult<Self> {
        let native = task.get();
        let (rollouts, starts, branches, seed) = sizes;
        let options = crate::options::sweep(py, &native.task, grid, rollouts, starts, branches, seed)?;
        let opened = py.detach(|| {
            if let Some(folder) = &out {
                Folder::check_for(folder, &Work::Sweep(options.clone()))?;
            }
            Collector::open(&native.task, &options, out.as_deref())
        });
        let collector = opened.map_err(|error| errors::of_study(py, &error))?;
        Ok(Self { task, options, collector: Mutex::new(Some(collector)) })
    }

    /// What its units share, for `Units`.
    fn shared<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        pack(py, &Shared::from(Work::Sweep(self.options.clone())))
    }

    /// Points that were done before, and all points.
    fn points(&self, py: Python<'_>) -> PyResult<(usize, usize)> {
        self.with(py, |collector| Ok(collector.points()))
    }

    /// Segments that were not given out yet, at most.
    fn segments_left(&self, py: Python<'_>) -> PyResult<usize> {
        self.with(py, |collector| Ok(collector.segments_left()))
    }

    /// The next unit, of so many segments at most: its bytes, how many these are, and its points in words.
    fn next_unit<'py>(&self, py: Python<'py>, most: usize) -> PyResult<Option<Given<'py>>> {
        let next = self.with(py, |collector| {
            let next = collector.next_unit(most);
            Ok(next.map(|unit| (collector.describe(&unit), unit)))
        })?;
        let Some((words, unit)) = next else { return Ok(None) };
        let segments = unit.segments.len();
        Ok(Some((pack(py, &Unit::Segments(unit))?, segments, words)))
    }

    /// Keeps what units found, all of it or nothing; the number of points.
    fn keep(&self, py: Python<'_>, done: Vec<(Vec<u8>, Vec<u8>)>) -> PyResult<usize> {
        let read = |(unit, rows): &(Vec<u8>, Vec<u8>)| -> PyResult<(SweepUnit, Vec<String>)> {
            match from_bytes(py, unit)? {
                Unit::Segments(unit) => {
                    let rows = from_bytes::<Found>(py, rows)?.rows();
                    Ok((unit, rows.map_err(|error| errors::of_study(py, &error))?))
                }
                _ => Err(errors::usage(py, "this unit does not belong to a sweep")),
            }
        };
        let done = done.iter().map(read).collect::<PyResult<Vec<_>>>()?;
        self.with(py, |collector| collector.keep(&done))
    }

    /// Closes the journal; the study can be resumed from it.
    fn close(&self, py: Python<'_>) {
        py.detach(|| drop(self.lock().take()));
    }

    /// Closes it and makes the result, which has to be complete.
    fn finish(&self, py: Python<'_>) -> PyResult<Kept> {
        let sweep = py.detach(|| self.lock().take().ok_or_else(closed).and_then(Collector::finish));
        let sweep = sweep.and_then(|sweep| if sweep.complete { Ok(sweep) } else { Err(StudyError::Stopped) });
        let sweep = sweep.map_err(|error| errors::of_study(py, &error))?;
        let made = Made::of(&self.task.get().task, Work::Sweep(self.options.clone()));
        Ok(Kept::new(made, StudyResult::Sweep(Box::new(sweep))))
    }
}

/// A design search.
#[pyclass(name = "DesignCollector", module = "supple._supple", frozen)]
pub struct DesignCollector {
    task: Py<NativeTask>,
    settings: DesignSettings,
}

#[pymethods]
impl DesignCollector {
    /// With settings as JSON.
    #[new]
    fn new(py: Python<'_>, task: Py<NativeTask>, settings: &str) -> PyResult<Self> {
        Ok(Self { task, settings: design_settings(py, settings)? })
    }

    /// What its units share, for `Units`.
    fn shared<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        pack(py, &Shared::from(Work::Design(Box::new(self.settings.clone()))))
    }

    /// A unit by start.
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Vec<Given<'py>>> {
        let unit = |start| Ok((pack(py, &Unit::Start(start))?, 1, format!("start {start}")));
        (0..self.settings.starts).map(unit).collect()
    }

    /// Makes the result of what all starts found, in their order, in so many seconds.
    fn finish(&self, py: Python<'_>, found: Vec<Vec<u8>>, seconds: f64) -> PyResult<Kept> {
        let found = unpack(py, &found, Found::start)?;
        let settings = &self.settings;
        self.task.get().made_by(py, Work::Design(Box::new(settings.clone())), None, |_, task, watch| {
            let control = Control { stop: watch.stop, ..Control::default() };
            let report = supple_study::design::combine(task, settings, found, seconds, control)?;
            Ok(StudyResult::Design(Box::new(report)))
        })
    }
}

/// A study of robustness.
#[pyclass(name = "RobustnessCollector", module = "supple._supple", frozen)]
pub struct RobustnessCollector {
    task: Py<NativeTask>,
    options: RobustnessOptions,
    /// How many designs and cells there are.
    parts: (usize, usize),
}

#[pymethods]
impl RobustnessCollector {
    #[new]
    fn new(
        py: Python<'_>,
        task: Py<NativeTask>,
        designs: Vec<Designed>,
        vary: (String, AxisValues),
        sizes: (usize, u64),
    ) -> PyResult<Self> {
        let loaded = &task.get().task;
        let ((name, values), (count, seed)) = (vary, sizes);
        let options = crate::options::robustness(py, loaded, designs, &name, values, Rollouts { count, seed })?;
        let parts = robustness::parts(loaded, &options).map_err(|error| errors::of_study(py, &error))?;
        Ok(Self { task, options, parts })
    }

    /// The search for the optimum, where that is one of the designs.
    fn optimum(&self, py: Python<'_>) -> Option<DesignCollector> {
        let settings = self.task.get().task.problem.design.clone();
        let wanted = self.options.designs.contains(&DesignChoice::Optimum);
        wanted.then(|| DesignCollector { task: self.task.clone_ref(py), settings })
    }

    /// What its other units share, for `Units`, with what the starts of the optimum found.
    fn shared<'py>(&self, py: Python<'py>, starts: Vec<Vec<u8>>) -> PyResult<Bound<'py, PyBytes>> {
        let starts = unpack(py, &starts, Found::start)?;
        pack(py, &Shared { work: Work::Robustness(self.options.clone()), starts })
    }

    /// A unit by design.
    fn designs<'py>(&self, py: Python<'py>) -> PyResult<Vec<Given<'py>>> {
        let named = self.options.designs.iter().enumerate();
        let unit = |(index, choice): (usize, &DesignChoice)| {
            Ok((pack(py, &Unit::Design(index))?, 1, format!("the design `{}`", choice.name())))
        };
        named.map(unit).collect()
    }

    /// A unit by cell, in the order of the result.
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Vec<Given<'py>>> {
        let unit = |cell| Ok((pack(py, &Unit::Cells(cell..cell + 1))?, 1, format!("cell {cell}")));
        (0..self.parts.1).map(unit).collect()
    }

    /// Makes the result of what all designs and cells found, in their order.
    fn finish(&self, py: Python<'_>, designs: Vec<Vec<u8>>, cells: Vec<Vec<u8>>) -> PyResult<Kept> {
        let designs = unpack(py, &designs, Found::design)?;
        let costs = unpack(py, &cells, Found::cells)?.into_iter().flatten().collect();
        self.task.get().made_by(py, Work::Robustness(self.options.clone()), None, |_, task, _| {
            let result = robustness::combine(task, &self.options, designs, costs)?;
            Ok(StudyResult::Robustness(Box::new(result)))
        })
    }
}
