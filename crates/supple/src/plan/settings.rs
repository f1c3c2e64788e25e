use serde::{Deserialize, Serialize};

/// How the nominal plan is searched for.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlanSettings {
    /// Iterations at most. Raise it when a plan ends as `max_iterations` while its cost still falls.
    pub max_iterations: usize,
    /// The plan is converged when the control's gradient of the Hamiltonian is at most this, relative to 1 plus the
    /// largest part it is made of.
    pub tolerance: f64,
    /// Whether to use second derivatives of the dynamics close to the optimum, for quadratic convergence. Results
    /// never depend on it; turn it off to see plain iLQG.
    pub newton: bool,
    /// Halvings of the step at most, in one line search.
    pub max_halvings: usize,
    /// The least share of the predicted decrease that a step must give.
    pub sufficient_decrease: f64,
}

impl Default for PlanSettings {
    fn default() -> Self {
        Self { max_iterations: 1000, tolerance: 1e-12, newton: true, max_halvings: 12, sufficient_decrease: 1e-4 }
    }
}

impl PlanSettings {
    /// What is wrong with the settings: the key, and what is valid.
    pub(crate) fn check(&self) -> Result<(), (&'static str, String)> {
        if self.max_iterations == 0 {
            return Err(("max_iterations", "must be at least 1; found 0".into()));
        }
        if !(self.tolerance > 0.0 && self.tolerance < 1.0) {
            return Err(("tolerance", format!("must be between 0 and 1; found {}", self.tolerance)));
        }
        if !(self.sufficient_decrease > 0.0 && self.sufficient_decrease < 1.0) {
            return Err(("sufficient_decrease", format!("must be between 0 and 1; found {}", self.sufficient_decrease)));
        }
        Ok(())
    }
}

/// How planning ended.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PlanStatus {
    /// The trajectory is stationary to the tolerance.
    Converged,
    /// The iterations were used up.
    #[default]
    MaxIterations,
    /// No step along the search direction lowered the cost.
    LineSearchStalled,
    /// The control's curvature stays indefinite, however much it is regularised.
    Indefinite,
}

impl PlanStatus {
    /// Whether the plan may be used for results.
    pub fn is_converged(self) -> bool {
        self == Self::Converged
    }
}

impl std::fmt::Display for PlanStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Self::Converged => "converged",
            Self::MaxIterations => "max_iterations",
            Self::LineSearchStalled => "line_search_stalled",
            Self::Indefinite => "indefinite",
        })
    }
}
