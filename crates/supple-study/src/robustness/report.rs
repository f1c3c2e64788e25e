//! Options and results of robustness studies.

use serde::{Deserialize, Serialize};
use supple::design::DesignStatus;
use supple::{Named, Verdict};

use crate::lenient;

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

/// What cells say that were not computed when the study was stopped.
pub(super) const STOPPED: &str = "stopped before it was computed";

impl RobustCell {
    /// Whether it was not computed, as the study was stopped before.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        self.error.as_deref() == Some(STOPPED)
    }

    /// Whether roll-outs have nothing in common with what is expected: they diverged, or surely cost [twice](Verdict::MUCH_MORE) as
    /// much, as in verdicts of evaluations.
    #[must_use]
    pub fn is_broken(&self) -> bool {
        let far = |expected: f64| self.mean - self.half_width_95 > Verdict::MUCH_MORE * expected.abs();
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
    /// Growth of the design's cost, less growth of the other's.
    #[serde(flatten)]
    pub growth: Paired,
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
