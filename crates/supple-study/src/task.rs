use std::path::Path;

use serde::{Deserialize, Serialize};
use supple::parameters::Parameters;
use supple::{Evaluation, Kinds, Matrices, Named, Problem, Task};
use supple_file::{Files, ReadOptions};

use crate::StudyError;

/// What stands for the path of a task file where a task was described in Python.
///
/// ```
/// use supple_study::evaluate::EvaluateOptions;
/// use supple_study::study::{Study, Work};
/// use supple_study::{LoadedTask, OWN_MODEL, Source};
/// # let text = r#"
/// #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
/// #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
/// #     [[tasks]]
/// #     name = "hold"
/// #     steps = 20
/// #     time_step = 0.1
/// #     initial_state = [1.0]
/// #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
/// # "#;
/// # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
///
/// // The task of the front page.
/// let mut task = LoadedTask::restore(&[source])?;
/// task.sources.clear();
/// assert_eq!(Study::of(&task, Work::Evaluate(EvaluateOptions::default())).task, OWN_MODEL);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub const OWN_MODEL: &str = "own model";

/// A text file that a result was made of.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// Its path, as it was given.
    pub path: String,
    /// Its text.
    pub text: String,
}

impl Source {
    /// These texts in place of the files.
    pub(crate) fn files(sources: &[Self]) -> Files {
        Files::given(sources.iter().map(|source| (source.path.clone(), source.text.clone())))
    }
}

/// What a task is, for those who read its results.
///
/// ```
/// use supple_study::{About, LoadedTask, Source};
/// # let text = r#"
/// #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
/// #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
/// #     [[tasks]]
/// #     name = "hold"
/// #     steps = 20
/// #     time_step = 0.1
/// #     initial_state = [1.0]
/// #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
/// # "#;
/// # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
///
/// // The task of the front page.
/// let task = LoadedTask::restore(&[source])?;
/// let about = About::of(&task.problem);
/// assert_eq!((about.tasks[0].name.as_str(), about.tasks[0].steps, about.tasks[0].bound), ("hold", 20, None));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct About {
    /// Its title; may be empty.
    pub title: String,
    /// All parameters, in the order in which they were declared.
    pub parameters: Parameters,
    /// The tasks.
    pub tasks: Vec<AboutTask>,
}

/// One task of a task file.
///
/// Example: [`About`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct AboutTask {
    /// Its name.
    pub name: String,
    /// How many steps it lasts, N.
    pub steps: usize,
    /// Time step at the initial parameters, s.
    pub time_step: f64,
    /// Bound on its expected cost at the initial parameters; `None` if it has none.
    pub bound: Option<f64>,
    /// Weight of its information in the objective.
    pub information_weight: f64,
    /// The parameters that it sets for itself, whatever those of a design are.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub set: Named,
}

impl About {
    /// What tasks set for themselves, a sentence for each: `loaded: payload = 3 kg`; numbers as `number` writes them.
    pub fn settings(&self, number: impl Fn(f64, &str) -> String) -> Vec<String> {
        let unit_of = |name: &str| self.parameters.iter().find(|of| of.name == name).map_or("", |of| &of.unit);
        let of_task = |task: &AboutTask| {
            let set: Vec<String> =
                task.set.0.iter().map(|(name, value)| format!("{name} = {}", number(*value, unit_of(name)))).collect();
            (!set.is_empty()).then(|| format!("{}: {}", task.name, set.join(", ")))
        };
        self.tasks.iter().filter_map(of_task).collect()
    }

    /// What a problem is.
    #[must_use]
    pub fn of(problem: &Problem) -> Self {
        let phi = problem.parameters.initial();
        let task = |task: &Task| AboutTask {
            name: task.name.clone(),
            steps: task.steps,
            time_step: task.time_step.resolve(&phi),
            bound: task.bound.as_ref().map(|bound| bound.resolve(&phi)),
            information_weight: task.information_weight,
            set: task.set.clone(),
        };
        Self {
            title: problem.title.clone(),
            parameters: problem.parameters.clone(),
            tasks: problem.tasks.iter().map(task).collect(),
        }
    }
}

/// A task file as it was read, and the parameters to start from.
///
/// Example: the [front page](crate).
#[derive(Clone)]
pub struct LoadedTask {
    /// What there is to solve.
    pub problem: Problem,
    /// All parameters, as set.
    pub phi: Vec<f64>,
    /// The task file, then the robot's file where there is one.
    pub sources: Vec<Source>,
    /// The kinds that the task file may name.
    pub kinds: Kinds,
}

impl LoadedTask {
    /// Adds the task's file to an error of a computation, if the task has a file and the error does not name it yet.
    #[must_use]
    pub fn blame(&self, error: StudyError) -> StudyError {
        match (error, self.sources.first()) {
            (StudyError::Compute(error), Some(source)) if source.path != OWN_MODEL && !error.is_of_request() => {
                StudyError::ComputeOf { file: source.path.clone(), error }
            }
            (error, _) => error,
        }
    }

    /// Reads a task file.
    ///
    /// # Errors
    /// Where a file cannot be read or anything in it is wrong.
    pub fn load(path: &Path) -> Result<Self, StudyError> {
        Self::load_with(path, Kinds::default())
    }

    /// The same of a file that may name other kinds than those of the library.
    ///
    /// # Errors
    /// As of [`load`](Self::load).
    pub fn load_with(path: &Path, kinds: Kinds) -> Result<Self, StudyError> {
        Self::read(path, kinds, Files::default())
    }

    fn read(path: &Path, kinds: Kinds, files: Files) -> Result<Self, StudyError> {
        let text = files.read_named(path)?;
        let name = path.display().to_string();
        let options = ReadOptions { kinds: kinds.clone(), files: files.clone(), ..ReadOptions::default() };
        let problem = supple_file::parse_with(&text, &name, options)?;
        let phi = problem.parameters.initial();
        let mut sources = vec![Source { path: name, text }];
        for path in &problem.files {
            sources.push(Source { path: path.display().to_string(), text: files.read(path)? });
        }
        Ok(Self { problem, phi, sources, kinds })
    }

    /// The same task with these parameters set.
    ///
    /// # Errors
    /// Where one is unknown or out of bounds.
    pub fn setting(mut self, parameters: &Named) -> Result<Self, StudyError> {
        for (name, value) in &parameters.0 {
            self.problem.parameters.set(&mut self.phi, name, *value)?;
        }
        Ok(self)
    }

    /// Starts from a design, of this task or of one that shares parameters with it; parameters that it does not have stay as
    /// they are.
    ///
    /// # Errors
    /// Where it has none of the task's parameters, or a value is out of bounds.
    pub fn start_from(&mut self, design: &Named) -> Result<(), StudyError> {
        let own = self.problem.parameters.names();
        let common: Vec<_> = design.0.iter().filter(|(name, _)| own.contains(name)).collect();
        if common.is_empty() {
            let valid = supple_text::quoted(&own);
            return Err(StudyError::usage(format!("none of its parameters is one of the task, {valid}")));
        }
        for (name, value) in common {
            self.problem.parameters.set(&mut self.phi, name, *value)?;
        }
        Ok(())
    }

    /// The same from the texts that [`load`](Self::load) read, the task file's first: no file is read.
    ///
    /// # Errors
    /// Where there is no text, or as of [`load`](Self::load).
    pub fn restore(sources: &[Source]) -> Result<Self, StudyError> {
        Self::restore_with(sources, Kinds::default())
    }

    /// The same of a file that may name other kinds than those of the library.
    ///
    /// # Errors
    /// As of [`restore`](Self::restore).
    pub fn restore_with(sources: &[Source], kinds: Kinds) -> Result<Self, StudyError> {
        let Some(first) = sources.first() else { return Err(StudyError::usage("there is no text of a task file")) };
        Self::read(Path::new(&first.path), kinds, Source::files(sources))
    }

    /// The same task, whose plans start also from the plans of an evaluation of it, where the evaluation has kept them: a
    /// search may have found local minima that first guesses do not lead to.
    ///
    /// ```
    /// use supple::{EvaluateOptions, Named};
    /// use supple_study::LoadedTask;
    ///
    /// let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
    /// let stiffness = Named::from([("k1", 355.0), ("k2", 400.0)]);
    /// let task = LoadedTask::load(path.as_ref())?.setting(&stiffness)?;
    /// let options = EvaluateOptions { branches: 24, trajectories: true, ..Default::default() };
    /// let found = task.problem.evaluate(&task.phi, &options)?;
    ///
    /// let guessed = task.problem.evaluate(&task.phi, &EvaluateOptions::default())?;
    /// let task = LoadedTask::restore(&task.sources)?.setting(&stiffness)?.knowing(&found);
    /// let known = task.problem.evaluate(&task.phi, &EvaluateOptions::default())?;
    /// let cost = |evaluation: &supple::Evaluation| evaluation.tasks[0].cost.expected;
    /// assert!(cost(&found) < 0.99 * cost(&guessed));
    /// assert!((cost(&known) / cost(&found) - 1.0).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn knowing(mut self, evaluation: &Evaluation) -> Self {
        for report in &evaluation.tasks {
            if let Some(trajectory) = &report.trajectory {
                self.know(&report.name, &trajectory.controls);
            }
        }
        self
    }

    /// Has plans of a task start also from these controls, one row per step; does nothing where there is no such task, or
    /// it has other steps or controls.
    pub fn know(&mut self, task: &str, controls: &[Vec<f64>]) {
        let Some(task) = self.problem.tasks.iter_mut().find(|one| one.name == task) else { return };
        let count = task.system.dimensions().controls;
        if controls.len() == task.steps && controls.iter().all(|row| row.len() == count) {
            task.known_controls = Some(Matrices::of_rows(controls, count));
        }
    }

    /// The parameters by name.
    #[must_use]
    pub fn parameters(&self) -> Named {
        Named::new(&self.problem.parameters, &self.phi)
    }

    /// Names of the tasks.
    #[must_use]
    pub fn tasks(&self) -> Vec<String> {
        self.problem.tasks.iter().map(|task| task.name.clone()).collect()
    }
}
