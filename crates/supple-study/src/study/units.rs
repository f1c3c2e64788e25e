use std::ops::Range;

use serde::{Deserialize, Serialize};
use supple::Stop;
use supple::design::{Control, DesignSettings, StartSummary};

use super::Work;
use crate::design::run_start;
use crate::robustness::{Costs, RobustDesign, RobustnessUnits};
use crate::sweep::{SweepUnit, SweepUnits};
use crate::{LoadedTask, StudyError};

/// A part of a study that does not depend on its other parts, for another process to do.
///
/// Example: [`Units`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Unit {
    /// Segments of a sweep, as its [`Collector`](crate::sweep::Collector) gives them.
    Segments(SweepUnit),
    /// The start of a design search with this number.
    Start(usize),
    /// The plans of the design with this number in a robustness study.
    Design(usize),
    /// The roll-outs of these cells of a robustness study.
    Cells(Range<usize>),
}

/// The result of a [`Unit`]; every number keeps its bits when it is serialised in a binary format.
///
/// Example: [`Units`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Found {
    /// Rows of a sweep's table, each as a JSON list.
    Rows(Vec<String>),
    /// The result of a start of a design search.
    Start(Box<StartSummary>),
    /// A design of a robustness study.
    Design(Box<RobustDesign>),
    /// Cells of a robustness study.
    Cells(Vec<Costs>),
}

/// Does units of one study, one after the other. Sweeps, design searches and robustness studies divide into units.
///
/// ```
/// use supple::design::DesignSettings;
/// use supple_study::design::{combine, run};
/// use supple_study::study::{Unit, Units, Work};
/// use supple_study::{LoadedTask, Source, Stop, Watch};
/// # let text = r#"
/// #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
/// #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
/// #     [[tasks]]
/// #     name = "hold"
/// #     steps = 20
/// #     time_step = 0.1
/// #     bound = 2.0
/// #     initial_state = [1.0]
/// #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
/// # "#;
/// # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
///
/// // The task of the front page with a cost limit of 2.
/// let task = LoadedTask::restore(&[source])?;
/// let settings = DesignSettings { starts: 2, ..task.problem.design.clone() };
/// let work = Work::Design(Box::new(settings.clone()));
///
/// // In a worker process, which received the task, the work and a unit.
/// let units = Units::new(&task, &work, Vec::new())?;
/// let found = |start| units.work(&task, Unit::Start(start), Stop::never())?.start();
///
/// let starts = (0..settings.starts).map(found).collect::<Result<Vec<_>, _>>()?;
/// let report = combine(&task, &settings, starts, 0.0, Default::default())?;
/// assert_eq!(report.optimum.parameters, run(&task, &settings, None, Watch::default())?.optimum.parameters);
///
/// // A unit of another study is refused, and so is work that does not divide.
/// assert!(units.work(&task, Unit::Cells(0..1), Stop::never()).is_err());
/// assert!(Units::new(&task, &Work::Evaluate(Default::default()), Vec::new()).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Units(Prepared);

/// A study made ready for its units.
enum Prepared {
    Sweep(Box<SweepUnits>),
    Design(Box<DesignSettings>),
    Robustness(Box<RobustnessUnits>),
}

impl Units {
    /// Of this work on a task. `starts` are the results of the task's design search, where a robustness study has the
    /// optimum as one of its designs; empty otherwise.
    ///
    /// # Errors
    /// Where the work does not divide into units, its options do not fit the task, or the starts are not of this task.
    pub fn new(task: &LoadedTask, work: &Work, starts: Vec<StartSummary>) -> Result<Self, StudyError> {
        Ok(Self(match work {
            Work::Sweep(options) => Prepared::Sweep(Box::new(SweepUnits::new(task, options)?)),
            Work::Design(settings) => Prepared::Design(settings.clone()),
            Work::Robustness(options) => Prepared::Robustness(Box::new(RobustnessUnits::new(task, options, starts)?)),
            Work::Evaluate(_) | Work::Pareto(_) | Work::Trace(_) | Work::Sensors(_) | Work::Bound(_) => {
                let command = work.command();
                return Err(StudyError::Usage(format!("the work of `{command}` cannot be divided among processes")));
            }
        }))
    }

    /// Does a unit.
    ///
    /// # Errors
    /// Where the unit is of another study, it cannot be computed, or it is stopped.
    pub fn work(&self, task: &LoadedTask, unit: Unit, stop: Stop) -> Result<Found, StudyError> {
        Ok(match (&self.0, unit) {
            (Prepared::Sweep(units), Unit::Segments(unit)) => Found::Rows(units.work(&unit, stop)?),
            (Prepared::Design(settings), Unit::Start(start)) => {
                let control = Control { stop, ..Control::default() };
                Found::Start(Box::new(run_start(task, settings, start, control)?))
            }
            (Prepared::Robustness(units), Unit::Design(design)) => {
                Found::Design(Box::new(units.design(task, design, stop)?))
            }
            (Prepared::Robustness(units), Unit::Cells(numbers)) => Found::Cells(units.cells(task, numbers, stop)?),
            _ => return Err(foreign()),
        })
    }
}

impl Found {
    /// The rows of [`Unit::Segments`].
    ///
    /// # Errors
    /// Where it is the result of another unit, as in the methods below.
    pub fn rows(self) -> Result<Vec<String>, StudyError> {
        if let Self::Rows(rows) = self { Ok(rows) } else { Err(foreign()) }
    }

    /// The result of [`Unit::Start`].
    ///
    /// # Errors
    /// As of [`rows`](Self::rows).
    pub fn start(self) -> Result<StartSummary, StudyError> {
        if let Self::Start(start) = self { Ok(*start) } else { Err(foreign()) }
    }

    /// The result of [`Unit::Design`].
    ///
    /// # Errors
    /// As of [`rows`](Self::rows).
    pub fn design(self) -> Result<RobustDesign, StudyError> {
        if let Self::Design(design) = self { Ok(*design) } else { Err(foreign()) }
    }

    /// The cells of [`Unit::Cells`].
    ///
    /// # Errors
    /// As of [`rows`](Self::rows).
    pub fn cells(self) -> Result<Vec<Costs>, StudyError> {
        if let Self::Cells(cells) = self { Ok(cells) } else { Err(foreign()) }
    }
}

fn foreign() -> StudyError {
    StudyError::usage("this unit of work belongs to another study")
}
