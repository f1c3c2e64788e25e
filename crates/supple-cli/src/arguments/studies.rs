//! Arguments of studies and of commands that show results.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::{Deserialize, Deserializer};
use supple::design::{GradientKind, Method, ROLLOUTS};

use super::count::{Count, choices, count_or_flag, seed, texts};
use super::designs::{gradient_kind, method};

#[derive(Args, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepOptions {
    /// An axis: NAME=FROM:TO:COUNT evenly spaced, NAME=log:FROM:TO:COUNT by equal factors, or NAME=A,B,..; may be repeated
    ///
    /// The last axis changes fastest.
    #[arg(long, value_name = "NAME=VALUES", required = true)]
    #[serde(deserialize_with = "texts")]
    pub grid: Vec<String>,
    /// Closed-loop roll-outs at every point
    #[arg(long, value_name = "N", default_value_t)]
    #[serde(default)]
    pub rollouts: Count<0, 1_000_000>,
    /// At every point, optimise the parameters that are not on an axis, from this many starts
    #[arg(long, value_name = "N", default_value_t)]
    #[serde(default)]
    pub starts: Count<0, 10_000>,
    /// At every point, attempts to find a cheaper plan at another local minimum
    #[arg(long, value_name = "N", default_value_t, conflicts_with = "starts")]
    #[serde(default)]
    pub branches: Count<0, 10_000>,
    /// Seed of roll-outs and searches
    #[arg(long, value_name = "S", value_parser = seed, default_value_t = 0)]
    #[serde(default)]
    pub seed: u64,
    /// Points to evaluate in parallel [default: all cores]
    #[arg(long, value_name = "N")]
    pub jobs: Option<Count<1, 1024>>,
}

#[derive(Args, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobustnessOptions {
    /// Designs, separated by commas: `start`, `optimum`, or NAME=PARAMETER:VALUE,PARAMETER:VALUE,..
    ///
    /// `start` has the task's initial values, after --set; `optimum` is what `supple design` finds from there; other
    /// designs are the start with some parameters changed. The first optimum, or else the last design, is compared with
    /// every other design.
    #[arg(long, value_name = "DESIGNS", default_value_t = RobustnessOptions::both())]
    #[serde(default = "RobustnessOptions::both")]
    pub designs: String,
    /// Parameter to vary: NAME=FROM:TO:COUNT or NAME=A,B,..
    ///
    /// FROM:TO:COUNT is spaced logarithmically if the scale of the parameter is `log`, and linearly otherwise;
    /// `log:FROM:TO:COUNT` and `lin:FROM:TO:COUNT` choose the spacing. Controllers are planned twice: for the nominal
    /// value in the task file, and for each value on the axis.
    #[arg(long, value_name = "NAME=VALUES")]
    pub vary: String,
    /// Closed-loop roll-outs at every point
    #[arg(long, value_name = "N", default_value_t = RobustnessOptions::some())]
    #[serde(default = "RobustnessOptions::some")]
    pub rollouts: Count<2, 1_000_000>,
    /// Seed of the roll-outs; all designs use the same random numbers
    #[arg(long, value_name = "S", value_parser = seed, default_value_t = 0)]
    #[serde(default)]
    pub seed: u64,
}

impl RobustnessOptions {
    /// The designs to compare by default.
    fn both() -> String {
        "start,optimum".to_owned()
    }

    /// The number of roll-outs by default.
    fn some() -> Count<2, 1_000_000> {
        Count(20)
    }
}

#[derive(Args, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ParetoOptions {
    /// Number of points on the front
    #[arg(long, value_name = "N", default_value_t = ParetoOptions::default().points)]
    pub points: Count<2, 10_000>,
    /// Starts for the front's unconstrained end
    #[arg(long, value_name = "N", default_value_t = ParetoOptions::default().starts)]
    pub starts: Count<1, 10_000>,
    /// Seed of the starts
    #[arg(long, value_name = "S", value_parser = seed, default_value_t = 0)]
    pub seed: u64,
}

impl Default for ParetoOptions {
    fn default() -> Self {
        Self { points: Count(20), starts: Count(4), seed: 0 }
    }
}

#[derive(Args, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorsOptions {
    /// Limit on the total price of the chosen sensors
    #[arg(long, value_name = "B", allow_hyphen_values = true)]
    pub budget: Option<f64>,
    /// Limit on the number of chosen sensors
    #[arg(long, value_name = "K", allow_hyphen_values = true)]
    pub count: Option<Count<0, 1_000_000>>,
    /// Choose the cheapest set whose expected cost is at most D
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub cost: Option<f64>,
    /// Objective of the selection
    #[arg(long = "for", value_enum, value_name = "GOAL", default_value_t)]
    #[serde(rename = "for")]
    pub goal: SensorGoalArgument,
    /// Search method
    #[arg(long, value_enum, default_value_t)]
    pub method: SensorMethodArgument,
    /// Task to consider [default: the sum of all tasks]
    #[arg(long = "task", value_name = "NAME")]
    #[serde(skip)]
    pub name: Option<String>,
}

#[derive(Args, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BoundOptions {
    /// Task whose bounds to compute [default: all tasks]
    #[arg(long = "task", value_name = "NAME")]
    #[serde(skip)]
    pub name: Option<String>,
    /// Limit on the expected cost, over the task, or per step with --stationary [default: the cost of the design
    /// itself]
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub cost: Option<f64>,
    /// Also compute the minimum over a range of costs, at N points; 20 if N is omitted
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "20", require_equals = true)]
    #[serde(deserialize_with = "curve")]
    pub curve: Option<Count<2, 10_000>>,
    /// Bounds per step in the steady state, for linear time-invariant models
    #[arg(long)]
    pub stationary: bool,
}

/// As `--curve`, with or without a number.
fn curve<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Count<2, 10_000>>, D::Error> {
    count_or_flag(deserializer, 20)
}

#[derive(Clone, Copy, Debug, Default, Deserialize, ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum SensorGoalArgument {
    /// Lowest expected cost
    #[default]
    Cost,
    /// Most information
    Information,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum SensorMethodArgument {
    /// Add one sensor at a time
    Greedy,
    /// Search all sets; with more than 15 candidates, by branch and bound until the best set is proved
    Exhaustive,
    /// Both; with more than 15 candidates, branch and bound stops after 2,000 regions
    #[default]
    Both,
}

#[derive(Args, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TraceOptions {
    /// Number of starts: the initial values first, then seeded random values
    #[arg(long, value_name = "N", default_value_t = TraceOptions::default().starts)]
    pub starts: Count<1, 10_000>,
    /// Optimisers to compare
    #[arg(long, value_parser = method(), value_delimiter = ',', default_value = "sqp,barrier")]
    #[serde(deserialize_with = "choices")]
    pub method: Vec<Method>,
    /// Gradients to compare
    #[arg(long, value_parser = gradient_kind(), value_delimiter = ',', default_value = "total,frozen")]
    #[serde(deserialize_with = "choices")]
    pub gradient: Vec<GradientKind>,
    /// Seed of the starts
    #[arg(long, value_name = "S", value_parser = seed, default_value_t = 0)]
    pub seed: u64,
}

impl Default for TraceOptions {
    fn default() -> Self {
        let (method, gradient) = (vec![Method::Sqp, Method::Barrier], GradientKind::ALL.to_vec());
        Self { starts: Count(10), method, gradient, seed: 0 }
    }
}

#[derive(Args, Debug)]
pub struct StudyOptions {
    /// Study file
    pub study: PathBuf,
    /// Folder for the results of all steps and the report [default: the name of the study file without its extension]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub struct ReportOptions {
    /// Folders of results
    #[arg(value_name = "DIR", required = true)]
    pub folders: Vec<PathBuf>,
    /// File to write
    #[arg(long, value_name = "FILE", default_value = "report.html")]
    pub out: PathBuf,
}

#[derive(Args, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlotOptions {
    /// Folders of results, all drawn into one figure
    #[arg(value_name = "DIR", required = true)]
    #[serde(skip)]
    pub folders: Vec<PathBuf>,
    /// What to draw
    #[arg(long, value_enum)]
    pub figure: FigureArgument,
    /// Task to draw [default: the first task]
    #[arg(long, value_name = "NAME")]
    pub task: Option<String>,
    /// Format [default: from the extension of --out, or else svg]
    #[arg(long, value_enum)]
    pub format: Option<Format>,
    /// Width
    #[arg(long, value_enum, default_value_t)]
    #[serde(default)]
    pub width: Width,
    /// File to write [default: the figure's name, in the current folder]
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    pub out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum FigureArgument {
    /// Cost and information over two parameters, with the paths of searches
    Landscape,
    /// States over time: plan, true state, and estimate with its uncertainty band
    Belief,
    /// Feedback gains and feedforward over time
    Gains,
    /// Costs as a noise variance grows
    Robustness,
    /// Information against cost
    Pareto,
    /// Information over time, per measurement
    Information,
    /// Minimum information over the cost limit, with the information of the design itself
    Bound,
    /// The robot at six instants, with contact forces as arrows
    Motion,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// Vector graphics for web pages
    Svg,
    /// Pixels
    Png,
    /// Vector graphics for papers
    Pdf,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Width {
    /// One column of a two-column paper, 88 mm
    #[default]
    Column,
    /// Both columns, 180 mm
    Page,
}

#[derive(Args, Debug)]
pub struct ShowOptions {
    /// Folder of a result
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct ExportOptions {
    /// Folder of a result of `supple design` or `supple evaluate`
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// What to write
    #[arg(long, value_enum)]
    pub to: ControllerFormatArgument,
    /// Task whose controller to write; required if there are several tasks
    #[arg(long, value_name = "NAME")]
    pub task: Option<String>,
    /// Design to export, for a search [default: the optimum]
    #[arg(long, value_enum)]
    pub at: Option<AtArgument>,
    /// File to write [default: the task's name, in the current folder]
    ///
    /// C output is two files: NAME.c, and NAME.h next to it.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Closed-loop roll-outs of this controller with the nonlinear model; 0 for none
    #[arg(long, value_name = "N", default_value_t = Count(ROLLOUTS))]
    pub rollouts: Count<0, 10_000_000>,
    /// Seed of the roll-outs
    #[arg(long, value_name = "S", value_parser = seed, default_value_t = 0)]
    pub seed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ControllerFormatArgument {
    /// C99 source and header without dynamic allocation
    C,
    /// One JSON object
    Json,
    /// NumPy arrays, for numpy.load
    Npz,
}

#[derive(Args, Debug)]
pub struct ValidateOptions {
    /// Folder of a result of `supple design` or `supple evaluate`
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Closed-loop roll-outs of each task
    #[arg(long, value_name = "N", default_value_t = Count(200))]
    pub rollouts: Count<2, 100_000>,
    /// Contact law on MuJoCo
    #[arg(long, value_enum, default_value_t = ContactArgument::Same)]
    pub contact: ContactArgument,
    /// Design to validate [default: the optimum of a search]; the design of an evaluation is its `start`
    #[arg(long, value_enum)]
    pub at: Option<AtArgument>,
    /// Multiply a quantity of MuJoCo's robot by a factor: NAME=FACTOR; may be repeated
    #[arg(long, value_name = "NAME=FACTOR")]
    pub vary: Vec<String>,
    /// Seed of the roll-outs
    #[arg(long, value_name = "S", value_parser = seed, default_value_t = 0)]
    pub seed: u64,
    /// Python interpreter to run
    #[arg(long, value_name = "PROGRAM", default_value = "python3")]
    pub python: String,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ContactArgument {
    /// The law that supple uses
    Same,
    /// MuJoCo's own law, with the same stiffness at rest
    Mujoco,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AtArgument {
    /// The design that the search started from
    Start,
    /// The best design
    Optimum,
}

/// Parses a port.
fn port(text: &str) -> Result<u16, String> {
    let number = text.parse().ok().filter(|&port| port > 0);
    number.ok_or_else(|| format!("must be a port from 1 to {}; found {text}", u16::MAX))
}

#[derive(Args, Debug)]
pub struct ExploreOptions {
    /// Task file, or the folder of a result, whose design is shown first
    pub task: PathBuf,
    /// Set a parameter; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Port on 127.0.0.1 [default: any free port]
    #[arg(long, value_name = "N", value_parser = port)]
    pub port: Option<u16>,
    /// Print the address without opening a browser
    #[arg(long)]
    pub no_browser: bool,
}
