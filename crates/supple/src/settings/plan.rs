use serde::{Deserialize, Serialize};
use supple_model::document::Unfit;
use supple_text::digits;

use supple_lqg::Regularisation;

/// How plans are searched for.
///
/// Example: the [module](crate::settings).
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(description = "How plans are searched for."))]
#[serde(default, deny_unknown_fields)]
pub struct PlanSettings {
    /// How the reference trajectory and its feedback are chosen. Older files call this key `mode`.
    #[serde(alias = "mode")]
    pub plan: PlanMode,
    /// With `plan = "risk"`: sigma, 1 over the unit of cost. Positive values are risk-averse, negative values
    /// risk-seeking; 0 gives the nominal plan.
    pub risk_sensitivity: f64,
    /// Settings of belief-space plans.
    pub belief: BeliefSettings,
    /// Settings of the sampled mode.
    pub sampled: SampledSettings,
    /// Maximum number of iterations of one search; a plan that has to find a contact or to keep limits takes several
    /// searches. Raise it if a plan ends with status `max_iterations` while its cost is still decreasing.
    pub max_iterations: usize,
    /// How long the planning of one task at one design may take, s; no limit by default. A plan that is stopped is not
    /// converged. Results then depend on the speed of the machine.
    pub time_limit: Option<f64>,
    /// The plan is converged when the largest `|l_u + B' lambda|` is at most this, relative to 1 plus the largest
    /// `|l_u|`; or, where rounding allows no further step, at most a thousand times this.
    pub tolerance: f64,
    /// Whether to use second derivatives of the dynamics close to an optimum, for quadratic convergence. Turn it off to
    /// see plain iLQG, which converges linearly and may end in another local minimum.
    pub newton: bool,
    /// Which second derivatives of the cost the final control law and the expected cost use.
    pub curvature: CostCurvature,
    /// What the regularisation acts on.
    pub regularisation: RegularisationKind,
    /// Maximum number of step halvings in one line search.
    pub max_halvings: usize,
    /// Minimum fraction of the predicted decrease that a step must achieve.
    pub sufficient_decrease: f64,
}

impl Default for PlanSettings {
    fn default() -> Self {
        Self {
            plan: PlanMode::default(),
            risk_sensitivity: 0.0,
            belief: BeliefSettings::default(),
            sampled: SampledSettings::default(),
            max_iterations: 1000,
            time_limit: None,
            tolerance: 1e-12,
            newton: true,
            curvature: CostCurvature::default(),
            regularisation: RegularisationKind::default(),
            max_halvings: 8,
            sufficient_decrease: 1e-4,
        }
    }
}

/// How the reference trajectory and its feedback are chosen.
///
/// Example: the [module](crate::settings).
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(description = "How the reference trajectory and its feedback are chosen."))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum PlanMode {
    /// Without noise, by line search, to a tight tolerance: information and cost are smooth in the design.
    #[default]
    Nominal,
    /// As in the paper: an average of runs with noise and a filter in the loop.
    Sampled,
    /// The least expected cost, so that a plan gathers information where that lowers the cost.
    Belief,
    /// Minimises the expected exponential of the cost: a risk-averse or risk-seeking law.
    Risk,
}

impl PlanMode {
    /// Its name in task files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Nominal => "nominal",
            Self::Sampled => "sampled",
            Self::Belief => "belief",
            Self::Risk => "risk",
        }
    }

    /// Whether such plans keep enforced limits of quantities.
    #[must_use]
    pub fn keeps_limits(self) -> bool {
        self == Self::Nominal
    }

    /// Whether such plans keep limits of the controls.
    #[must_use]
    pub fn keeps_control_limits(self) -> bool {
        matches!(self, Self::Nominal | Self::Sampled)
    }

    /// Whether total gradients exist: where plans minimise a cost by their trajectory.
    #[must_use]
    pub fn has_total_gradient(self) -> bool {
        matches!(self, Self::Nominal | Self::Belief)
    }
}

impl std::fmt::Display for PlanMode {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Which second derivatives of the cost the final control law and the expected cost use (theory, equation P.1a).
///
/// Example: the [module](crate::settings).
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(
    feature = "schema",
    schemars(description = "Which second derivatives of the cost the final control law and the expected cost use.")
)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum CostCurvature {
    /// All of them; Gauss-Newton's if the control law does not exist with all of them.
    #[default]
    Auto,
    /// All of them.
    Exact,
    /// Those of the norms alone, which are never indefinite.
    GaussNewton,
}

/// What the regularisation acts on (theory, equation P.2d).
///
/// Example: the [module](crate::settings).
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(description = "What the regularisation acts on (theory, equation P.2d)."))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RegularisationKind {
    /// The control's curvature: steps stay close to the last controls.
    #[default]
    Control,
    /// The cost-to-go's curvature: steps stay close to the last states (Tassa et al. 2012).
    State,
}

impl RegularisationKind {
    /// Terms of strength `mu`.
    pub(crate) fn of(self, mu: f64) -> Regularisation {
        match self {
            Self::Control => Regularisation { control: mu, state: 0.0 },
            Self::State => Regularisation { control: 0.0, state: mu },
        }
    }
}

/// Settings of the sampled mode.
///
/// Example: the [module](crate::settings).
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(description = "Settings of the sampled mode."))]
#[serde(default, deny_unknown_fields)]
pub struct SampledSettings {
    /// Iterations at most.
    pub iterations: usize,
    /// Averaging factor alpha in (0, 1].
    pub averaging: f64,
    /// Converged when a run moves the controls by less than this, relative to their size.
    pub tolerance: f64,
    /// Seed of the runs' noise.
    pub seed: u64,
}

impl Default for SampledSettings {
    fn default() -> Self {
        Self { iterations: 300, averaging: 0.1, tolerance: 1e-4, seed: 0 }
    }
}

/// Settings of belief-space plans.
///
/// Example: the [module](crate::settings).
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(description = "Settings of belief-space plans."))]
#[serde(default, deny_unknown_fields)]
pub struct BeliefSettings {
    /// Number of searches; the first starts from the nominal plan, the others from random variations of it, and the
    /// cheapest plan is kept. Raise it if informative regions are far from the nominal plan.
    pub starts: usize,
    /// Spread of the random guesses, relative to the root mean square of each control.
    pub spread: f64,
    /// Seed of the guesses.
    pub seed: u64,
}

impl Default for BeliefSettings {
    fn default() -> Self {
        Self { starts: 1, spread: 1.0, seed: 0 }
    }
}

impl PlanSettings {
    /// The same with another tolerance.
    pub(crate) fn to_tolerance(&self, tolerance: f64) -> Self {
        Self { tolerance, ..self.clone() }
    }

    /// What is wrong with the settings: the key, and what is valid.
    pub fn check(&self) -> Result<(), Unfit> {
        if self.max_iterations == 0 {
            return Err(Unfit::new("max_iterations", "must be at least 1; found 0"));
        }
        if let Some(limit) = self.time_limit.filter(|limit| !(*limit > 0.0 && limit.is_finite())) {
            return Err(Unfit::new(
                "time_limit",
                format!("must be above 0 s and finite; leave it out for no limit; found {}", digits(limit)),
            ));
        }
        if !(self.tolerance > 0.0 && self.tolerance < 1.0) {
            return Err(Unfit::new("tolerance", format!("must be between 0 and 1; found {}", digits(self.tolerance))));
        }
        if !(self.sufficient_decrease > 0.0 && self.sufficient_decrease < 1.0) {
            return Err(Unfit::new(
                "sufficient_decrease",
                format!("must be between 0 and 1; found {}", digits(self.sufficient_decrease)),
            ));
        }
        if !self.risk_sensitivity.is_finite() {
            return Err(Unfit::new("risk_sensitivity", format!("must be finite; found {}", self.risk_sensitivity)));
        }
        if self.risk_sensitivity != 0.0 && self.plan != PlanMode::Risk {
            let message = format!("is only valid with plan = \"risk\"; the plan is \"{}\"", self.plan.name());
            return Err(Unfit::new("risk_sensitivity", message));
        }
        if self.belief.starts == 0 {
            return Err(Unfit::new("starts", "must be at least 1; found 0").below("belief"));
        }
        if !(self.belief.spread > 0.0 && self.belief.spread.is_finite()) {
            return Err(
                Unfit::new("spread", format!("must be above 0; found {}", digits(self.belief.spread))).below("belief")
            );
        }
        let SampledSettings { iterations, averaging, tolerance, .. } = self.sampled;
        if iterations == 0 {
            return Err(Unfit::new("iterations", "must be at least 1; found 0").below("sampled"));
        }
        if !(averaging > 0.0 && averaging <= 1.0) {
            return Err(Unfit::new("averaging", format!("must be above 0 and at most 1; found {}", digits(averaging)))
                .below("sampled"));
        }
        if !(tolerance > 0.0 && tolerance < 1.0) {
            return Err(Unfit::new("tolerance", format!("must be between 0 and 1; found {}", digits(tolerance)))
                .below("sampled"));
        }
        Ok(())
    }
}

/// How planning ended.
///
/// Example: [`Problem::new`](crate::Problem::new).
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum PlanStatus {
    /// The trajectory is stationary, to the tolerance, for the plan's objective. In sampled mode: runs hardly move the
    /// reference any more, which is far from stationary.
    Converged,
    /// The iterations were used up.
    #[default]
    MaxIterations,
    /// No step along the search direction lowered the cost.
    LineSearchStalled,
    /// Over tens of iterations the cost hardly fell, far from stationary.
    SlowProgress,
    /// The time limit was reached.
    TimeLimit,
    /// The control's curvature stays indefinite, however much it is regularised.
    Indefinite,
    /// Limits that plans must keep are exceeded, however strongly that is penalised.
    LimitsExceeded,
}

impl PlanStatus {
    /// How a plan ended, in words that follow "the plan".
    #[must_use]
    pub fn description(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::MaxIterations => "reached the maximum number of iterations",
            Self::LineSearchStalled => "stalled: no step lowered its cost",
            Self::SlowProgress => "progressed too slowly: its cost hardly decreases",
            Self::TimeLimit => "reached its time limit",
            Self::LimitsExceeded => "violates its limits",
            Self::Indefinite => "failed: the curvature of the cost in the control stays indefinite",
        }
    }

    /// Whether the plan may be used for results.
    #[must_use]
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
            Self::SlowProgress => "slow_progress",
            Self::TimeLimit => "time_limit",
            Self::Indefinite => "indefinite",
            Self::LimitsExceeded => "limits_exceeded",
        })
    }
}
