mod check;

use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use supple_kernels::{Matrices, Scratch};
use supple_lqg::{ControlBounds, Dimensions};
use supple_model::document::Unfit;
use supple_model::noise::NoiseModel;
use supple_model::parameters::{Named, Parameters};
use supple_model::system::{RollOut, System, holding_controls};
use supple_model::{Trajectory, Value};

use crate::Error;
use crate::settings::{DesignSettings, MOST_ROLLOUTS, PlanSettings, ROLLOUTS};

/// Number of states up to which results include all [`ROLLOUTS`] roll-outs.
const ROLLOUTS_STATES: f64 = 32.0;

/// Minimum number of roll-outs; fewer would give poor estimates of means.
const LEAST_ROLLOUTS: usize = 32;

/// A robot, its tasks and the parameters to design.
///
/// Example: [`Problem::new`].
#[derive(Clone)]
pub struct Problem {
    /// Human-readable title.
    pub title: String,
    /// All parameters.
    pub parameters: Parameters,
    /// The tasks, which share the parameters.
    pub tasks: Vec<Task>,
    /// How plans are searched for.
    pub planning: PlanSettings,
    /// How designs are searched for.
    pub design: DesignSettings,
    /// Files that the task file refers to, except meshes.
    pub files: Vec<PathBuf>,
    /// Sensors to choose from; `None` if the task file has no catalogue.
    pub catalogue: Option<Vec<CatalogueSensor>>,
    /// Warnings about ignored or most likely wrong parts of the files; empty if there are none.
    pub warnings: Vec<String>,
    /// The same warnings, one per item, where `warnings` has one for all items of a kind.
    pub every_warning: Vec<String>,
}

/// Maximum number of steps of a task.
const MOST_STEPS: usize = 1_000_000;

/// Maximum number of entries in the second derivatives of all steps of a task: a plan needs some 150 bytes for each.
const MOST_ENTRIES: usize = 40_000_000;

/// Maximum number of steps of a task whose system has these dimensions.
///
/// ```
/// use supple::{Dimensions, most_steps};
///
/// assert_eq!(most_steps(Dimensions { states: 5, controls: 1, measurements: 2 }), 1_000_000);
/// ```
#[must_use]
pub fn most_steps(size: Dimensions) -> usize {
    MOST_STEPS.min(MOST_ENTRIES / size.joint().pow(2).max(1)).max(1)
}

/// Checks the requested number of roll-outs.
///
/// # Errors
/// Where there are more than [`MOST_ROLLOUTS`].
///
/// ```
/// use supple::{MOST_ROLLOUTS, check_rollouts};
///
/// assert!(check_rollouts(MOST_ROLLOUTS).is_ok() && check_rollouts(MOST_ROLLOUTS + 1).is_err());
/// ```
pub fn check_rollouts(rollouts: usize) -> Result<(), Error> {
    check_count("roll-outs", rollouts, MOST_ROLLOUTS)
}

/// Maximum number of attempts to find other local minima.
const MOST_BRANCHES: usize = 10_000;

/// Checks a number of attempts to find other local minima.
///
/// # Errors
/// If there are too many.
///
/// ```
/// assert!(supple::check_branches(10).is_ok() && supple::check_branches(usize::MAX).is_err());
/// ```
pub fn check_branches(attempts: usize) -> Result<(), Error> {
    check_count("branch-search attempts", attempts, MOST_BRANCHES)
}

/// # Errors
/// Where there are more than `most`.
pub(crate) fn check_count(what: impl Into<String>, found: usize, most: usize) -> Result<(), Error> {
    if found <= most { Ok(()) } else { Err(Error::Lqg(supple_lqg::Error::TooMany { what: what.into(), found, most })) }
}

impl std::fmt::Debug for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Self { title, parameters, tasks, planning, design, .. } = self;
        let mut shown = f.debug_struct("Problem");
        shown.field("title", title).field("parameters", parameters).field("tasks", tasks);
        shown.field("planning", planning).field("design", design).finish_non_exhaustive()
    }
}

impl std::fmt::Debug for Task {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Self { name, steps, time_step, bound, initial_state, noise, system, .. } = self;
        let mut shown = f.debug_struct("Task");
        shown.field("name", name).field("steps", steps).field("time_step", time_step).field("bound", bound);
        shown.field("initial_state", initial_state).field("noise", noise);
        shown.field("system", &system.dimensions()).finish_non_exhaustive()
    }
}

impl Problem {
    /// Tasks that share parameters, planned and designed with default settings.
    ///
    /// Two masses in series that press on a wall, with one stiffness to design:
    ///
    /// ```
    /// use supple::cost::Cost;
    /// use supple::noise::{Covariance, NoiseModel};
    /// use supple::parameters::{Parameter, Parameters, Scale};
    /// use supple::quantity::{ContactForce, Control, State};
    /// use supple::system::Authored;
    /// use supple::{EvaluateOptions, Problem, Task, TwoMass};
    ///
    /// let mut parameters = Parameters::default();
    /// let stiffness = Parameter::new("stiffness", 300.0, [50.0, 600.0]).with_scale(Scale::Log).with_unit("N/m");
    /// let stiffness = parameters.declare(stiffness);
    /// let model = TwoMass {
    ///     mass: [0.8, 0.4].map(Into::into),
    ///     damping: [60.0, 35.0].map(Into::into),
    ///     stiffness: [stiffness.into(), 200.0.into()],
    ///     contact_smoothing: 0.01.into(),
    /// };
    /// let costs = vec![
    ///     Cost::new(ContactForce::new(0).with_smoothing(0.1), 0.05).with_targets([10.0]),
    ///     Cost::new(State::new([1, 3]), 0.1),
    ///     Cost::new(Control::all(1), 1e-4),
    /// ];
    /// let noise = NoiseModel::new(
    ///     Covariance::diagonal([1e-3, 1e-3, 1e-3, 1e-3, 3e-2]),
    ///     Covariance::diagonal([1e-7, 5e-3, 1e-7, 1e-2, 0.0]),
    ///     Covariance::diagonal([0.1, 1.0]),
    /// );
    /// let system = Authored::new(model, costs, 0.02, parameters.len());
    /// let task = Task::new("press", system, noise, 125, 0.02)
    ///     .starting_at([0.0, 0.0, 0.0, 0.0, 0.75])
    ///     .guessing([60.0])
    ///     .within_cost(301.0);
    /// let problem = Problem::new("Two masses", parameters, vec![task]);
    /// let found = problem.evaluate(&problem.parameters.initial(), &EvaluateOptions::default())?;
    /// assert!(found.tasks[0].status.is_converged());
    /// # Ok::<(), supple::Error>(())
    /// ```
    #[must_use]
    pub fn new(title: impl Into<String>, parameters: Parameters, tasks: Vec<Task>) -> Self {
        Self {
            title: title.into(),
            parameters,
            tasks,
            planning: PlanSettings::default(),
            design: DesignSettings::default(),
            files: Vec::new(),
            catalogue: None,
            warnings: Vec::new(),
            every_warning: Vec::new(),
        }
    }

    /// Sets the planning settings.
    #[must_use]
    pub fn with_planning(self, planning: PlanSettings) -> Self {
        Self { planning, ..self }
    }

    /// Sets the design settings.
    #[must_use]
    pub fn with_design(self, design: DesignSettings) -> Self {
        Self { design, ..self }
    }

    /// Whether every task [sets](Task::set) this parameter for itself, so that nothing else gives it a value.
    #[must_use]
    pub fn is_set_by_all_tasks(&self, parameter: &str) -> bool {
        self.tasks.iter().all(|task| task.set.get(parameter).is_some())
    }

    /// Checks that a design has one finite number per parameter, and the problem itself: its parameters, its planning settings,
    /// and the [lengths and numbers of every task](Task::check_numbers).
    ///
    /// # Errors
    /// What is wrong.
    pub fn check_design(&self, phi: &[f64]) -> Result<(), Error> {
        let (found, expected) = (phi.len(), self.parameters.len());
        if found != expected {
            return Err(Error::shape("the list of parameters".to_owned(), found, expected));
        }
        if let Some((parameter, value)) = self.parameters.iter().zip(phi).find(|(_, value)| !value.is_finite()) {
            let message = format!("parameter `{}` must be a finite number; found {value}", parameter.name);
            return Err(Error::Unfit(Unfit::here(message)));
        }
        if self.tasks.is_empty() {
            return Err(Error::Unfit(Unfit::new("tasks", "there must be at least one")));
        }
        self.parameters.check().map_err(Error::Unfit)?;
        self.planning.check().map_err(|unfit| Error::Unfit(unfit.below("planning")))?;
        for task in &self.tasks {
            let in_task = |unfit| Error::InTask { task: task.name.clone(), error: Box::new(Error::Unfit(unfit)) };
            task.check_numbers(&self.parameters).map_err(in_task)?;
        }
        Ok(())
    }

    /// Number of closed-loop roll-outs reported with results: as requested, or else as in the design settings, or else as
    /// many as take about the same time for any number of states, from [`ROLLOUTS`] down to 32.
    #[must_use]
    pub fn rollouts(&self, asked: Option<usize>) -> usize {
        asked.or(self.design.rollouts).unwrap_or_else(|| {
            let states = self.tasks.iter().map(|task| task.system.dimensions().states).max().unwrap_or(0);
            // The time for a filter step grows with the cube of the number of states.
            let share = (ROLLOUTS_STATES / states.max(1) as f64).powi(3).min(1.0);
            ((ROLLOUTS as f64 * share) as usize).max(LEAST_ROLLOUTS)
        })
    }

    /// The task of this name.
    ///
    /// # Errors
    /// If there is no such task.
    pub fn task(&self, name: &str) -> Result<&Task, Error> {
        let names = || self.tasks.iter().map(|task| task.name.as_str()).collect::<Vec<_>>().join(", ");
        let unknown = || Error::Unknown { what: "task", name: name.to_owned(), valid: names() };
        self.tasks.iter().find(|task| task.name == name).ok_or_else(unknown)
    }
}

/// A sensor of a catalogue.
///
/// ```
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/wiping_arm_sensors.toml");
/// let problem = supple_file::load(file)?;
/// let catalogue = problem.catalogue.ok_or("it has a catalogue")?;
/// assert!(catalogue.iter().all(|sensor| sensor.price >= 0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CatalogueSensor {
    /// Its name.
    pub name: String,
    /// What kind of sensor it is.
    pub kind: String,
    /// Its price, in the units of budgets.
    pub price: f64,
    /// Whether the task file marks it as chosen.
    pub chosen: bool,
    /// Indices of its entries in the measurement; empty if the problem was read without it.
    pub rows: Vec<usize>,
}

/// The nominal problem for which a plan is searched.
///
/// Example: [`plan`](crate::plan::plan()).
#[derive(Clone, Copy)]
pub struct NominalProblem<'a> {
    /// The system with its costs.
    pub system: &'a dyn System,
    /// All parameters.
    pub phi: &'a [f64],
    /// Bounds that the controls must keep.
    pub bounds: Option<&'a ControlBounds>,
}

/// A task at values of the parameters.
#[derive(Clone, Copy)]
pub(crate) struct TaskAt<'a> {
    pub task: &'a Task,
    /// Values of the parameters.
    pub phi: &'a [f64],
}

/// One task: a system with its costs, start, noise and bound.
///
/// Example: [`Problem::new`].
#[derive(Clone)]
pub struct Task {
    /// Its name.
    pub name: String,
    /// How many steps it lasts, N.
    pub steps: usize,
    /// Time step, s.
    pub time_step: Value,
    /// Upper bound D on the expected cost; `None` if there is no limit.
    pub bound: Option<Value>,
    /// Weight of its information in the objective.
    pub information_weight: f64,
    /// Mean of the first state, n.
    pub initial_state: Vec<Value>,
    /// First guess of the controls: one row for all steps, or one per step; each of length m. If empty, plans of
    /// a problem start from the cheapest of a few motions near the first state (theory, equation P.3b).
    pub initial_control: Vec<Vec<Value>>,
    /// Controls of a plan that is known already, such as that of a stored result: plans start from them too.
    pub known_controls: Option<Matrices>,
    /// Bounds on the controls of plans and their control laws; none by default.
    pub control_bounds: Option<ControlBounds>,
    /// Its noise.
    pub noise: NoiseModel,
    /// Parameters that its model, costs and noise have as numbers, whatever the parameters of the problem are.
    pub set: Named,
    /// Why its model may not be the system that is meant, such as parts of a file that are left out: warnings of every result.
    pub doubts: Vec<String>,
    /// Why derivatives of its model are wrong, such as values that jump: warnings of every result.
    pub doubtful_derivatives: Vec<String>,
    /// Model and costs, differentiated. Copies of the task share it.
    pub system: Arc<dyn System>,
}

impl Task {
    /// This task at values of the parameters.
    pub(crate) fn at<'a>(&'a self, phi: &'a [f64]) -> TaskAt<'a> {
        TaskAt { task: self, phi }
    }

    /// Reasons not to trust any number of it: doubts of its model, and of that model's derivatives.
    ///
    /// ```
    /// let problem = supple_file::load(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml"))?;
    /// assert!(problem.tasks[0].distrust().is_empty());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn distrust(&self) -> Vec<String> {
        [&self.doubts[..], &self.doubtful_derivatives].concat()
    }

    /// A task of `steps` steps of length `time_step`, s, starting from state 0, without limits; its first guess is the
    /// controls that hold this state.
    #[must_use]
    pub fn new(
        name: impl Into<String>,
        system: impl System + 'static,
        noise: NoiseModel,
        steps: usize,
        time_step: impl Into<Value>,
    ) -> Self {
        Self::sharing(name, Arc::new(system), noise, steps, time_step)
    }

    /// The same for a system that other tasks share, or whose type is known only at run time.
    #[must_use]
    pub fn sharing(
        name: impl Into<String>,
        system: Arc<dyn System>,
        noise: NoiseModel,
        steps: usize,
        time_step: impl Into<Value>,
    ) -> Self {
        Self {
            name: name.into(),
            steps,
            time_step: time_step.into(),
            bound: None,
            information_weight: 1.0,
            initial_state: vec![Value::default(); system.dimensions().states],
            initial_control: Vec::new(),
            known_controls: None,
            control_bounds: None,
            noise,
            set: Named::default(),
            doubts: Vec::new(),
            doubtful_derivatives: Vec::new(),
            system,
        }
    }

    /// Sets the initial state, of length n: numbers or parameters.
    #[must_use]
    pub fn starting_at(self, state: impl IntoIterator<Item = impl Into<Value>>) -> Self {
        Self { initial_state: state.into_iter().map(Into::into).collect(), ..self }
    }

    /// Sets these controls, of length m, as the first guess at every step.
    #[must_use]
    pub fn guessing(self, control: impl IntoIterator<Item = impl Into<Value>>) -> Self {
        Self { initial_control: vec![control.into_iter().map(Into::into).collect()], ..self }
    }

    /// Sets the first guess of the controls: one row for all steps or one per step, each of length m. Without rows,
    /// plans of a problem start from the cheapest of a few motions near the first state.
    #[must_use]
    pub fn guessing_each(self, controls: Vec<Vec<Value>>) -> Self {
        Self { initial_control: controls, ..self }
    }

    /// Sets the controls of a plan that is known already, one vector per step: plans start from them too.
    #[must_use]
    pub fn knowing(self, controls: Matrices) -> Self {
        Self { known_controls: Some(controls), ..self }
    }

    /// Sets the weight of its information in the objective; 1 by default.
    #[must_use]
    pub fn weighing_information(self, weight: f64) -> Self {
        Self { information_weight: weight, ..self }
    }

    /// Sets the upper bound on the expected cost.
    #[must_use]
    pub fn within_cost(self, bound: impl Into<Value>) -> Self {
        Self { bound: Some(bound.into()), ..self }
    }

    /// Sets bounds on the controls of plans.
    #[must_use]
    pub fn within_controls(self, bounds: ControlBounds) -> Self {
        Self { control_bounds: Some(bounds), ..self }
    }

    /// Its nominal planning problem at `phi`.
    #[must_use]
    pub fn nominal<'a>(&'a self, phi: &'a [f64]) -> NominalProblem<'a> {
        NominalProblem { system: &*self.system, phi, bounds: self.control_bounds.as_ref() }
    }

    /// The first state at `phi`.
    #[must_use]
    pub fn first_state(&self, phi: &[f64]) -> Vec<f64> {
        self.initial_state.iter().map(|value| value.resolve(phi)).collect()
    }

    /// The first guess of the controls at `phi`, times a factor.
    #[must_use]
    pub fn guess(&self, phi: &[f64], factor: f64) -> Matrices {
        let resolve = |row: &Vec<Value>| row.iter().map(|value| value.resolve(phi)).collect();
        let mut rows: Vec<Vec<f64>> = self.initial_control.iter().map(resolve).collect();
        if rows.is_empty() {
            rows.push(holding_controls(&*self.system, &self.first_state(phi), phi));
        }
        let mut controls = Matrices::vectors(self.steps, self.system.dimensions().controls);
        for t in 0..self.steps {
            for (to, u) in controls.vector_mut(t).iter_mut().zip(&rows[t.min(rows.len() - 1)]) {
                *to = factor * u;
            }
        }
        controls
    }

    /// Writes the first state at `phi`, and the controls to start from: those given, or else the first guess.
    pub fn write_guess(&self, phi: &[f64], controls: Option<&Matrices>, trajectory: &mut Trajectory) {
        for (x, value) in trajectory.states.vector_mut(0).iter_mut().zip(&self.initial_state) {
            *x = value.resolve(phi);
        }
        match controls {
            Some(controls) => trajectory.controls.copy_from(controls),
            None => trajectory.controls = self.guess(phi, 1.0),
        }
    }

    /// The motion without noise or feedback under `controls`, one row per step and not clipped to bounds, from the
    /// state `start` or, without one, from the first state at `phi`. It lasts as many steps as there are controls.
    ///
    /// # Errors
    /// Where a length is wrong, there are more controls than the system has steps, or a state is not finite.
    pub fn simulate(&self, phi: &[f64], start: Option<&[f64]>, controls: Matrices) -> Result<Trajectory, Error> {
        let size = self.system.dimensions();
        let check = |what: &str, found: usize, expected: usize| {
            let what = format!("{what} of task `{}`", self.name);
            if found == expected { Ok(()) } else { Err(Error::shape(what, found, expected)) }
        };
        if phi.len() < self.system.parameters() {
            check("the list of parameters", phi.len(), self.system.parameters())?;
        }
        check("a row of the controls", controls.cols(), size.controls)?;
        if let Some(steps) = self.system.steps().filter(|&steps| steps < controls.count()) {
            check("the list of controls", controls.count(), steps)?;
        }
        let mut motion = Trajectory { states: Matrices::vectors(controls.count() + 1, size.states), controls };
        let first = motion.states.vector_mut(0);
        match start {
            Some(start) => {
                check("the first state", start.len(), size.states)?;
                first.copy_from_slice(start);
            }
            None => first.copy_from_slice(&self.first_state(phi)),
        }
        self.system.roll_out(RollOut::Controls, phi, &mut motion, &mut Scratch::default());
        let finite = |t: &usize| motion.states.vector(*t).iter().all(|number| number.is_finite());
        match (0..motion.states.count()).find(|t| !finite(t)) {
            Some(step) => Err(Error::not_finite("the state of a simulation", step)),
            None => Ok(motion),
        }
    }
}
