//! Robustness: the cost in closed loop as a noise grows, of several designs under the same random numbers.

use serde::{Deserialize, Serialize};
use supple::Named;

use crate::{LoadedTask, StudyError, Watch};

/// What a study of robustness does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobustnessOptions {
    /// The designs: names with values of parameters; `start` and `optimum` stand for those of the task.
    pub designs: Vec<DesignChoice>,
    /// The parameter that grows, such as a variance.
    pub vary: crate::sweep::Axis,
    /// Roll-outs at every point.
    pub rollouts: usize,
    /// Seed of the roll-outs; all designs see the same random numbers.
    pub seed: u64,
}

/// A design by name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DesignChoice {
    /// The initial values of the task, as set.
    Start,
    /// What `supple design` finds from there.
    Optimum,
    /// The initial values, with these set.
    Named(String, Vec<(String, f64)>),
}

/// The result of a study of robustness.
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
}

/// A design of the study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobustDesign {
    /// Its name.
    pub name: String,
    /// All its parameters.
    pub parameters: Named,
    /// Its information at the nominal noise, nats.
    pub information_nats: f64,
}

/// Which noise a controller and its filter are planned for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlannedFor {
    /// The noise that the task gives, whatever the truth is.
    Nominal,
    /// The noise that there is.
    Truth,
}

/// The cost of one design in one task at one level of noise.
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
    /// Half-width of the 95 % confidence interval of the mean.
    #[serde(deserialize_with = "supple::or_nan")]
    pub confidence: f64,
    /// Quantiles of the cost at 5, 25, 50, 75 and 95 %.
    pub quantiles: [f64; 5],
    /// Expected cost by the theory, where the controller is planned for the truth.
    pub expected: Option<f64>,
    /// Why it could not be computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

/// How the growth of cost from the least to the greatest noise compares between two designs, roll-out by roll-out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Index of the task.
    pub task: usize,
    /// What controllers are planned for.
    pub planned_for: PlannedFor,
    /// Index of the design that is asked about: the optimum where there is one, or else the last.
    pub design: usize,
    /// Index of the design that it is compared with.
    pub other: usize,
    /// Growth of the design's cost, less growth of the other's; mean over roll-outs.
    pub difference: f64,
    /// Its 95 % confidence interval.
    pub interval: [f64; 2],
    /// Two-sided p-value of the hypothesis that there is no difference (paired t test).
    pub p_value: f64,
}

/// Makes a study of robustness.
///
/// # Errors
/// Where a design or parameter is unknown, or a design cannot be planned.
pub fn run(_task: &LoadedTask, _options: &RobustnessOptions, _watch: Watch) -> Result<Robustness, StudyError> {
    Err(StudyError::usage("not built yet"))
}
