use super::visited::{TaskVisit, Visit};
use crate::problem::Problem;

/// The objective of a design search.
///
/// Example: [`Optimiser`](crate::design::Optimiser).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Aim {
    /// The least information at which every expected cost is at most `factor` times its bound; an infinite factor
    /// removes all bounds.
    Information {
        /// Factor on all bounds; above 0.
        factor: f64,
    },
    /// The least factor by which all bounds can be multiplied and still be met: the minimum of the largest `J_i / D_i`.
    Cost,
    /// The same for costs without measurements: the least factor at which no information is needed. Takes total
    /// gradients.
    UnmeasuredCost,
}

impl Default for Aim {
    /// The least information within the unchanged bounds.
    fn default() -> Self {
        Self::Information { factor: 1.0 }
    }
}

impl Aim {
    /// Factor on the bounds; `None` if the aim has no bounds.
    pub(crate) fn factor(self) -> Option<f64> {
        match self {
            Self::Information { factor } => factor.is_finite().then_some(factor),
            Self::Cost | Self::UnmeasuredCost => Some(1.0),
        }
    }

    /// Whether a visited design is usable: its plans converged, it meets the budget and, if the aim has bounds, those too,
    /// within a relative tolerance `feasibility`.
    pub(crate) fn is_met(self, visit: &Visit, feasibility: f64) -> bool {
        match self {
            Self::Information { .. } => visit.is_feasible(feasibility),
            Self::Cost | Self::UnmeasuredCost => visit.is_planned() && visit.is_affordable(feasibility),
        }
    }

    /// What designs are compared by, smaller is better: whether it misses its limits, then the objective, or by how much it
    /// misses them.
    pub(super) fn merit(self, visit: &Visit, problem: &Problem, feasibility: f64) -> (bool, f64) {
        match self.is_met(visit, feasibility) {
            true => (false, self.objective(visit, problem)),
            false if visit.is_planned() => (true, visit.excess()),
            false => (true, f64::INFINITY),
        }
    }

    /// The value by which usable designs are compared.
    pub(crate) fn objective(self, visit: &Visit, problem: &Problem) -> f64 {
        match self {
            Self::Information { .. } => visit.objective(problem),
            Self::Cost | Self::UnmeasuredCost => self.violation(visit),
        }
    }

    /// How far the worst cost that it is about is above its bound, relative to the bound; negative where all are below.
    pub(super) fn violation(self, visit: &Visit) -> f64 {
        let of = if self == Self::UnmeasuredCost { TaskVisit::unmeasured_violation } else { TaskVisit::violation };
        visit.tasks.iter().filter_map(of).fold(f64::NEG_INFINITY, f64::max)
    }
}
