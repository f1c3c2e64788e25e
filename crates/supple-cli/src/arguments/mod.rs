use clap::{Arg, Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};
use serde::Deserializer;
use supple::Level;

use crate::failure::Failure;

mod asks;
mod count;
mod designs;
mod robots;
mod studies;
mod task;

pub use asks::{Ask, Asked, Asks, Output, Subject};
pub use count::{Count, texts};
pub use designs::{DesignOptions, EvaluateOptions, GradientChoice};
pub use robots::{ModelKind, NewOptions, RobotFormat, RobotOptions};
pub use studies::{
    AtArgument, BoundOptions, ControllerFormatArgument, ExploreOptions, ExportOptions, Format, ParetoOptions,
    PlotOptions, ReportOptions, RobustnessOptions, SensorGoalArgument, SensorMethodArgument, SensorsOptions,
    ShowOptions, StudyOptions, SweepOptions, TraceOptions, ValidateOptions,
};
#[cfg(feature = "figures")]
pub use studies::{FigureArgument, Width};
pub use task::{TaskArguments, set};

/// Design compliant robots that need little information to be controlled.
#[derive(Debug, Parser)]
#[command(name = "supple", version, propagate_version = true, arg_required_else_help = true)]
pub struct Arguments {
    #[command(flatten)]
    pub common: Common,
    #[command(subcommand)]
    pub command: Command,
}

impl Arguments {
    /// Parses the process's arguments; on an error or a request for help, exits.
    pub fn of_process() -> Self {
        let mut matches = command_line().get_matches();
        Self::from_arg_matches_mut(&mut matches).unwrap_or_else(|error| error.format(&mut command_line()).exit())
    }
}

/// Options of every command.
#[derive(Args, Debug)]
pub struct Common {
    /// Threads to use [default: all cores]. Results do not depend on this number
    #[arg(long, global = true, value_name = "N")]
    threads: Option<Count<1, 1024>>,
    /// Vector instructions to use [default: the machine's best]. `baseline` gives bit-identical results on every x86-64
    #[arg(long, global = true, value_enum)]
    instructions: Option<Instructions>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Instructions {
    Baseline,
    Avx2,
    Avx512,
}

impl Common {
    pub fn apply(&self) -> Result<(), Failure> {
        if let Some(instructions) = self.instructions {
            let level = match instructions {
                Instructions::Baseline => Level::Baseline,
                Instructions::Avx2 => Level::Avx2,
                Instructions::Avx512 => Level::Avx512,
            };
            if !level.force() {
                return Err(Failure::usage(format!("this machine has no {instructions:?} instructions")));
            }
        }
        if let Some(Count(threads)) = self.threads {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
            pool.map_err(|error| Failure::usage(format!("--threads {threads}: {error}")))?;
        }
        Ok(())
    }
}

#[derive(Debug, Subcommand)]
pub enum Command {
    #[command(flatten)]
    Study(StudyCommand),
    /// Validate a task file and compare every derivative with finite differences
    Check(CheckOptions),
    /// Explore designs with sliders, in a page in the browser
    ///
    /// Serves a page on 127.0.0.1 with sliders for all parameters, limits and noise. It shows plan, information, cost
    /// and the robot in motion live, a map over two sliders, design searches and roll-outs. Nothing leaves the machine;
    /// only requests with the token in the printed address are accepted. Press Ctrl-C to stop.
    Explore(ExploreOptions),
    /// Run all studies in a study file and write a report
    #[command(name = "study")]
    StudyFile(StudyOptions),
    /// Write one HTML page of results
    Report(ReportOptions),
    /// Draw a figure of a result
    Plot(PlotOptions),
    /// Print a stored result again
    Show(ShowOptions),
    /// Write the controller of a design as C, JSON or NumPy arrays
    ///
    /// The controller is a linear, time-varying Kalman filter and control law around the plan; docs/controller.md gives
    /// the formulas.
    Export(ExportOptions),
    /// Run a design in closed loop on MuJoCo
    ///
    /// Runs the plan, gains and extended Kalman filter of a result of `supple design` or `supple evaluate` both on
    /// MuJoCo and on the task's own model, under the same noise. Writes validation.json into the folder. Requires
    /// Python with the packages supple and mujoco.
    Validate(ValidateOptions),
    /// Show the links and joints of a robot file, or its dynamics at a given state
    ///
    /// Without a state: the tree of links and joints, with masses, limits and warnings. With a state (any of --q, --v
    /// and --tau), or with --json: the dynamics as one JSON object; omitted entries of the state are 0. With --to: the
    /// robot in another format, with gravity from --gravity, or else from the file.
    Robot(RobotOptions),
    /// Print the JSON schema of task files
    Schema,
    /// Write a commented task file that runs
    New(NewOptions),
    /// Print a shell completion script
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// Commands that run a study of a task.
#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// Find the parameters with the least information that stay within every cost limit
    Design(Asked<DesignOptions>),
    /// Plan the tasks at given parameters and compute information, cost and gradients
    Evaluate(Asked<EvaluateOptions>),
    /// Evaluate a grid of designs
    ///
    /// With --out, a journal in the folder records finished points, and the same command resumes after an interruption.
    #[command(mut_arg("json", |json| json.help("Print one JSON object per point, a line each, and nothing else")))]
    Sweep(Asked<SweepOptions>),
    /// Compare the costs of designs in closed loop as a noise variance grows
    Robustness(Asked<RobustnessOptions>),
    /// Trace the Pareto front of information and cost
    Pareto(Asked<ParetoOptions>),
    /// Compute the minimum information required, over all sensors and controllers, with a certificate
    Bound(Asked<BoundOptions>),
    /// Choose sensors from a catalogue and report what each sensor is worth
    ///
    /// With --budget or --count: the set within these limits that has the lowest expected cost (or the most
    /// information). With --cost: the cheapest set that keeps the expected cost within the limit. If the task file has
    /// no catalogue, the candidates are the task's own measurements, without prices; if nothing has a price, the
    /// cheapest set is the smallest.
    Sensors(Asked<SensorsOptions>),
    /// Record the paths of design searches
    Trace(Asked<TraceOptions>),
}

impl StudyCommand {
    /// The command of a name, with options read from a table of a study file.
    ///
    /// # Errors
    /// Where an option is unknown, missing or not valid; `None` where no command has this name.
    pub fn read<'de, D: Deserializer<'de>>(
        name: &str,
        options: D,
        task: TaskArguments,
        output: Output,
    ) -> Option<Result<Self, D::Error>> {
        fn read<'de, A: Ask, D: Deserializer<'de>>(
            options: D,
            task: TaskArguments,
            output: Output,
            of: fn(Asked<A>) -> StudyCommand,
        ) -> Result<StudyCommand, D::Error> {
            A::deserialize(options).map(|ask| of(Asked { task, ask, output }))
        }
        Some(match name {
            "design" => read(options, task, output, Self::Design),
            "evaluate" => read(options, task, output, Self::Evaluate),
            "sweep" => read(options, task, output, Self::Sweep),
            "robustness" => read(options, task, output, Self::Robustness),
            "pareto" => read(options, task, output, Self::Pareto),
            "bound" => read(options, task, output, Self::Bound),
            "sensors" => read(options, task, output, Self::Sensors),
            "trace" => read(options, task, output, Self::Trace),
            _ => return None,
        })
    }

    /// The arguments of the command.
    pub fn asks(&self) -> &dyn Asks {
        match self {
            Self::Design(options) => options,
            Self::Evaluate(options) => options,
            Self::Sweep(options) => options,
            Self::Robustness(options) => options,
            Self::Pareto(options) => options,
            Self::Bound(options) => options,
            Self::Sensors(options) => options,
            Self::Trace(options) => options,
        }
    }
}

/// The command line. Negative numbers are parsed as values; each option validates its own.
fn command_line() -> clap::Command {
    with_negative_numbers(Arguments::command())
}

fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let takes_value = |arg: &Arg| !arg.is_positional() && arg.get_action().takes_values();
    let command = command.mut_args(move |arg| if takes_value(&arg) { arg.allow_negative_numbers(true) } else { arg });
    command.mut_subcommands(with_negative_numbers)
}

#[derive(Args, Debug)]
pub struct CheckOptions {
    #[command(flatten)]
    pub task: TaskArguments,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
}
