//! Arguments of studies and of what shows them.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use supple::design::ROLLOUTS;

use super::{GradientArgument, MethodArgument, Output, TaskArguments, count};

#[derive(Args, Debug)]
pub struct SweepOptions {
    #[command(flatten)]
    pub task: TaskArguments,
    /// An axis: NAME=FROM:TO:COUNT, NAME=log:FROM:TO:COUNT or NAME=A,B,..; may be given several times
    ///
    /// The last axis changes fastest.
    #[arg(long, value_name = "NAME=VALUES", required = true)]
    pub grid: Vec<String>,
    /// Closed-loop roll-outs at every point
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = count(0, 1_000_000))]
    pub rollouts: usize,
    /// At every point, design the parameters that are on no axis, from this many starts
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = count(0, 10_000))]
    pub starts: usize,
    /// Seed of roll-outs and searches
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    /// Points to evaluate at once; all cores where left out
    #[arg(long, value_name = "N", value_parser = count(1, 1024))]
    pub jobs: Option<usize>,
    #[command(flatten)]
    pub output: Output,
}

#[derive(Args, Debug)]
pub struct RobustnessOptions {
    #[command(flatten)]
    pub task: TaskArguments,
    /// Designs: `start`, `optimum`, and NAME=PARAMETER:VALUE,PARAMETER:VALUE,..; separated by commas
    ///
    /// `start` has the initial values of the task, as set; `optimum` is what `supple design` finds from there; other
    /// designs are the start with some parameters set. The first optimum, or else the last design, is compared with
    /// each other one.
    #[arg(long, value_name = "DESIGNS", default_value = "start,optimum")]
    pub designs: String,
    /// The parameter that grows: NAME=FROM:TO:COUNT or NAME=A,B,..
    ///
    /// FROM:TO:COUNT is spread by ratios where the parameter has the scale `log`, or else evenly; `log:FROM:TO:COUNT` and
    /// `lin:FROM:TO:COUNT` say which. Controllers are planned twice: for the value that the task gives, and for each
    /// value itself.
    #[arg(long, value_name = "NAME=VALUES")]
    pub vary: String,
    /// Closed-loop roll-outs at every point
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = count(2, 1_000_000))]
    pub rollouts: usize,
    /// Seed of the roll-outs; all designs see the same random numbers
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    pub output: Output,
}

#[derive(Args, Debug)]
pub struct ParetoOptions {
    #[command(flatten)]
    pub task: TaskArguments,
    /// Points of the front
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = count(2, 10_000))]
    pub points: usize,
    /// Starts at the front's loose end
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = count(1, 10_000))]
    pub starts: usize,
    /// Seed of the starts
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    pub output: Output,
}

#[derive(Args, Debug)]
pub struct SensorsOptions {
    #[command(flatten)]
    pub task: TaskArguments,
    /// Prices of all chosen sensors together at most
    #[arg(long, value_name = "B", allow_hyphen_values = true)]
    pub budget: Option<f64>,
    /// Chosen sensors at most
    #[arg(long, value_name = "K", value_parser = count(0, 1_000_000), allow_hyphen_values = true)]
    pub count: Option<usize>,
    /// Choose the cheapest set with an expected cost of at most this
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub cost: Option<f64>,
    /// What the set is to be best in
    #[arg(long = "for", value_enum, value_name = "GOAL", default_value_t = SensorGoalArgument::Cost)]
    pub goal: SensorGoalArgument,
    /// How the set is searched for
    #[arg(long, value_enum, default_value_t = SensorMethodArgument::Both)]
    pub method: SensorMethodArgument,
    /// The only task to look at, where there are several; the sum of all where left out
    #[arg(long = "task", value_name = "NAME")]
    pub name: Option<String>,
    #[command(flatten)]
    pub output: Output,
}

#[derive(Args, Debug)]
pub struct BoundOptions {
    #[command(flatten)]
    pub task: TaskArguments,
    /// The task, where there are several; all of them where left out
    #[arg(long = "task", value_name = "NAME")]
    pub name: Option<String>,
    /// Expected cost to keep, over the task, or per step with --stationary; the design's own where left out
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub cost: Option<f64>,
    /// The minimum over a range of costs too, at so many points; 20 where N is left out
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "20", require_equals = true, value_parser = count(2, 10_000))]
    pub curve: Option<usize>,
    /// Bounds by step of the steady state, for linear models that do not change over time
    #[arg(long)]
    pub stationary: bool,
    #[command(flatten)]
    pub output: Output,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum SensorGoalArgument {
    /// The least expected cost
    Cost,
    /// The most information
    Information,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum SensorMethodArgument {
    /// One sensor after the other
    Greedy,
    /// All sets; beyond 15 candidates by branch and bound, until the best one is proved
    Exhaustive,
    /// Both; beyond 15 candidates, branch and bound gives up after 2,000 regions
    Both,
}

#[derive(Args, Debug)]
pub struct TraceOptions {
    #[command(flatten)]
    pub task: TaskArguments,
    /// Starts: the initial values, then seeded random ones
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = count(1, 10_000))]
    pub starts: usize,
    /// Optimisers to compare
    #[arg(long, value_enum, value_delimiter = ',', default_value = "sqp,barrier")]
    pub method: Vec<MethodArgument>,
    /// Gradients to compare
    #[arg(long, value_enum, value_delimiter = ',', default_value = "total,frozen")]
    pub gradient: Vec<GradientArgument>,
    /// Seed of the starts
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    pub output: Output,
}

#[derive(Args, Debug)]
pub struct StudyOptions {
    /// Study file
    pub study: PathBuf,
    /// Folder for the results of all steps, and the report; the study's name where left out
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub struct ReportOptions {
    /// Folders of results
    #[arg(value_name = "DIR", required = true)]
    pub folders: Vec<PathBuf>,
    /// The page to write
    #[arg(long, value_name = "FILE", default_value = "report.html")]
    pub out: PathBuf,
}

#[derive(Args, Debug)]
pub struct PlotOptions {
    /// Folders of results, all drawn into one figure
    #[arg(value_name = "DIR", required = true)]
    pub folders: Vec<PathBuf>,
    /// What to draw
    #[arg(long, value_enum)]
    pub figure: FigureArgument,
    /// Task to draw, where there are several; the first one where left out
    #[arg(long, value_name = "NAME")]
    pub task: Option<String>,
    /// Format; that of the ending of --out where left out, or else svg
    #[arg(long, value_enum)]
    pub format: Option<Format>,
    /// Width
    #[arg(long, value_enum, default_value_t = Width::Column)]
    pub width: Width,
    /// The file to write; the figure's name in the current folder where left out
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FigureArgument {
    /// Cost and information over two parameters, with the paths of searches
    Landscape,
    /// States over time: plan, true, estimate, band of the belief
    Belief,
    /// Feedback gains and feedforward over time
    Gains,
    /// Costs as a noise grows
    Robustness,
    /// Information against cost
    Pareto,
    /// Information over time, per measurement
    Information,
    /// The least information over the cost to keep, with the design's own
    Bound,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Vector graphics for pages
    Svg,
    /// Pixels
    Png,
    /// Vector graphics for papers
    Pdf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Width {
    /// One column of a two-column paper, 88 mm
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
    /// Task whose controller to write, where there are several
    #[arg(long, value_name = "NAME")]
    pub task: Option<String>,
    /// Design of a search; the optimum where left out
    #[arg(long, value_enum)]
    pub at: Option<AtArgument>,
    /// The file to write; the task's name in the current folder where left out
    ///
    /// C is two files: NAME.c, and NAME.h beside it.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Closed-loop roll-outs of this controller with the nonlinear model; 0 for none
    #[arg(long, value_name = "N", default_value_t = ROLLOUTS, value_parser = count(0, 100_000_000))]
    pub rollouts: usize,
    /// Seed of the roll-outs
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ControllerFormatArgument {
    /// A header and a source of C99 that allocate nothing
    C,
    /// One JSON object
    Json,
    /// Arrays that numpy.load reads
    Npz,
}

#[derive(Args, Debug)]
pub struct ValidateOptions {
    /// Folder of a result of `supple design` or `supple evaluate`
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Closed-loop roll-outs of each task
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = count(2, 100_000))]
    pub rollouts: usize,
    /// Law of contact on MuJoCo
    #[arg(long, value_enum, default_value_t = ContactArgument::Same)]
    pub contact: ContactArgument,
    /// Design of a search; `start` is the design that an evaluation is about
    #[arg(long, value_enum)]
    pub at: Option<AtArgument>,
    /// A factor on numbers of MuJoCo's robot: NAME=FACTOR; may be given several times
    #[arg(long, value_name = "NAME=FACTOR")]
    pub vary: Vec<String>,
    /// Seed of the roll-outs
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    /// The Python to run
    #[arg(long, value_name = "PROGRAM", default_value = "python3")]
    pub python: String,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ContactArgument {
    /// That of supple
    Same,
    /// MuJoCo's own, as stiff at rest
    Mujoco,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AtArgument {
    /// The design that the search started from
    Start,
    /// The best design
    Optimum,
}
