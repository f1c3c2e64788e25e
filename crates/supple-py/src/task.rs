//! Tasks, and the studies that are made of them.

use std::path::{Path, PathBuf};

use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::ThreadPoolBuilder;
use supple::design::{Control, DesignSettings};
use supple::parameters::Scale;
use supple::{EvaluateOptions, Kinds, Matrices, Named};
use supple_study::bound::BoundOptions;
use supple_study::evaluate::EvaluateReport;
use supple_study::pareto::ParetoOptions;
use supple_study::sensors::SensorsOptions;
use supple_study::sweep::{SweepOptions, TABLE_CSV};
use supple_study::trace::TraceOptions;
use supple_study::{
    About, Folder, LoadedTask, Made, OWN_MODEL, RESULT, Source, StudyError, StudyResult, Watch, check_writable,
};

use crate::arrays::to_python;
use crate::errors;
use crate::options::{self, AxisValues, Designed};
use crate::own::{self, Failures};
use crate::plant;
use crate::pool;
use crate::result::Kept;
use crate::watch::{Search, long};

/// A problem with the values of its parameters.
#[pyclass(name = "NativeTask", module = "supple._supple", frozen)]
pub struct NativeTask {
    pub task: LoadedTask,
    pub failures: Failures,
}

impl NativeTask {
    /// Does long work on this task and makes a result of what it finds.
    pub fn study(
        &self,
        py: Python<'_>,
        (command, arguments, seed): (&str, Vec<String>, u64),
        progress: Option<&Bound<'_, PyAny>>,
        work: impl FnOnce(&LoadedTask, Watch<'_>) -> Result<StudyResult, StudyError> + Send,
    ) -> PyResult<Kept> {
        let found = long(py, progress, &self.failures, |watch| work(&self.task, watch))?;
        let result = found.map_err(|error| errors::of_study(py, &error))?;
        let made = Made { arguments, ..Made::here(command, seed, &self.task) };
        Ok(Kept::new(made, result))
    }

    /// The same for studies whose journal, in the folder, keeps finished parts: it holds the result at the end.
    fn resumable(
        &self,
        py: Python<'_>,
        command: (&str, Vec<String>, u64),
        (out, progress): (Option<PathBuf>, Option<&Bound<'_, PyAny>>),
        work: impl FnOnce(&LoadedTask, Option<&Path>, Watch<'_>) -> Result<StudyResult, StudyError> + Send,
    ) -> PyResult<Kept> {
        let of_study = |error| errors::of_study(py, &error);
        let Some(folder) = out else { return self.study(py, command, progress, |task, watch| work(task, None, watch)) };
        check_writable(&folder, RESULT).map_err(of_study)?;
        let kept = self.study(py, command, progress, |task, watch| work(task, Some(&folder), watch))?;
        let Folder { made, result, .. } = &*kept.0;
        Folder::conclude(&folder, made, result).map_err(of_study)?;
        Ok(kept)
    }
}

#[pymethods]
impl NativeTask {
    /// Reads a task file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, values: Vec<(String, f64)>) -> PyResult<Self> {
        let pool = pool::pool(py)?;
        let task = py
            .detach(|| pool.install(|| LoadedTask::load(&path, &values)))
            .map_err(|error| errors::of_study(py, &error))?;
        Ok(Self { task, failures: Failures::default() })
    }

    /// The task that another process read from texts by path, the task file's first; no file is read.
    #[staticmethod]
    fn restore(py: Python<'_>, sources: Vec<(String, String)>, values: Vec<(String, f64)>) -> PyResult<Self> {
        let pool = pool::pool(py)?;
        let sources: Vec<Source> = sources.into_iter().map(|(path, text)| Source { path, text }).collect();
        let task = py.detach(|| pool.install(|| LoadedTask::restore(&sources, &values)));
        Ok(Self { task: task.map_err(|error| errors::of_study(py, &error))?, failures: Failures::default() })
    }

    /// A task that Python describes. Its `source`, a text, stands for the task file: results keep it, and journals know by it
    /// what they belong to.
    #[staticmethod]
    fn own(description: &Bound<'_, PyDict>) -> PyResult<Self> {
        let failures = Failures::default();
        let problem = own::problem(description, &failures)?;
        let phi = problem.parameters.initial();
        let text = description.get_item("source")?.map_or_else(|| Ok(String::new()), |text| text.extract())?;
        let sources = vec![Source { path: OWN_MODEL.to_owned(), text }];
        Ok(Self { task: LoadedTask { problem, phi, sources, kinds: Kinds::default() }, failures })
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

    /// Evaluates the design that the parameters are.
    #[pyo3(signature = (made, *, gradients, sizes, needed, trajectories))]
    fn evaluate(
        &self,
        py: Python<'_>,
        made: Vec<String>,
        gradients: (bool, bool),
        sizes: (usize, usize, u64),
        needed: bool,
        trajectories: bool,
    ) -> PyResult<Kept> {
        let (rollouts, branches, seed) = sizes;
        let wanted = EvaluateOptions {
            total_gradient: gradients.0,
            frozen_gradient: gradients.1,
            needed,
            rollouts,
            seed,
            branches,
            trajectories,
            ..Default::default()
        };
        self.study(py, ("evaluate", made, seed), None, |task, _| {
            let evaluation = task.problem.evaluate(&task.phi, &wanted)?;
            Ok(StudyResult::Evaluate(Box::new(EvaluateReport { evaluation })))
        })
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

    /// The same task with other numbers for elements of compliance, by name and key, and for parameters, bounds or not.
    fn changed(
        &self,
        py: Python<'_>,
        numbers: Vec<(String, String, Vec<plant::Entry>)>,
        parameters: Vec<(String, f64)>,
    ) -> PyResult<Self> {
        let task = plant::changed(py, &self.task, &numbers, &parameters)?;
        Ok(Self { task, failures: self.failures.clone() })
    }

    /// Roll-outs of a task's plan on a plant, with measurements, costs and contacts of `truth`, and on its own model; a dict.
    fn roll_out_elsewhere(
        &self,
        py: Python<'_>,
        task: &str,
        truth: Py<Self>,
        plant: Py<PyAny>,
        sizes: (usize, u64),
    ) -> PyResult<Py<PyAny>> {
        let given = ((&self.task, &self.failures), (task, &truth.get().task));
        let found = long(py, None, &self.failures, |_| plant::roll_out(given.0, given.1, &plant, sizes))?;
        to_python(py, &found.map_err(|error| errors::of_compute(py, &error))?)
    }

    /// Searches for a design; `settings` are the task's, changed, as JSON.
    fn design(
        &self,
        py: Python<'_>,
        made: Vec<String>,
        settings: &str,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Kept> {
        let settings = design_settings(py, settings)?;
        self.study(py, ("design", made, settings.seed), progress, |task, watch| {
            let search = Search::new(watch.progress, settings.feasibility);
            let control = Control { observer: &search, stop: watch.stop };
            Ok(StudyResult::Design(Box::new(supple_study::design::run(task, &settings, control)?)))
        })
    }

    /// Evaluates every design of a grid; `place` is how many points at once, and the folder of the journal.
    #[pyo3(signature = (made, grid, *, sizes, place, progress))]
    fn sweep(
        &self,
        py: Python<'_>,
        made: Vec<String>,
        grid: Vec<(String, AxisValues)>,
        sizes: (usize, usize, u64),
        place: (Option<usize>, Option<PathBuf>),
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Kept> {
        let (jobs, out) = place;
        let options = self.sweep_options(py, grid, sizes)?;
        if let Some(folder) = &out {
            check_writable(folder, TABLE_CSV).map_err(|error| errors::of_study(py, &error))?;
        }
        self.study(py, ("sweep", made, sizes.2), progress, |task, watch| {
            let sweep = || supple_study::sweep::run(task, &options, out.as_deref(), watch);
            let sweep = match jobs {
                None => sweep()?,
                Some(jobs) => {
                    let pool = ThreadPoolBuilder::new().num_threads(jobs).build();
                    pool.map_err(|error| StudyError::usage(format!("jobs = {jobs}: {error}")))?.install(sweep)?
                }
            };
            if sweep.complete { Ok(StudyResult::Sweep(Box::new(sweep))) } else { Err(StudyError::Stopped) }
        })
    }

    /// Costs in closed loop as a noise grows; `studied` are the designs and what varies.
    #[pyo3(signature = (made, studied, *, sizes, out, progress))]
    fn robustness(
        &self,
        py: Python<'_>,
        made: Vec<String>,
        studied: (Vec<Designed>, (String, AxisValues)),
        sizes: (usize, u64),
        out: Option<PathBuf>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Kept> {
        let (designs, vary) = studied;
        let options = options::robustness(py, &self.task, designs, vary, sizes)?;
        self.resumable(py, ("robustness", made, options.seed), (out, progress), |task, out, watch| {
            Ok(StudyResult::Robustness(Box::new(supple_study::robustness::run(task, &options, out, watch)?)))
        })
    }

    /// The front of information against cost.
    #[pyo3(signature = (made, *, sizes, out, progress))]
    fn pareto(
        &self,
        py: Python<'_>,
        made: Vec<String>,
        sizes: (usize, usize, u64),
        out: Option<PathBuf>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Kept> {
        let (points, starts, seed) = sizes;
        let options = ParetoOptions { points, starts, seed };
        self.resumable(py, ("pareto", made, seed), (out, progress), |task, out, watch| {
            Ok(StudyResult::Pareto(Box::new(supple_study::pareto::run(task, &options, out, watch)?)))
        })
    }

    /// How little information would do; `sought` is the task, the cost to keep, and whether it is about the steady state.
    #[pyo3(signature = (made, sought, *, curve, progress))]
    fn bound(
        &self,
        py: Python<'_>,
        made: Vec<String>,
        sought: (Option<String>, Option<f64>, bool),
        curve: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Kept> {
        let (task, cost, stationary) = sought;
        let options = BoundOptions { task, cost, stationary, curve };
        self.study(py, ("bound", made, 0), progress, |task, watch| {
            Ok(StudyResult::Bound(Box::new(supple_study::bound::run(task, &options, watch)?)))
        })
    }

    /// Sets of sensors, and what each is worth; `options` as JSON.
    fn sensors(
        &self,
        py: Python<'_>,
        made: Vec<String>,
        options: &str,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Kept> {
        let options: SensorsOptions = from_json(py, options)?;
        self.study(py, ("sensors", made, 0), progress, |task, watch| {
            Ok(StudyResult::Sensors(Box::new(supple_study::sensors::run(task, &options, watch)?)))
        })
    }

    /// The paths of searches; `options` as JSON.
    #[pyo3(signature = (made, options, *, out, progress))]
    fn trace(
        &self,
        py: Python<'_>,
        made: Vec<String>,
        options: &str,
        out: Option<PathBuf>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Kept> {
        let options: TraceOptions = from_json(py, options)?;
        self.resumable(py, ("trace", made, options.seed), (out, progress), |task, out, watch| {
            Ok(StudyResult::Trace(Box::new(supple_study::trace::run(task, &options, out, watch)?)))
        })
    }
}

impl NativeTask {
    /// What a sweep is asked to do.
    ///
    /// # Errors
    /// Where an axis is wrong.
    pub fn sweep_options(
        &self,
        py: Python<'_>,
        grid: Vec<(String, AxisValues)>,
        (rollouts, starts, seed): (usize, usize, u64),
    ) -> PyResult<SweepOptions> {
        let axis = |(name, values): (String, AxisValues)| values.axis(py, &name, &self.task, Scale::Linear);
        let axes = grid.into_iter().map(axis).collect::<PyResult<_>>()?;
        Ok(SweepOptions { axes, rollouts, starts, seed })
    }
}

/// Settings of a design search, checked.
pub fn design_settings(py: Python<'_>, json: &str) -> PyResult<DesignSettings> {
    let settings: DesignSettings = from_json(py, json)?;
    match settings.check() {
        Ok(()) => Ok(settings),
        Err((key, message)) => Err(errors::usage(py, &format!("{key}: {message}"))),
    }
}

fn from_json<T: serde::de::DeserializeOwned>(py: Python<'_>, json: &str) -> PyResult<T> {
    serde_json::from_str(json).map_err(|error| {
        // Where it is in the text between the two languages says nothing to who asked.
        let message = error.to_string();
        let what = message.split(" at line ").next().unwrap_or(&message);
        errors::usage(py, what)
    })
}
