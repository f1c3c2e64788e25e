use serde::{Deserialize, Serialize};
use supple::sensors::{Goal, Limits};
use supple_text::digits;

use crate::StudyError;

/// What a set of sensors is chosen for.
///
/// Example: the [module](crate::sensors).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SensorGoal {
    /// The least expected cost within budget and count; or, with a bound on the cost, the least price.
    #[default]
    Cost,
    /// The most information within budget and count.
    Information,
}

/// How a set of sensors is searched for.
///
/// Example: the [module](crate::sensors).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SensorMethod {
    /// One sensor after the other.
    Greedy,
    /// All sets; beyond 15 candidates by branch and bound, until the best one is proved.
    Exhaustive,
    /// Both; branch and bound gives up after 2,000 regions.
    #[default]
    Both,
}

/// What is asked for.
///
/// Example: the [module](crate::sensors).
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorsOptions {
    /// Prices of all together at most.
    pub budget: Option<f64>,
    /// Sensors at most.
    pub count: Option<usize>,
    /// Limit on the expected cost: selects the cheapest set within it, or the smallest set if no sensor has a
    /// price.
    pub cost: Option<f64>,
    /// What is chosen for.
    pub goal: SensorGoal,
    /// How.
    pub method: SensorMethod,
    /// The only task that is looked at; default: all of them.
    pub task: Option<String>,
}

impl SensorsOptions {
    pub(super) fn check(&self) -> Result<(), StudyError> {
        let wrong = |what: &str, value: f64| {
            Err(StudyError::usage(format!("{what} must be at least 0; found {}", digits(value))))
        };
        match self {
            Self { budget: Some(budget), .. } if !(*budget >= 0.0 && budget.is_finite()) => {
                wrong("the budget", *budget)
            }
            Self { cost: Some(cost), .. } if !(*cost >= 0.0 && cost.is_finite()) => {
                wrong("the bound on the expected cost", *cost)
            }
            Self { cost: Some(_), goal: SensorGoal::Information, .. } => Err(StudyError::usage(
                "--cost selects the cheapest set and cannot be combined with --for information; remove one of them",
            )),
            _ => Ok(()),
        }
    }

    pub(super) fn goal(&self) -> Goal {
        match (self.cost, self.goal) {
            (Some(cost), _) => Goal::LeastPrice { cost },
            (None, SensorGoal::Cost) => Goal::LeastCost,
            (None, SensorGoal::Information) => Goal::MostInformation,
        }
    }

    pub(super) fn limits(&self) -> Limits {
        Limits { budget: self.budget, count: self.count }
    }
}
