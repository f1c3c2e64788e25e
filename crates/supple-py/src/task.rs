//! Tasks, and the studies that are made of them.

use std::path::PathBuf;

use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use supple::design::DesignSettings;
use supple::simulate::Rollouts;
use supple::{Kinds, Matrices, Named};
use supple_study::study::{Work, on_threads};
use supple_study::{About, Folder, LoadedTask, Made, OWN_MODEL, Source, StudyError, StudyResult, Watch};

use crate::arrays::to_python;
use crate::errors;
use crate::json::from_json;
use crate::options::{self, AxisValues, Designed};
use crate::own::{self, Failures};
use crate::plant;
use crate::pool;
use crate::result::Kept;
use crate::watch::{long, long_study};

/// A problem with the values of its parameters.
#[pyclass(name = "NativeTask", module = "supple._supple", frozen)]
pub struct NativeTask {
    pub task: LoadedTask,
    pub failures: Failures,
}

impl NativeTask {
    /// Does a study of this task. Its journal, where it has one, is in the folder, which holds the result at the end.
    fn study(
        &self,
        py: Python<'_>,
        work: Work,
        jobs: Option<usize>,
        out: Option<PathBuf>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Kept> {
        let of_study = |error| errors::of_study(py, &error);
        let folder = out.as_deref();
        folder.map_or(Ok(()), |folder| Folder::check_for(folder, &work)).map_err(of_study)?;
        let kept = self.made_by(py, work, progress, |work, task, watch| {
            match on_threads(jobs, || work.run(task, folder, watch))? {
                StudyResult::Sweep(sweep) if !sweep.complete => Err(StudyError::Stopped),
                result => Ok(result),
            }
        })?;
        if let Some(folder) = folder {
            let Folder { made, result, .. } = &*kept.0;
            Folder::conclude(folder, made, result).map_err(of_study)?;
        }
        Ok(kept)
    }

    /// Makes the result of work on this task, whoever did it.
    pub fn made_by(
        &self,
        py: Python<'_>,
        work: Work,
        progress: Option<&Bound<'_, PyAny>>,
        result: impl FnOnce(&Work, &LoadedTask, Watch<'_>) -> Result<StudyResult, StudyError> + Send,
    ) -> PyResult<Kept> {
        let result = long_study(py, progress, &self.failures, |watch| result(&work, &self.task, watch))?;
        Ok(Kept::new(Made::of(&self.task, work), result))
    }
}

#[pymethods]
impl NativeTask {
    /// Reads a task file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, values: Vec<(String, f64)>) -> PyResult<Self> {
        let pool = pool::pool(py)?;
        let task = py
            .detach(|| pool.install(|| LoadedTask::load(&path)?.setting(&Named(values))))
            .map_err(|error| errors::of_study(py, &error))?;
        Ok(Self { task, failures: Failures::default() })
    }

    /// The task that another process read from texts by path, the task file's first; no file is read.
    #[staticmethod]
    fn restore(py: Python<'_>, sources: Vec<(String, String)>, values: Vec<(String, f64)>) -> PyResult<Self> {
        let pool = pool::pool(py)?;
        let sources: Vec<Source> = sources.into_iter().map(|(path, text)| Source { path, text }).collect();
        let task = py.detach(|| pool.install(|| LoadedTask::restore(&sources)?.setting(&Named(values))));
        Ok(Self { task: task.map_err(|error| errors::of_study(py, &error))?, failures: Failures::default() })
    }

    /// A task that Python describes. Its `source`, a text, stands in for the task file: results store it, and journals use
    /// it to identify the task.
    #[staticmethod]
    fn own(description: &Bound<'_, PyDict>) -> PyResult<Self> {
        let failures = Failures::default();
        let problem = own::problem(description, &failures)?;
        let phi = problem.parameters.initial();
        let text = description.get_item("source")?.map_or_else(|| Ok(String::new()), |text| text.extract())?;
        let sources = vec![Source { path: OWN_MODEL.to_owned(), text }];
        Ok(Self { task: LoadedTask { problem, phi, sources, kinds: Kinds::default() }, failures })
    }

    /// The same task, whose plans start also from these controls, of tasks by name, one row per step.
    fn knowing(&self, controls: Vec<(String, Vec<Vec<f64>>)>) -> Self {
        let mut task = self.task.clone();
        controls.iter().for_each(|(name, rows)| task.know(name, rows));
        Self { task, failures: self.failures.clone() }
    }

    /// The same task with other values of some parameters.
    fn with_values(&self, py: Python<'_>, values: Vec<(String, f64)>) -> PyResult<Self> {
        let mut task = self.task.clone();
        for (name, value) in &values {
            task.problem
                .parameters
                .set(&mut task.phi, name, *value)
                .map_err(|error| errors::of_compute(py, &error.into()))?;
        }
        Ok(Self { task, failures: self.failures.clone() })
    }

    /// Title, parameters and tasks, as a dict.
    fn about(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        to_python(py, &About::of(&self.task.problem))
    }

    /// Parameters by name.
    fn values(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        to_python(py, &Named::new(&self.task.problem.parameters, &self.task.phi))
    }

    /// Warnings about ignored or most likely wrong parts of the files.
    fn warnings(&self) -> Vec<String> {
        self.task.problem.warnings.clone()
    }

    /// Names and texts of the files that the task was read from.
    fn sources(&self) -> Vec<(String, String)> {
        self.task.sources.iter().map(|source| (source.path.clone(), source.text.clone())).collect()
    }

    /// The settings of the design search, as a dict.
    fn design_settings(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        to_python(py, &self.task.problem.design)
    }

    /// How many roll-outs results end with where nothing else is said.
    fn rollouts(&self) -> usize {
        self.task.problem.rollouts(None)
    }

    /// The states of a task, (N + 1, n), that controls, (N, m), lead to without noise and feedback.
    fn simulate(
        &self,
        py: Python<'_>,
        task: &str,
        controls: PyReadonlyArray2<'_, f64>,
        start: Option<Vec<f64>>,
    ) -> PyResult<Py<PyAny>> {
        let given = controls.as_array();
        let mut rows = Matrices::vectors(given.nrows(), given.ncols());
        for (t, row) in given.rows().into_iter().enumerate() {
            rows.vector_mut(t).iter_mut().zip(row).for_each(|(to, u)| *to = *u);
        }
        let motion = long(py, None, &self.failures, |_| {
            let LoadedTask { problem, phi, .. } = &self.task;
            let task = problem.task(task)?;
            task.simulate(phi, start.as_deref(), rows)
        })?;
        to_python(py, &motion.map_err(|error| errors::of_compute(py, &error))?.states.to_rows())
    }

    /// Compares every derivative with finite differences; a dict.
    fn check(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let LoadedTask { problem, phi, .. } = &self.task;
        let found = long(py, None, &self.failures, |_| supple::check::check(problem, phi))?;
        to_python(py, &found.map_err(|error| errors::of_compute(py, &error))?)
    }

    /// The linear system that a task is along its plan; a dict.
    fn linearise(&self, py: Python<'_>, task: &str) -> PyResult<Py<PyAny>> {
        let LoadedTask { problem, phi, .. } = &self.task;
        let found = long(py, None, &self.failures, |_| problem.linearise(phi, task))?;
        to_python(py, &found.map_err(|error| errors::of_compute(py, &error))?)
    }

    /// The text of the task file as JSON.
    fn tables(&self, py: Python<'_>) -> PyResult<String> {
        plant::tables(py, &self.task)
    }

    /// Names and units of states, controls and measurements; a dict.
    fn channels(&self, py: Python<'_>, task: &str) -> PyResult<Py<PyAny>> {
        to_python(py, &plant::channels(&self.task, task).map_err(|error| errors::of_compute(py, &error))?)
    }

    /// Limits of the robot: their names in reports, those of the state, control or effort, and the ends.
    fn robot_limits(&self, py: Python<'_>, task: &str) -> PyResult<Vec<(String, String, f64, f64)>> {
        plant::robot_limits(&self.task, task).map_err(|error| errors::of_compute(py, &error))
    }

    /// The number that a text in its place means: the name of a parameter, or an expression of parameters.
    fn number(&self, py: Python<'_>, text: &str) -> PyResult<f64> {
        plant::number(&self.task, text).map_err(|error| errors::usage(py, &error.to_string()))
    }

    /// The same task with other numbers for elements of lists of `[model]` (by list, name and key), for parameters (even out
    /// of bounds), and for the number of sub-steps.
    #[pyo3(signature = (numbers, parameters, substeps=None))]
    fn changed(
        &self,
        py: Python<'_>,
        numbers: Vec<(String, String, String, Vec<plant::Entry>)>,
        parameters: Vec<(String, f64)>,
        substeps: Option<u32>,
    ) -> PyResult<Self> {
        let task = plant::changed(py, &self.task, &numbers, &parameters, substeps)?;
        Ok(Self { task, failures: self.failures.clone() })
    }

    /// Roll-outs of a task's plan on a plant, with measurements, costs and contacts of `truth`, and on its own model; a
    /// dict.
    fn roll_out_elsewhere(
        &self,
        py: Python<'_>,
        task: &str,
        truth: Py<Self>,
        plant: Py<PyAny>,
        sizes: (usize, u64),
    ) -> PyResult<Py<PyAny>> {
        let (own, failures, truth) = (&self.task, &self.failures, &truth.get().task);
        let rollouts = Rollouts { count: sizes.0, seed: sizes.1 };
        let found = long(py, None, failures, |_| plant::roll_out(own, failures, task, truth, &plant, rollouts))?;
        to_python(py, &found.map_err(|error| errors::of_compute(py, &error))?)
    }

    /// Does a study: what to do, as JSON. A study with a folder resumes from its journal.
    #[pyo3(signature = (work, *, out, progress))]
    fn conduct(
        &self,
        py: Python<'_>,
        work: &str,
        out: Option<PathBuf>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Kept> {
        let work: Work = from_json(py, work)?;
        if let Work::Design(settings) = &work {
            check_settings(py, settings)?;
        }
        self.study(py, work, None, out, progress)
    }

    /// Evaluates every design of a grid; `place` is how many points at once, and the folder of the journal.
    #[pyo3(signature = (grid, *, sizes, place, progress))]
    fn sweep(
        &self,
        py: Python<'_>,
        grid: Vec<(String, AxisValues)>,
        sizes: (usize, usize, usize, u64),
        place: (Option<usize>, Option<PathBuf>),
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Kept> {
        let ((rollouts, starts, branches, seed), (jobs, out)) = (sizes, place);
        let work = Work::Sweep(options::sweep(py, &self.task, grid, rollouts, starts, branches, seed)?);
        self.study(py, work, jobs, out, progress)
    }

    /// Costs in closed loop as a noise grows; `studied` are the designs and what varies.
    #[pyo3(signature = (studied, *, sizes, out, progress))]
    fn robustness(
        &self,
        py: Python<'_>,
        studied: (Vec<Designed>, (String, AxisValues)),
        sizes: (usize, u64),
        out: Option<PathBuf>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Kept> {
        let (designs, (name, values)) = studied;
        let rollouts = Rollouts { count: sizes.0, seed: sizes.1 };
        let work = Work::Robustness(options::robustness(py, &self.task, designs, &name, values, rollouts)?);
        self.study(py, work, None, out, progress)
    }
}

/// Settings of a design search, checked.
pub fn design_settings(py: Python<'_>, json: &str) -> PyResult<DesignSettings> {
    let settings = from_json(py, json)?;
    check_settings(py, &settings)?;
    Ok(settings)
}

fn check_settings(py: Python<'_>, settings: &DesignSettings) -> PyResult<()> {
    settings.check().map_err(|unfit| errors::usage(py, &unfit.to_string()))
}
