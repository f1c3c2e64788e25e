use rayon::prelude::*;
use supple::Stop;
use supple::design::{Attempts, Control, Design, DesignStatus, StartSummary, cheapest_of, minima_at, plan_at};
use supple::pipeline::TaskState;
use supple::settings::PlanMode;
use supple::{Matrices, Named, Problem, Task, Value};

use super::report::{DesignChoice, RobustDesign};
use crate::design::{best_of, check_designable, run_start, warnings_of};
use crate::journal::Parts;
use crate::{LoadedTask, StudyError, Watch};

/// A design with its plans at the nominal parameters.
pub(super) struct Planned {
    pub name: String,
    /// All parameters.
    pub phi: Vec<f64>,
    /// How the search for it ended, where it was searched for.
    pub status: Option<DesignStatus>,
    /// Each task.
    pub states: Vec<TaskState>,
    /// Controls of the local minima that were found, of each task.
    pub minima: Vec<Vec<Matrices>>,
}

impl Planned {
    /// The weighted sum of the tasks' information, nats.
    fn information(&self, problem: &Problem) -> f64 {
        self.states
            .iter()
            .zip(&problem.tasks)
            .map(|(state, task)| task.information_weight * state.information.total)
            .sum()
    }

    /// The design as the result has it.
    pub fn design(&self, problem: &Problem) -> RobustDesign {
        let warnings = |(state, task)| warnings_of(task, &self.phi, state);
        RobustDesign {
            name: self.name.clone(),
            parameters: Named::new(&problem.parameters, &self.phi),
            information_nats: self.information(problem),
            status: self.status,
            warnings: self.states.iter().zip(&problem.tasks).flat_map(warnings).collect(),
        }
    }
}

/// Finds and plans all designs; the starts of the search for the optimum are parts of the study.
pub(super) fn plan_all(
    task: &LoadedTask,
    designs: &[DesignChoice],
    parts: &Parts,
    watch: Watch,
) -> Result<Vec<Planned>, StudyError> {
    let wanted = designs.contains(&DesignChoice::Optimum);
    let optimum = wanted.then(|| search(task, parts, watch)).transpose()?;
    let plan = |choice: &DesignChoice| {
        let planned = plan_one(task, choice, optimum.as_ref())?;
        watch.progress.advance(1);
        if watch.is_stopped() { Err(StudyError::Stopped) } else { Ok(planned) }
    };
    designs.par_iter().map(plan).collect()
}

/// What a search for the optimum found.
#[derive(Clone, Debug)]
pub(super) struct Optimum {
    pub status: DesignStatus,
    /// All parameters.
    pub phi: Vec<f64>,
    /// Controls of each task's plan.
    pub controls: Vec<Matrices>,
}

impl Optimum {
    /// The best of all starts of the task's design search.
    ///
    /// # Errors
    /// Where the starts are not of this task, none of them could be evaluated, or it is stopped.
    pub fn of(task: &LoadedTask, starts: Vec<StartSummary>, stop: Stop) -> Result<Self, StudyError> {
        let control = Control { stop, ..Control::default() };
        let found: Design = best_of(task, &task.problem.design, starts, 0.0, control)?;
        let best = found.found();
        Ok(Self { status: found.status, phi: best.to.clone(), controls: best.controls.clone() })
    }
}

/// Searches for the optimum, from all starts.
fn search(task: &LoadedTask, parts: &Parts, watch: Watch) -> Result<Optimum, StudyError> {
    check_designable(task)?;
    let settings = &task.problem.design;
    let control = Control { stop: watch.stop, ..Control::default() };
    let start = |start: usize| {
        parts.part(&format!("optimum, start {start}"), watch, || run_start(task, settings, start, control))
    };
    let starts = (0..settings.starts).into_par_iter().map(start).collect::<Result<Vec<StartSummary>, _>>()?;
    let optimum = Optimum::of(task, starts, watch.stop)?;
    if watch.is_stopped() { Err(StudyError::Stopped) } else { Ok(optimum) }
}

/// Plans one design.
pub(super) fn plan_one(
    task: &LoadedTask,
    choice: &DesignChoice,
    optimum: Option<&Optimum>,
) -> Result<Planned, StudyError> {
    let LoadedTask { problem, phi, .. } = task;
    let mut phi = phi.clone();
    let (mut status, mut controls): (_, Option<Vec<Matrices>>) = (None, None);
    match choice {
        DesignChoice::Start => {}
        DesignChoice::Optimum => {
            let found = optimum.cloned().ok_or_else(|| StudyError::usage("the optimum is not known"))?;
            status = Some(found.status);
            phi = found.phi;
            controls = Some(found.controls);
        }
        DesignChoice::Named(_, values) => {
            values.iter().try_for_each(|(name, value)| problem.parameters.set(&mut phi, name, *value))?;
        }
    }
    let attempts = Attempts { count: problem.design.branch_attempts, seed: problem.design.seed };
    let tasks = problem.tasks.iter().enumerate();
    let states = tasks.map(|(index, task)| {
        let mut state = TaskState::new(task);
        let controls = controls.as_ref().map(|controls| &controls[index]);
        minima_at(problem, task, &phi, controls, attempts, &mut state).map(|minima| (state, minima))
    });
    let found = states.collect::<Result<Vec<_>, _>>();
    let found = found.map_err(|error| StudyError::Usage(format!("the design `{}`: {error}", choice.name())))?;
    let (states, minima) = found.into_iter().unzip();
    Ok(Planned { name: choice.name().to_owned(), phi, status, states, minima })
}

/// Whether a parameter leaves the local minima of a task where they are: of nominal plans, all but the expected cost.
fn leaves_minima(problem: &Problem, task: &Task, phi: &[f64], parameter: usize) -> bool {
    let has = |value: &Value| value.slopes(phi).iter().any(|(other, _)| other.index() == parameter);
    let given = task.initial_state.iter().chain(task.initial_control.iter().flatten());
    problem.planning.plan == PlanMode::Nominal
        && !task.system.depends_on(phi.len())[parameter]
        && !given.chain([&task.time_step]).any(has)
}

/// A task of a design planned anew at `phi`, which differs from the design's in one parameter.
///
/// # Errors
/// Where no guess leads to a finite plan.
pub(super) fn plan_anew(
    problem: &Problem,
    design: &Planned,
    index: usize,
    phi: &[f64],
    varied: usize,
) -> Result<TaskState, supple::Error> {
    let (task, minima) = (&problem.tasks[index], &design.minima[index]);
    let mut state = TaskState::new(task);
    // The cheapest branch depends on the noise, but the branches do not.
    let keeps = leaves_minima(problem, task, phi, varied);
    if keeps && cheapest_of(problem, task, phi, minima, &mut state).is_ok() && state.plan.status.is_converged() {
        return Ok(state);
    }
    let attempts = Attempts { count: problem.design.branch_attempts, seed: problem.design.seed };
    let controls = &design.states[index].plan.trajectory.controls;
    let warm = plan_at(problem, task, phi, Some(controls), attempts, &mut state);
    // If the model changed too much for the nominal plan to be a good warm start, use the task's guesses.
    if warm.is_err() || !state.plan.status.is_converged() {
        plan_at(problem, task, phi, None, attempts, &mut state)?;
    }
    Ok(state)
}
