//! Robustness: the cost in closed loop as a noise grows, of several designs under the same random numbers.
//!
//! # Two designs at three levels
//!
//! ```
//! use supple_study::robustness::{DesignChoice, PlannedFor, RobustnessOptions, RobustnessUnits};
//! use supple_study::robustness::{combine, parts, run};
//! use supple_study::sweep::Axis;
//! use supple_study::{LoadedTask, Source, Stop, Watch};
//! # let text = r#"
//! #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
//! #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
//! #     parameters.drive = { initial = 1e-3, bounds = [1e-5, 1e-1], role = "study" }
//! #     [[tasks]]
//! #     name = "hold"
//! #     steps = 20
//! #     time_step = 0.1
//! #     initial_state = [1.0]
//! #     noise = { initial = [1e-2], process = ["drive"], measurement = ["variance"] }
//! #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
//! # "#;
//! # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
//!
//! // The task of the front page with the process noise as the parameter `drive`.
//! let task = LoadedTask::restore(&[source], &[])?;
//! let options = RobustnessOptions {
//!     designs: DesignChoice::parse_list("start,noisy=variance:0.1", &task)?,
//!     vary: Axis::parse("drive=log:1e-4:1e-2:3", &task)?,
//!     rollouts: 20,
//!     seed: 1,
//! };
//! let study = run(&task, &options, None, Watch::default())?;
//! assert_eq!((study.designs.len(), study.cells.len()), (2, 12));
//! assert_eq!(study.cells.iter().filter(|cell| cell.planned_for == PlannedFor::Truth).count(), 6);
//! assert!(study.comparisons[0].at_greatest.difference.is_finite());
//!
//! // The same by parts, which may run in different processes.
//! let (units, stop) = (RobustnessUnits::new(&task, &options, Vec::new())?, Stop::never());
//! let (designs, cells) = parts(&task, &options)?;
//! let designs = (0..designs).map(|design| units.design(&task, design, stop)).collect::<Result<Vec<_>, _>>()?;
//! let again = combine(&task, &options, designs, units.cells(&task, 0..cells, stop)?)?;
//! assert_eq!(again.cells, study.cells);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cell;
mod choice;
mod comparison;
mod plan;
mod statistics;
mod unit;

use std::fmt::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};
use supple::design::DesignStatus;
use supple::parameters::Role;
use supple::{Named, Verdict};

use crate::journal::{Identity, Parts};
use crate::{LoadedTask, StudyError, Watch, lenient};
pub use cell::Costs;
use cell::{cells, sample_all};
use plan::{Planned, plan_all};
pub use unit::{RobustnessUnits, combine, parts};

/// What a study of robustness does.
///
/// Example: the [module](crate::robustness).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobustnessOptions {
    /// The designs: names with values of parameters; `start` and `optimum` stand for those of the task.
    pub designs: Vec<DesignChoice>,
    /// The parameter that grows, such as a variance.
    pub vary: crate::sweep::Axis,
    /// Roll-outs at every point.
    pub rollouts: usize,
    /// Seed of the roll-outs; all designs use the same random numbers.
    pub seed: u64,
}

/// A design by name.
///
/// Example: the [module](crate::robustness).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum DesignChoice {
    /// The initial values of the task, as set.
    Start,
    /// What `supple design` finds from there.
    Optimum,
    /// The initial values, with these set.
    Named(String, Vec<(String, f64)>),
}

/// The result of a study of robustness.
///
/// Example: the [module](crate::robustness).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Robustness {
    /// What was asked for.
    pub options: RobustnessOptions,
    /// The value of the varied parameter that controllers are planned for.
    pub nominal: f64,
    /// The designs.
    pub designs: Vec<RobustDesign>,
    /// Costs, one per design, task, planning and level, in this order of nesting.
    pub cells: Vec<RobustCell>,
    /// How designs compare.
    pub comparisons: Vec<Comparison>,
    /// Whether it was stopped before all cells were computed; those that were not say so in their `error`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stopped: bool,
}

/// A design of the study.
///
/// Example: the [module](crate::robustness).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobustDesign {
    /// Its name.
    pub name: String,
    /// All its parameters.
    pub parameters: Named,
    /// Its information at the nominal noise, nats.
    pub information_nats: f64,
    /// How the search for it ended, where it was searched for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub status: Option<DesignStatus>,
    /// Why its numbers cannot be trusted, for people: a cost wants a force from a contact that its plan for the nominal
    /// noise never touches.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// Which noise a controller and its filter are planned for.
///
/// Example: the [module](crate::robustness).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlannedFor {
    /// The nominal noise in the task, whatever the true noise is.
    Nominal,
    /// The true noise.
    Truth,
}

/// The cost of one design in one task at one level of noise.
///
/// Example: the [module](crate::robustness).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobustCell {
    /// Index of the design.
    pub design: usize,
    /// Index of the task.
    pub task: usize,
    /// What the controller is planned for.
    pub planned_for: PlannedFor,
    /// Index of the level in `options.vary.values`.
    pub level: usize,
    /// Mean cost; NaN where a roll-out diverged.
    #[serde(deserialize_with = "supple::or_nan")]
    pub mean: f64,
    /// Standard deviation of the cost over roll-outs.
    #[serde(deserialize_with = "supple::or_nan")]
    pub deviation: f64,
    /// Half-width of the 95 % confidence interval of the mean, in units of cost.
    #[serde(alias = "confidence", deserialize_with = "supple::or_nan")]
    pub half_width_95: f64,
    /// Quantiles of the cost at 5, 25, 50, 75 and 95 %; what diverged costs more than all that did not.
    #[serde(deserialize_with = "lenient::array")]
    pub quantiles: [f64; 5],
    /// How many roll-outs diverged: their cost is not finite, or a million times what is expected.
    #[serde(default)]
    pub diverged: usize,
    /// Expected cost by the theory, where the controller is planned for the truth.
    pub expected: Option<f64>,
    /// Why it could not be computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl RobustCell {
    /// Whether it was not computed, as the study was stopped before.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        self.error.as_deref() == Some(cell::STOPPED)
    }

    /// Whether roll-outs have nothing in common with what is expected: they diverged, or surely cost [many times](Verdict::FAR_MORE) as
    /// much, as in verdicts of evaluations.
    #[must_use]
    pub fn is_broken(&self) -> bool {
        let far = |expected: f64| self.mean - self.half_width_95 > Verdict::FAR_MORE * expected.abs();
        self.diverged > 0 || self.expected.is_some_and(far)
    }
}

/// How the growth of cost from the least to the greatest noise compares between two designs, roll-out by roll-out.
///
/// Example: the [module](crate::robustness).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Comparison {
    /// Index of the task.
    pub task: usize,
    /// What controllers are planned for.
    pub planned_for: PlannedFor,
    /// Index of the design of interest: the optimum if there is one, otherwise the last.
    pub design: usize,
    /// Index of the design that it is compared with.
    pub other: usize,
    /// Indices of the least and the greatest level, between which cost grows.
    pub levels: [usize; 2],
    /// Growth of the design's cost and of the other's; means over roll-outs.
    #[serde(deserialize_with = "lenient::array")]
    pub growths: [f64; 2],
    /// Growth of the design's cost, less growth of the other's; mean over roll-outs. NaN where a roll-out diverged.
    #[serde(deserialize_with = "supple::or_nan")]
    pub difference: f64,
    /// Its 95 % confidence interval.
    #[serde(alias = "interval", deserialize_with = "lenient::array")]
    pub interval_95: [f64; 2],
    /// Two-sided p-value of the hypothesis that there is no difference (paired t test).
    #[serde(deserialize_with = "supple::or_nan")]
    pub p_value: f64,
    /// The same of the costs at the greatest level themselves.
    pub at_greatest: Paired,
}

/// A mean difference over pairs, and whether it is one (paired t test).
///
/// Example: the [module](crate::robustness).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Paired {
    /// The mean difference; NaN where one of a pair diverged.
    #[serde(deserialize_with = "supple::or_nan")]
    pub difference: f64,
    /// Its 95 % confidence interval.
    #[serde(alias = "interval", deserialize_with = "lenient::array")]
    pub interval_95: [f64; 2],
    /// Two-sided p-value of the hypothesis that there is no difference.
    #[serde(deserialize_with = "supple::or_nan")]
    pub p_value: f64,
}

impl Paired {
    /// Half of the width of its confidence interval.
    #[must_use]
    pub fn half_width(&self) -> f64 {
        0.5 * (self.interval_95[1] - self.interval_95[0])
    }
}

/// Makes a study of robustness.
///
/// Every design is planned on the cheapest local minimum that a search at the nominal parameters finds. Controllers
/// planned for the true noise are re-planned at every level in the same way. Cells computed before a
/// stop are kept; with a folder, a journal there stores them as well, and the same study resumes from it.
///
/// # Errors
/// Where a parameter is unknown, the varied one is the design's to choose or is set by a design, or a design cannot be
/// planned; if it is stopped before any cell was computed; where the journal cannot be written, is damaged, or belongs
/// to another study.
///
/// Example: the [module](crate::robustness).
pub fn run(
    task: &LoadedTask,
    options: &RobustnessOptions,
    folder: Option<&Path>,
    watch: Watch,
) -> Result<Robustness, StudyError> {
    let varied = check(task, options)?;
    let parts = Parts::open(folder, &identity(task, options, varied))?;
    let total = options.designs.len() + cells(task, options);
    watch.progress.begin("designs and levels", 0, total as u64);
    let planned = plan_all(task, &options.designs, &parts, watch)?;
    let (costs, done) = sample_all(task, &planned, (options, varied), &parts, watch)?;
    if done == 0 {
        return Err(StudyError::Stopped);
    }
    let designs = planned.iter().map(|planned| planned.design(&task.problem)).collect();
    let stopped = done < costs.len();
    Ok(Robustness { stopped, ..assemble(task, options, varied, designs, costs) })
}

/// What a study of robustness is.
fn identity(task: &LoadedTask, options: &RobustnessOptions, varied: usize) -> Identity {
    let RobustnessOptions { designs, vary, rollouts, seed } = options;
    let mut text = String::new();
    for design in designs {
        let _ = write!(text, "design {}", design.name());
        if let DesignChoice::Named(_, values) = design {
            for (name, value) in values {
                let _ = write!(text, ", {name} = {value:?}");
            }
        }
        text.push('\n');
    }
    let _ = writeln!(text, "vary {} = {:?}\nrollouts {rollouts}\nseed {seed}", vary.parameter, vary.values);
    // The noise that controllers are planned for is not set by the options.
    let _ = writeln!(text, "planned for {} = {:?}", vary.parameter, task.phi[varied]);
    Identity::of("study of robustness", task, &text, &[varied])
}

/// The result of designs and cells, in their order.
fn assemble(
    task: &LoadedTask,
    options: &RobustnessOptions,
    varied: usize,
    designs: Vec<RobustDesign>,
    costs: Vec<Costs>,
) -> Robustness {
    let comparisons = comparison::compare(task, options, &costs);
    Robustness {
        options: options.clone(),
        nominal: task.phi[varied],
        designs,
        cells: costs.into_iter().map(|Costs { cell, .. }| cell).collect(),
        comparisons,
        stopped: false,
    }
}

/// Checks what was asked for; the index of the varied parameter.
pub(crate) fn check(task: &LoadedTask, options: &RobustnessOptions) -> Result<usize, StudyError> {
    let RobustnessOptions { designs, vary, rollouts, .. } = options;
    let name = &vary.parameter;
    let parameters = &task.problem.parameters;
    let varied = parameters.index(name)?;
    let wrong = |message: String| Err(StudyError::Usage(message));
    if parameters.get(varied).role == Role::Design {
        let others = parameters.iter().filter(|one| one.role == Role::Study).map(|one| one.name.as_str());
        let others: Vec<&str> = others.collect();
        let valid = match others.is_empty() {
            true => "the task has none: declare one, such as the variance of a noise".to_owned(),
            false => supple_text::quoted(&others),
        };
        return wrong(format!(
            "`{name}` is a design parameter and differs between designs; vary a parameter with role = \"study\" ({valid})"
        ));
    }
    let mut phi = task.phi.clone();
    vary.values.iter().try_for_each(|&value| parameters.set(&mut phi, name, value))?;
    if vary.values.len() < 2 {
        return wrong(format!("`{name}` has {} value; at least two are required", vary.values.len()));
    }
    supple::check_rollouts(*rollouts)?;
    if *rollouts < 2 {
        return wrong(format!(
            "at least 2 roll-outs are required to estimate the variance of the cost; found {rollouts}"
        ));
    }
    if designs.is_empty() {
        return wrong(choice::FORMS.to_owned());
    }
    for design in designs {
        if let DesignChoice::Named(design, values) = design
            && values.iter().any(|(parameter, _)| parameter == name)
        {
            return wrong(format!("the design `{design}` sets `{name}`, which is the parameter that is varied"));
        }
    }
    Ok(varied)
}
