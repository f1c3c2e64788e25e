//! Arguments of searches for designs and of evaluations.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use serde::Deserialize;
use supple::design::{GradientKind, InformationWeights, Method};
use supple_text::capitalised;

use super::count::{Count, seed};

#[derive(Args, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DesignOptions {
    /// Optimiser
    #[arg(long, value_parser = method())]
    pub method: Option<Method>,
    /// Gradient to use
    #[arg(long, value_parser = gradient_kind())]
    pub gradient: Option<GradientKind>,
    /// Information to minimise: `needed`, the minimum that any sensors and any controller need to stay within the cost
    /// limit; `used`, by the controller; `measured`, by the sensors; or weights of these, such as
    /// `needed=1,measured=0.01`
    #[arg(long, value_name = "KIND")]
    pub information: Option<InformationWeights>,
    /// Number of starts: the initial values first, then seeded random values
    #[arg(long, value_name = "N")]
    pub starts: Option<Count<1, 10_000>>,
    /// Seed of all random numbers
    #[arg(long, value_name = "S", value_parser = seed)]
    pub seed: Option<u64>,
    /// Closed-loop roll-outs at the start and at the optimum; 0 for none [default: the value in the task file, or
    /// 256, or fewer with more than 32 states]
    #[arg(long, value_name = "N")]
    pub rollouts: Option<Count<0, 10_000_000>>,
}

/// Reads an optimiser.
pub fn method() -> impl TypedValueParser<Value = Method> {
    named(&Method::ALL, Method::name, Method::description)
}

/// Reads a gradient to optimise with.
pub fn gradient_kind() -> impl TypedValueParser<Value = GradientKind> {
    named(&GradientKind::ALL, GradientKind::name, GradientKind::description)
}

type Words<T> = fn(T) -> &'static str;

/// Reads one of the library's kinds by its name; help shows what each is.
fn named<T: Copy + Send + Sync + 'static>(
    all: &'static [T],
    name: Words<T>,
    about: Words<T>,
) -> impl TypedValueParser<Value = T> {
    let values = all.iter().map(move |&kind| PossibleValue::new(name(kind)).help(capitalised(about(kind))));
    let find = move |text: String| all.iter().copied().find(|&kind| name(kind) == text).ok_or("is unknown");
    PossibleValuesParser::new(values).try_map(find)
}

#[derive(Args, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EvaluateOptions {
    /// Gradients to print
    #[arg(long, value_enum, default_value_t)]
    pub gradient: GradientChoice,
    /// Closed-loop roll-outs with noise and an extended Kalman filter; 0 for none [default: the value in the task file,
    /// or 256, or fewer with more than 32 states]
    #[arg(long, value_name = "N")]
    pub rollouts: Option<Count<0, 10_000_000>>,
    /// Attempts to find a cheaper plan at another local minimum; without them, two attempts warn of a plan that costs 1 %
    /// less
    #[arg(long, value_name = "N", default_value_t)]
    pub branches: Count<0, 10_000>,
    /// Seed of roll-outs and branch searches
    #[arg(long, value_name = "S", value_parser = seed, default_value_t = 0)]
    pub seed: u64,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum GradientChoice {
    /// Plan, feedback and filter all vary with the parameters
    Total,
    /// Trajectory and gains are held fixed, as in the paper
    Frozen,
    /// Both
    Both,
    /// None
    #[default]
    None,
}
