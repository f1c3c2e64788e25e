use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use supple::Stop;
use supple::design::StartSummary;

use super::cell::{Costs, Place, cells};
use super::plan::{Optimum, Planned, plan_one};
use super::report::{DesignChoice, RobustDesign, Robustness, RobustnessOptions};
use super::{assemble, check};
use crate::design::check_designable;
use crate::{LoadedTask, StudyError};

/// Does parts of a study of robustness, one after the other: designs, and the cells of them. The plans of designs that
/// it made are kept.
///
/// Example: the [module](crate::robustness).
pub struct RobustnessUnits {
    options: RobustnessOptions,
    varied: usize,
    optimum: Option<Optimum>,
    /// Each design that was planned.
    planned: Mutex<Vec<Option<Arc<Planned>>>>,
}

impl RobustnessUnits {
    /// Of a study; `starts` are those of the task's design search, where the optimum is one of the designs.
    ///
    /// # Errors
    /// Where something is wrong with what is asked for, or the starts are not of this task.
    pub fn new(task: &LoadedTask, options: &RobustnessOptions, starts: Vec<StartSummary>) -> Result<Self, StudyError> {
        let varied = check(task, options)?;
        let optimum = if options.designs.contains(&DesignChoice::Optimum) {
            check_designable(task)?;
            Some(Optimum::of(task, starts, Stop::never())?)
        } else {
            None
        };
        let planned = Mutex::new(vec![None; options.designs.len()]);
        Ok(Self { options: options.clone(), varied, optimum, planned })
    }

    /// Plans a design at the nominal parameters.
    ///
    /// # Errors
    /// Where it cannot be planned, or the number is that of no design.
    pub fn design(&self, task: &LoadedTask, design: usize, stop: Stop) -> Result<RobustDesign, StudyError> {
        Ok(self.planned(task, design, stop)?.design(&task.problem))
    }

    /// Rolls out cells, by their numbers in the result.
    ///
    /// # Errors
    /// Where their design cannot be planned, there are no such cells, or it is stopped.
    pub fn cells(&self, task: &LoadedTask, numbers: Range<usize>, stop: Stop) -> Result<Vec<Costs>, StudyError> {
        if numbers.end > cells(task, &self.options) {
            return Err(StudyError::usage("these cells belong to another study"));
        }
        let sample = |number| {
            let at = Place::of(number, task, &self.options);
            let planned = self.planned(task, at.design, stop)?;
            let costs = at.costs(task, &planned, &self.options, self.varied);
            if stop.is_requested() { Err(StudyError::Stopped) } else { Ok(costs) }
        };
        numbers.map(sample).collect()
    }

    fn planned(&self, task: &LoadedTask, design: usize, stop: Stop) -> Result<Arc<Planned>, StudyError> {
        let Some(choice) = self.options.designs.get(design) else {
            return Err(StudyError::usage("this design is not of this study"));
        };
        let mut planned = self.planned.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(planned) = &planned[design] {
            return Ok(planned.clone());
        }
        let made = Arc::new(plan_one(task, choice, self.optimum.as_ref())?);
        if stop.is_requested() {
            return Err(StudyError::Stopped);
        }
        planned[design] = Some(made.clone());
        Ok(made)
    }
}

/// How many designs and cells a study has, checked.
///
/// # Errors
/// Where something is wrong with what is asked for.
///
/// Example: the [module](crate::robustness).
pub fn parts(task: &LoadedTask, options: &RobustnessOptions) -> Result<(usize, usize), StudyError> {
    check(task, options)?;
    Ok((options.designs.len(), cells(task, options)))
}

/// The result of all designs and cells, in their order, wherever they were made: the same, to the last bit, as that of
/// [`run`](super::run).
///
/// # Errors
/// Where a design or cell is missing.
///
/// Example: the [module](crate::robustness).
pub fn combine(
    task: &LoadedTask,
    options: &RobustnessOptions,
    designs: Vec<RobustDesign>,
    costs: Vec<Costs>,
) -> Result<Robustness, StudyError> {
    let varied = check(task, options)?;
    if (designs.len(), costs.len()) != (options.designs.len(), cells(task, options)) {
        return Err(StudyError::usage("designs or cells of the study are missing"));
    }
    Ok(assemble(task, options, varied, designs, costs))
}
