use serde::{Deserialize, Serialize};
use supple::design::{DesignStatus, StartSummary};
use supple::{Error, Matrices, Problem};

use crate::StudyError;

/// What a search from one start found, for another process to read.
///
/// Example: the [module](crate::design).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Found {
    from: Vec<f64>,
    to: Vec<f64>,
    status: DesignStatus,
    #[serde(default)]
    passed: usize,
    information: f64,
    objective: f64,
    price: f64,
    overspent: f64,
    budget_multiplier: f64,
    costs: Vec<f64>,
    violation: f64,
    optimality: f64,
    multipliers: Vec<f64>,
    branches: usize,
    evaluations: usize,
    without_contact: usize,
    /// Controls of each task's plan, a vector by step; empty if nothing could be evaluated.
    controls: Vec<Vec<Vec<f64>>>,
    error: Option<String>,
}

impl Found {
    pub(crate) fn of(summary: StartSummary) -> Self {
        let StartSummary { from, to, status, information, costs, violation, optimality, .. } = summary;
        Self {
            from,
            to,
            status,
            passed: summary.passed,
            information,
            objective: summary.objective,
            price: summary.price,
            overspent: summary.overspent,
            budget_multiplier: summary.budget_multiplier,
            costs,
            violation,
            optimality,
            multipliers: summary.multipliers,
            branches: summary.branches,
            evaluations: summary.evaluations,
            without_contact: summary.without_contact,
            controls: summary.controls.iter().map(Matrices::to_rows).collect(),
            error: summary.error.map(|error| error.to_string()),
        }
    }

    /// The same of a problem.
    ///
    /// # Errors
    /// Where it does not fit to the problem.
    pub(crate) fn summary(self, problem: &Problem) -> Result<StartSummary, StudyError> {
        let foreign = || StudyError::usage("the result of a start does not match this task");
        let Self { from, to, status, information, costs, violation, optimality, .. } = self;
        let count = problem.parameters.iter().count();
        let there = self.controls.is_empty() || self.controls.len() == problem.tasks.len();
        if from.len() != count || to.len() != count || !there {
            return Err(foreign());
        }
        let pairs = self.controls.iter().zip(&problem.tasks);
        let controls = pairs.map(|(vectors, task)| {
            let len = task.system.dimensions().controls;
            if vectors.len() != task.steps || vectors.iter().any(|vector| vector.len() != len) {
                return Err(foreign());
            }
            Ok(Matrices::of_rows(vectors, len))
        });
        Ok(StartSummary {
            controls: controls.collect::<Result<_, _>>()?,
            from,
            to,
            status,
            passed: self.passed,
            information,
            objective: self.objective,
            price: self.price,
            overspent: self.overspent,
            budget_multiplier: self.budget_multiplier,
            costs,
            violation,
            optimality,
            multipliers: self.multipliers,
            branches: self.branches,
            evaluations: self.evaluations,
            without_contact: self.without_contact,
            error: self.error.map(Error::Elsewhere),
        })
    }
}
