use super::visited::Visit;
use crate::problem::Problem;

/// The objective of a design search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// The least information at which every expected cost is at most `factor` times its bound; an infinite factor
    /// takes all bounds away.
    Information {
        /// What all bounds are multiplied by; above 0.
        factor: f64,
    },
    /// The least factor by which all bounds can be multiplied and still be met: the least of the greatest `J_i / D_i`.
    Cost,
}

impl Default for Aim {
    /// The least information within the bounds as they are.
    fn default() -> Self {
        Self::Information { factor: 1.0 }
    }
}

impl Aim {
    /// What bounds are multiplied by; `None` if there are to be no bounds.
    pub(crate) fn factor(self) -> Option<f64> {
        match self {
            Self::Information { factor } => factor.is_finite().then_some(factor),
            Self::Cost => Some(1.0),
        }
    }

    /// Whether a visit is of use: its plans converged, it meets the budget and, where bounds limit the aim, those too,
    /// within a share `feasibility` of them.
    pub(crate) fn is_met(self, visit: &Visit, feasibility: f64) -> bool {
        match self {
            Self::Information { .. } => visit.is_feasible(feasibility),
            Self::Cost => visit.is_planned() && visit.is_affordable(feasibility),
        }
    }

    /// What is minimised among visits that are of use.
    pub(crate) fn objective(self, visit: &Visit, problem: &Problem) -> f64 {
        match self {
            Self::Information { .. } => visit.objective(problem),
            Self::Cost => visit.violation(),
        }
    }
}
