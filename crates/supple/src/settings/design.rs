use serde::{Deserialize, Serialize};

use super::InformationWeights;
use supple_model::document::Unfit;
use supple_text::digits;

/// How a design is searched for.
///
/// Example: the [module](crate::settings).
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(description = "How a design is searched for."))]
#[serde(default, deny_unknown_fields)]
pub struct DesignSettings {
    /// The optimiser.
    pub method: Method,
    /// Which gradient it follows.
    pub gradient: GradientKind,
    /// What is minimised: the information needed, used or measured, or a sum of them with weights.
    pub information: InformationWeights,
    /// How many starts: the parameters' initial values, then seeded random ones.
    pub starts: usize,
    /// Seed of random starts, branch searches and roll-outs.
    pub seed: u64,
    /// Closed-loop roll-outs at the first design and at the best one, which the search itself does not use; 0 for none
    pub rollouts: Option<usize>,
    /// Maximum number of evaluations per start and round.
    pub max_evaluations: usize,
    /// Relative change of information at which the search stops.
    pub tolerance: f64,
    /// Tolerance by which an expected cost may exceed its limit, relative to the limit.
    pub feasibility: f64,
    /// Attempts per search for other local minima of the nominal problem (contact bounces); 0 stays on the branch of
    /// the first plan.
    pub branch_attempts: usize,
    /// Maximum number of rounds of optimiser and branch search.
    pub rounds: usize,
    /// Maximum number of catalogue combinations to evaluate; if there are more, a neighbourhood search is used.
    pub max_combinations: usize,
    /// The barrier's weight beta.
    pub barrier_weight: f64,
    /// The barrier's margin gamma, in units of cost.
    pub barrier_margin: f64,
    /// The sum of the parameters' prices may be at most this; above 0.
    pub budget: Option<f64>,
    /// Weight of one unit of price in the objective, in nats.
    pub price_weight: f64,
}

/// Roll-outs of one result at most.
///
/// Example: [`check_rollouts`](crate::check_rollouts).
pub const MOST_ROLLOUTS: usize = 10_000_000;

/// Default number of roll-outs, except for large robots.
///
/// ```
/// use supple::settings::ROLLOUTS;
/// # let task = r#"
/// #     model = { kind = "linear", A = [[1.0, 0.1], [0.1, 1.0]], B = [[0.0], [0.1]], C = [[1.0, 0.0]] }
/// #     parameters.variance = { initial = 1e-4, bounds = [1e-6, 1e-2], scale = "log", unit = "m^2" }
/// #     [[tasks]]
/// #     name = "balance"
/// #     steps = 50
/// #     time_step = 0.1
/// #     bound = 15.0
/// #     initial_state = [1.0, 0.0]
/// #     noise = { initial = [1e-2, 1e-2], process = [0.0, 1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0, 0.0], [0.0, 0.1]], R = [[0.1]] }]
/// # "#;
///
/// // The task of the front page.
/// let problem = supple_file::parse(task, "balance.toml")?;
/// assert_eq!((problem.rollouts(None), problem.rollouts(Some(20))), (ROLLOUTS, 20));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub const ROLLOUTS: usize = 256;

impl Default for DesignSettings {
    fn default() -> Self {
        Self {
            method: Method::default(),
            gradient: GradientKind::default(),
            information: InformationWeights::default(),
            starts: 4,
            seed: 0,
            rollouts: None,
            max_evaluations: 200,
            tolerance: 1e-9,
            feasibility: 1e-6,
            branch_attempts: 48,
            rounds: 6,
            max_combinations: 500,
            barrier_weight: 1e4,
            barrier_margin: 0.01,
            budget: None,
            price_weight: 0.0,
        }
    }
}

impl DesignSettings {
    /// What is wrong with the settings: the key, and what is valid.
    pub fn check(&self) -> Result<(), Unfit> {
        let counts = [
            ("starts", self.starts),
            ("max_evaluations", self.max_evaluations),
            ("rounds", self.rounds),
            ("max_combinations", self.max_combinations),
        ];
        if let Some((key, _)) = counts.into_iter().find(|&(_, count)| count == 0) {
            return Err(Unfit::new(key, "must be at least 1; found 0"));
        }
        let memory = [
            ("starts", self.starts),
            ("branch_attempts", self.branch_attempts),
            ("max_combinations", self.max_combinations),
        ];
        if let Some((key, found)) = memory.into_iter().find(|&(_, count)| count > 10_000) {
            return Err(Unfit::new(key, format!("must be at most 10000; found {found}")));
        }
        if let Some(rollouts) = self.rollouts.filter(|&rollouts| rollouts > MOST_ROLLOUTS) {
            return Err(Unfit::new("rollouts", format!("must be at most {MOST_ROLLOUTS}; found {rollouts}")));
        }
        if !self.information.are_valid() {
            let message = match self.information.to_string() {
                none if none.is_empty() => {
                    "no weight is positive; valid: `needed`, `used` and `measured`, each at least 0".into()
                }
                found => format!("weights must be at least 0, and at least one positive; found {found}"),
            };
            return Err(Unfit::new("information", message));
        }
        if self.information != InformationWeights::MEASURED
            && (self.gradient == GradientKind::Frozen || self.method == Method::Barrier)
        {
            let message = format!(
                "`{}` needs the gradient `total`, and the method `sqp` or `cobyla`: the paper's method supports measured information only",
                self.information
            );
            return Err(Unfit::new("information", message));
        }
        let shares = [("tolerance", self.tolerance), ("feasibility", self.feasibility)];
        if let Some((key, found)) = shares.into_iter().find(|&(_, share)| !(share > 0.0 && share < 1.0)) {
            return Err(Unfit::new(key, format!("must be between 0 and 1; found {}", digits(found))));
        }
        if !(self.price_weight >= 0.0 && self.price_weight.is_finite()) {
            return Err(Unfit::new("price_weight", format!("must be at least 0; found {}", digits(self.price_weight))));
        }
        if let Some(found) = self.budget.filter(|budget| !(*budget > 0.0 && budget.is_finite())) {
            return Err(Unfit::new("budget", format!("must be above 0; found {}", digits(found))));
        }
        let positive = [("barrier_weight", self.barrier_weight), ("barrier_margin", self.barrier_margin)];
        match positive.into_iter().find(|&(_, value)| !(value > 0.0 && value.is_finite())) {
            Some((key, found)) => Err(Unfit::new(key, format!("must be above 0; found {}", digits(found)))),
            None => Ok(()),
        }
    }
}

/// An optimiser.
///
/// Example: the [module](crate::settings).
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(description = "An optimiser."))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Method {
    /// Sequential quadratic programming (SLSQP).
    #[default]
    Sqp,
    /// Linear approximations without gradients (COBYLA), for objectives with kinks and jumps.
    Cobyla,
    /// The paper's barrier descent, with signs corrected (theory, equation D.4).
    Barrier,
}

/// A gradient to optimise with.
///
/// Example: the [module](crate::settings).
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(description = "A gradient to optimise with."))]
#[serde(rename_all = "snake_case")]
pub enum GradientKind {
    /// Plan, feedback and filter all vary with the design.
    #[default]
    Total,
    /// Trajectory, gains and value of information held fixed, as in the paper; of the cost, only the belief's part.
    Frozen,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Sqp, Self::Cobyla, Self::Barrier];

    /// Its name in task files and commands, its short name in figures, and what it is.
    fn words(self) -> [&'static str; 3] {
        match self {
            Self::Sqp => ["sqp", "SQP", "sequential quadratic programming"],
            Self::Cobyla => ["cobyla", "COBYLA", "linear approximations without gradients"],
            Self::Barrier => ["barrier", "barrier", "barrier descent of the paper, with signs corrected"],
        }
    }

    /// Its name in task files and commands.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.words()[0]
    }

    /// Its short name in figures.
    #[must_use]
    pub fn label(self) -> &'static str {
        self.words()[1]
    }

    /// What it is.
    #[must_use]
    pub fn description(self) -> &'static str {
        self.words()[2]
    }

    /// Whether it uses gradients.
    #[must_use]
    pub fn uses_gradients(self) -> bool {
        self != Self::Cobyla
    }

    /// A number for each optimiser with each gradient that it can use, in the order of [`Self::ALL`], for their colours.
    #[must_use]
    pub fn number(self, gradient: GradientKind) -> usize {
        let before = Self::ALL.into_iter().take_while(|other| *other != self);
        let of = |method: Self| if method.uses_gradients() { GradientKind::ALL.len() } else { 1 };
        let own = GradientKind::ALL.into_iter().take_while(|other| *other != gradient).count();
        before.map(of).sum::<usize>() + if self.uses_gradients() { own } else { 0 }
    }
}

impl GradientKind {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Total, Self::Frozen];

    /// Its name in task files and commands.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Total => "total",
            Self::Frozen => "frozen",
        }
    }

    /// What it is.
    #[must_use]
    pub fn description(self) -> &'static str {
        match self {
            Self::Total => "plan, feedback and filter all vary with the parameters",
            Self::Frozen => "trajectory and gains are held fixed, as in the paper",
        }
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::fmt::Display for GradientKind {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
