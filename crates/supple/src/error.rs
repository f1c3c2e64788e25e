use supple_kernels::halt;
use supple_lqg as lqg;
use supple_model::document::Unfit;
use supple_model::parameters::ParameterError;

use crate::stability::Stability;

/// Why something could not be computed.
///
/// ```
/// use supple::EvaluateOptions;
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
/// let found = problem.evaluate(&[], &EvaluateOptions::default());
/// let message = found.err().map(|error| error.to_string());
/// assert_eq!(message.as_deref(), Some("the list of parameters has length 0, not 1"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A matrix, a number or a shape with which the sweeps cannot compute, or a bound that does not exist.
    #[error(transparent)]
    Lqg(lqg::Error),
    /// Something of a task, or of settings, that does not fit.
    #[error(transparent)]
    Unfit(Unfit),
    /// A plan could not be computed where the time step is too large for the model.
    #[error("task `{task}`: {error}: {stability}")]
    TimeStep {
        /// The task.
        task: String,
        /// What could not be computed.
        error: Box<Error>,
        /// How large the time step may be.
        stability: Stability,
    },
    /// Stopped by [`halt`](crate::halt).
    #[error("stopped; no result was stored")]
    Stopped,
    /// An invalid number or matrix in the plan of a task.
    #[error("task `{task}`: {error}")]
    InTask {
        /// The task.
        task: String,
        /// What could not be computed.
        error: Box<Error>,
    },
    /// A number of a whole task that is not finite.
    #[error("{what} is not finite")]
    NotFinite {
        /// Which number.
        what: &'static str,
    },
    /// An unknown name.
    #[error("no {what} `{name}`; valid: {valid}")]
    Unknown {
        /// What kind of thing.
        what: &'static str,
        /// The name that was given.
        name: String,
        /// The valid names.
        valid: String,
    },
    /// A name or value that does not fit the parameters.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A kind of plan that cannot be computed for a task.
    #[error("plan = \"{plan}\" {problem}: {advice}")]
    Planning {
        /// The kind of plan, as in a task file.
        plan: &'static str,
        /// What the kind of plan does not support.
        problem: String,
        /// What to do about it.
        advice: &'static str,
    },
    /// Total gradients were requested along plans that do not minimise a cost.
    #[error(
        "the total gradient needs plans that minimise a cost: use plan = \"nominal\" or \"belief\", or the gradient \
         `frozen` with plan = \"{plan}\""
    )]
    NoTotalGradient {
        /// The kind of plan, as in a task file.
        plan: &'static str,
    },
    /// A plan that is at limits along which it cannot move.
    #[error(
        "the plan has no derivative: it cannot stay at its limits, the first at step {step}, where parameters change; remove \
         one, or use the gradient `frozen`"
    )]
    NoDerivative {
        /// The first step at a limit.
        step: usize,
    },
    /// Derivatives of the information used that rounding hides.
    #[error(
        "rounding hides the derivatives of the information that the controller uses, by {by:.1e} nats: some measurement is so \
         precise that the information used hardly differs from the information measured; minimise that instead"
    )]
    Rounded {
        /// By how much, nats.
        by: f64,
    },
    /// A plan that is no strict minimum of its cost, so that it has no derivative.
    #[error(
        "the plan has no derivative: it is no strict minimum of the cost, as some other controls from step {step} on cost the same \
         or less; give every control a weight, start from another `initial_control`, or use the gradient `frozen`"
    )]
    NoStrictMinimum {
        /// The first step of the changes that do not raise the cost.
        step: usize,
    },
    /// An error of a computation in another process, with its message.
    #[error("{0}")]
    Elsewhere(String),
}

impl Error {
    /// Whether the error lies in the request rather than in the numbers of a task.
    #[must_use]
    pub fn is_of_request(&self) -> bool {
        if let Self::InTask { error, .. } = self {
            return error.is_of_request();
        }
        matches!(
            self,
            Self::Lqg(lqg::Error::CostBelowLeast { .. } | lqg::Error::Shape { .. } | lqg::Error::TooMany { .. })
                | Self::Parameter(_)
                | Self::Unknown { .. }
                | Self::NoTotalGradient { .. }
                | Self::Planning { .. }
                | Self::Unfit(_)
        )
    }

    /// `what` is infinite or not a number at `step`.
    pub(crate) fn not_finite(what: &'static str, step: usize) -> Self {
        Self::Lqg(lqg::Error::NotFinite { what, step })
    }

    /// The matrix `what` is not positive definite at `step`.
    pub(crate) fn not_definite(what: &'static str, step: usize) -> Self {
        Self::Lqg(lqg::Error::NotPositiveDefinite { what, step })
    }

    /// `what` has the length `found` instead of `expected`.
    pub(crate) fn shape(what: impl Into<String>, found: usize, expected: usize) -> Self {
        Self::Lqg(lqg::Error::Shape { what: what.into(), found, expected })
    }

    /// There is no certified bound because of `what`.
    pub(crate) fn no_bound(what: impl Into<String>, advice: &'static str) -> Self {
        Self::Lqg(lqg::Error::NoBound { what: what.into(), advice })
    }

    /// An error if a stop was requested; called between parts of long computations.
    pub(crate) fn check_stop() -> Result<(), Self> {
        if halt::is_requested() { Err(Self::Stopped) } else { Ok(()) }
    }
}

impl From<lqg::Error> for Error {
    fn from(error: lqg::Error) -> Self {
        if matches!(error, lqg::Error::Stopped) { Self::Stopped } else { Self::Lqg(error) }
    }
}
