//! Results at visited designs.

use supple_kernels::Matrices;
use supple_model::ParameterHandle;

use super::DesignSettings;
use crate::aims::Unmeasured;
use crate::continuation::{Neighbour, Scaling, largest_difference};
use crate::problem::Problem;
use crate::violation;

/// A cost that exceeds the extrapolation with the mean slope by more than this share of the slopes is on another branch; a
/// parabola matches that extrapolation exactly.
const SURPRISE: f64 = 0.25;

/// Beyond this distance in scaled coordinates, slopes cannot detect branch changes.
const NEAR: f64 = 0.25;

/// Violations up to this, relative to the bound, are rounding.
pub(super) const ROUNDING: f64 = 1e-9;

/// What is known of one task at a visited design.
#[derive(Clone, Debug)]
pub(crate) struct TaskVisit {
    /// Its plan, to warm-start from.
    pub plan: Neighbour,
    /// Its directed information, nats, and gradient by all parameters.
    pub information: f64,
    pub information_gradient: Vec<f64>,
    /// Its derivative by the task's bound, on which the needed information depends.
    pub information_by_limit: f64,
    /// Its expected cost, and gradient by all parameters.
    pub cost: f64,
    pub cost_gradient: Vec<f64>,
    /// Its bound, where it has one.
    pub bound: Option<f64>,
    /// Derivative of the bound by each parameter on which it depends.
    pub bound_slopes: Vec<(ParameterHandle, f64)>,
    /// The cost without measurements, if it must stay within the bound.
    pub unmeasured: Option<Unmeasured>,
    /// The information that is needed per unit by which that cost exceeds the bound, nats, if both are equal; infinite if
    /// none may be needed.
    pub first_price: f64,
    /// Whether its plan converged.
    pub converged: bool,
    /// Whether its plan never makes a contact whose force a cost tracks.
    pub misses_contact: bool,
}

/// What the parameters of a visited design cost.
#[derive(Clone, Debug)]
pub(crate) struct PriceVisit {
    /// The sum of their prices, and gradient by all parameters.
    pub total: f64,
    pub gradient: Vec<f64>,
    /// Weight of one unit of price, nats.
    pub weight: f64,
    /// Upper limit on the sum.
    pub budget: Option<f64>,
}

impl PriceVisit {
    pub fn of(problem: &Problem, settings: &DesignSettings, phi: &[f64]) -> Self {
        let Problem { parameters, .. } = problem;
        let (total, gradient) = (parameters.price_in_search(phi), parameters.price_gradient(phi));
        Self { total, gradient, weight: settings.price_weight, budget: settings.budget }
    }

    /// How far the sum is above the budget, relative to it.
    pub fn violation(&self) -> Option<f64> {
        self.budget.map(|budget| violation(self.total, budget))
    }
}

/// A visited design.
#[derive(Clone, Debug)]
pub(crate) struct Visit {
    /// Scaled coordinates of the design parameters.
    pub scaled: Vec<f64>,
    /// All parameters.
    pub phi: Vec<f64>,
    pub tasks: Vec<TaskVisit>,
    pub price: PriceVisit,
}

impl Visit {
    /// The weighted sum of the tasks' information, nats.
    pub fn information(&self, problem: &Problem) -> f64 {
        self.tasks.iter().zip(&problem.tasks).map(|(visit, task)| task.information_weight * visit.information).sum()
    }

    /// The gradient of the weighted sum of the tasks' information by all parameters.
    pub fn information_gradient(&self, problem: &Problem) -> Vec<f64> {
        let mut sum = vec![0.0; self.phi.len()];
        for (visit, task) in self.tasks.iter().zip(&problem.tasks) {
            for (sum, gradient) in sum.iter_mut().zip(&visit.information_gradient) {
                *sum += task.information_weight * gradient;
            }
        }
        sum
    }

    /// The objective: information, and price with its weight, nats.
    pub fn objective(&self, problem: &Problem) -> f64 {
        self.information(problem) + self.price.weight * self.price.total
    }

    /// The objective's gradient by all parameters.
    pub fn objective_gradient(&self, problem: &Problem) -> Vec<f64> {
        let mut sum = self.information_gradient(problem);
        for (sum, slope) in sum.iter_mut().zip(&self.price.gradient) {
            *sum += self.price.weight * slope;
        }
        sum
    }

    /// The largest relative excess over a task's bound or the budget, including costs without measurements if these
    /// must stay within bounds.
    pub fn excess(&self) -> f64 {
        let costs = self.tasks.iter().flat_map(|task| [task.violation(), task.unmeasured_violation()]);
        costs.flatten().chain(self.price.violation()).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Whether every task meets its bound and the design the budget within `feasibility`, and every plan converged.
    pub fn is_feasible(&self, feasibility: f64) -> bool {
        self.excess() <= feasibility && self.is_planned()
    }

    /// Whether the design meets the budget within `feasibility`.
    pub fn is_affordable(&self, feasibility: f64) -> bool {
        self.price.violation().is_none_or(|violation| violation <= feasibility)
    }

    /// Whether any plan never makes a contact whose force a cost tracks.
    pub fn misses_contact(&self) -> bool {
        self.tasks.iter().any(|task| task.misses_contact)
    }

    /// Whether every plan converged, to numbers that are finite.
    pub fn is_planned(&self) -> bool {
        self.tasks.iter().all(|task| task.converged && task.cost.is_finite() && task.information.is_finite())
    }
}

impl TaskVisit {
    /// Whether the cost at a design is so far above the extrapolation by slopes there and at this one that its plan seems
    /// to be on another branch.
    pub fn leads_up_to(&self, other: &Self, scaling: &Scaling, from: &[f64], to: &[f64]) -> bool {
        let (start, end) = (scaling.scaled(from), scaling.scaled(to));
        let along = |at: &[f64], gradient: &[f64]| scaling.slope_along(&start, &end, at, gradient);
        let (first, last) = (along(from, &self.cost_gradient), along(to, &other.cost_gradient));
        let surprise = other.cost - self.cost - 0.5 * (first + last);
        largest_difference(&start, &end) <= NEAR
            && surprise > SURPRISE * (first.abs() + last.abs()) + 1e-3 * self.cost.abs()
    }

    /// `(J - D) / |D|`
    pub fn violation(&self) -> Option<f64> {
        self.bound.map(|bound| violation(self.cost, bound))
    }

    /// The same for the cost without measurements, if it must stay within the bound.
    pub fn unmeasured_violation(&self) -> Option<f64> {
        self.bound.zip(self.unmeasured.as_ref()).map(|(bound, unmeasured)| violation(unmeasured.cost, bound))
    }

    /// The gradient of a cost less this share of the bound, from the gradient of the cost.
    pub fn less_bound(&self, gradient: &[f64], share: f64) -> Vec<f64> {
        let mut gradient = gradient.to_vec();
        // A bound that depends on parameters changes with them.
        for &(parameter, slope) in &self.bound_slopes {
            gradient[parameter] -= share * slope;
        }
        gradient
    }

    /// The gradient of the ratio of a cost to the bound, of which it is the [`violation`](Self::violation), by all parameters.
    pub fn ratio_gradient(&self, cost: f64, cost_gradient: &[f64]) -> Option<Vec<f64>> {
        let size = self.bound?.abs().max(1e-300);
        let mut gradient = self.less_bound(cost_gradient, cost / size);
        gradient.iter_mut().for_each(|entry| *entry /= size);
        Some(gradient)
    }
}

/// All plans of a visit.
pub(crate) fn plans_of(visit: &Visit) -> Vec<Neighbour> {
    visit.tasks.iter().map(|task| task.plan.clone()).collect()
}

/// Their controls.
pub(crate) fn controls_of(visit: &Visit) -> Vec<Matrices> {
    visit.tasks.iter().map(|task| task.plan.controls.clone()).collect()
}
