//! Summary of the search from one start.

use serde::{Deserialize, Serialize};
use supple_kernels::Matrices;

use super::Ending;
use super::optimality::{OPTIMAL, optimality};
use super::visit::Visitor;
use super::visited::{Visit, controls_of};
use crate::Error;

/// How a design search ended.
///
/// Example: [`design`](crate::design::design()).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DesignStatus {
    /// At a local optimum that meets every bound.
    Converged,
    /// Stopped at a point that meets every bound but, by the total gradient, is not an optimum.
    NotOptimal,
    /// At the best point found when the evaluations were used up or no progress was made; it meets every bound.
    NotConverged,
    /// No design that meets every bound was found.
    BoundViolated,
    /// Stopped on request; the best point found so far.
    Stopped,
}

impl DesignStatus {
    /// Whether the design found meets every bound and the budget, with plans that converged. This is of the status of a start, or of
    /// a search that was not stopped: [`Design::meets_bounds`](crate::design::Design::meets_bounds) tells of all searches.
    #[must_use]
    pub fn meets_bounds(self) -> bool {
        self != Self::BoundViolated
    }
}

impl std::fmt::Display for DesignStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Self::Converged => "converged",
            Self::NotOptimal => "not_optimal",
            Self::NotConverged => "not_converged",
            Self::BoundViolated => "bound_violated",
            Self::Stopped => "stopped",
        })
    }
}

/// Summary of the search from one start.
///
/// Example: [`design`](crate::design::design()).
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct StartSummary {
    /// All parameters where it started.
    pub from: Vec<f64>,
    /// All parameters where it ended.
    pub to: Vec<f64>,
    /// How it ended.
    pub status: DesignStatus,
    /// How many times the minimised information reached zero, so that the search continued with the next kind.
    #[serde(default)]
    pub passed: usize,
    /// Information at the end, nats, of the kind that was minimised last.
    pub information: f64,
    /// Objective at the end: information plus weighted price, nats.
    pub objective: f64,
    /// Sum of the parameters' prices at the end.
    pub price: f64,
    /// How far that is above the budget, relative to it; negative infinity if there is no budget.
    pub overspent: f64,
    /// Nats saved per unit increase in the budget (its Lagrange multiplier); 0 if some bound is not met.
    pub budget_multiplier: f64,
    /// Expected cost of each task at the end.
    pub costs: Vec<f64>,
    /// How far the worst cost that the search is about is above its bound, relative to it; negative below.
    pub violation: f64,
    /// First-order optimality: the largest entry of the projected Lagrangian gradient in scaled coordinates, relative
    /// to the objective's gradient.
    pub optimality: f64,
    /// Shadow price of each task's bound: nats saved per unit increase (its Lagrange multiplier); 0 if some
    /// bound is not met.
    pub multipliers: Vec<f64>,
    /// Number of different local minima of plans found at the final design: of the task that has most.
    pub branches: usize,
    /// Designs evaluated.
    pub evaluations: usize,
    /// Of these, how many have a plan that never makes a contact whose force a cost tracks.
    pub without_contact: usize,
    /// Whether it ended on request, before it was done, whatever its status: it may not even meet its bounds yet.
    pub interrupted: bool,
    /// Controls of each task's plan at the end; empty if nothing could be evaluated.
    #[serde(with = "vectors")]
    pub controls: Vec<Matrices>,
    /// Why a design could not be evaluated, where that ended the search; what was found before remains valid.
    #[serde(with = "message")]
    pub error: Option<Error>,
}

/// Sequences of vectors, for each task one, a vector by step.
mod vectors {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use supple_kernels::Matrices;

    pub fn serialize<S: Serializer>(all: &[Matrices], serializer: S) -> Result<S::Ok, S::Error> {
        all.iter().map(Matrices::to_rows).collect::<Vec<_>>().serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Matrices>, D::Error> {
        let all = Vec::<Vec<Vec<f64>>>::deserialize(deserializer)?;
        let sequence = |rows: &Vec<Vec<f64>>| {
            let len = rows.first().map_or(0, Vec::len);
            let fits = rows.iter().all(|row| row.len() == len);
            fits.then(|| Matrices::of_rows(rows, len)).ok_or_else(|| D::Error::custom("controls of different lengths"))
        };
        all.iter().map(sequence).collect()
    }
}

/// An error by its message.
mod message {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::Error;

    pub fn serialize<S: Serializer>(error: &Option<Error>, serializer: S) -> Result<S::Ok, S::Error> {
        error.as_ref().map(Error::to_string).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Error>, D::Error> {
        Ok(Option::<String>::deserialize(deserializer)?.map(Error::Elsewhere))
    }
}

impl StartSummary {
    /// The summary of a search that has not found anything yet.
    pub(crate) fn new(from: Vec<f64>) -> Self {
        Self {
            to: from.clone(),
            from,
            status: DesignStatus::BoundViolated,
            passed: 0,
            information: f64::NAN,
            objective: f64::NAN,
            price: f64::NAN,
            overspent: f64::NEG_INFINITY,
            budget_multiplier: 0.0,
            costs: Vec::new(),
            violation: f64::INFINITY,
            optimality: f64::NAN,
            multipliers: Vec::new(),
            branches: 0,
            evaluations: 0,
            without_contact: 0,
            interrupted: false,
            controls: Vec::new(),
            error: None,
        }
    }

    /// Records that the search was stopped after the result known so far.
    pub(crate) fn stop(&mut self) {
        if self.status.meets_bounds() {
            self.status = DesignStatus::Stopped;
        }
    }

    /// Records where a search ended.
    pub(crate) fn record(&mut self, at: &Visit, visitor: &Visitor, ending: Ending) {
        let met = visitor.aim.is_met(at, visitor.settings.feasibility);
        let (optimality, mut multipliers) = optimality(at, visitor);
        let of_budget = multipliers.pop().unwrap_or(0.0);
        self.status = match (met, ending) {
            (false, _) => DesignStatus::BoundViolated,
            (true, Ending::Stopped) => DesignStatus::Stopped,
            (true, _) if optimality <= OPTIMAL => DesignStatus::Converged,
            (true, Ending::Converged) => DesignStatus::NotOptimal,
            (true, _) => DesignStatus::NotConverged,
        };
        self.to = at.phi.clone();
        self.information = at.information(visitor.problem);
        self.objective = at.objective(visitor.problem);
        self.price = at.price.total;
        self.overspent = at.price.violation().unwrap_or(f64::NEG_INFINITY);
        self.budget_multiplier = if met { of_budget } else { 0.0 };
        self.costs = at.tasks.iter().map(|task| task.cost).collect();
        self.violation = visitor.aim.violation(at);
        self.optimality = optimality;
        self.multipliers = if met { multipliers } else { vec![0.0; at.tasks.len()] };
        self.controls = controls_of(at);
    }
}
