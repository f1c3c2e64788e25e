use rayon::prelude::*;
use supple::Stop;
use supple::design::{Attempts, Control, Design, DesignStatus, StartSummary, plan_at};
use supple::pipeline::TaskState;
use supple::{Matrices, Named, Problem};

use super::{DesignChoice, RobustDesign};
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
        plan_at(problem, task, &phi, controls, attempts, &mut state).map(|_| state)
    });
    let states = states.collect::<Result<Vec<_>, _>>();
    let states = states.map_err(|error| StudyError::Usage(format!("the design `{}`: {error}", choice.name())))?;
    Ok(Planned { name: choice.name().to_owned(), phi, status, states })
}
