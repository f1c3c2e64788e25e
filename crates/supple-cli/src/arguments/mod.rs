use std::path::PathBuf;

use clap::builder::RangedU64ValueParser;
use clap::{Args, Parser, Subcommand, ValueEnum};
use supple::Level;
use supple::design::{GradientKind, Method};
use supple::information::InformationWeights;
use supple_study::{LoadedTask, RESULT, check_writable};

use crate::failure::Failure;
use crate::output::warn;

mod studies;

pub use studies::{
    AtArgument, BoundOptions, ControllerFormatArgument, ExportOptions, FigureArgument, Format, ParetoOptions,
    PlotOptions, ReportOptions, RobustnessOptions, SensorGoalArgument, SensorMethodArgument, SensorsOptions,
    ShowOptions, StudyOptions, SweepOptions, TraceOptions, ValidateOptions, Width,
};

/// Design compliant robots that need little information to be controlled.
#[derive(Debug, Parser)]
#[command(name = "supple", version, propagate_version = true, arg_required_else_help = true)]
pub struct Arguments {
    #[command(flatten)]
    pub common: Common,
    #[command(subcommand)]
    pub command: Command,
}

/// Options of every command.
#[derive(Args, Debug)]
pub struct Common {
    /// Threads to use; all cores where left out. Results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = count(1, 1024))]
    threads: Option<usize>,
    /// Vector instructions to use; the machine's best where left out. `baseline` gives the same bits on every x86-64
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
    /// Threads to use, where that is said.
    pub fn threads(&self) -> Option<usize> {
        self.threads
    }

    /// The words that ask for the same vector instructions.
    pub fn instruction_words(&self) -> Vec<String> {
        let name =
            self.instructions.and_then(|instructions| Some(instructions.to_possible_value()?.get_name().to_owned()));
        name.map_or_else(Vec::new, |name| vec![format!("--instructions={name}")])
    }

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
        if let Some(threads) = self.threads {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
            pool.map_err(|error| Failure::usage(format!("--threads {threads}: {error}")))?;
        }
        Ok(())
    }
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Find the design that needs the least information while every task meets its bound
    Design(DesignOptions),
    /// Plan the tasks at one design and measure information, cost and gradients
    Evaluate(EvaluateOptions),
    /// Validate a task file and compare every derivative with finite differences
    Check(CheckOptions),
    /// Evaluate a grid of designs
    ///
    /// With --out, a journal in the folder keeps what is done, and the same command goes on where it was interrupted. With
    /// --json, one JSON object per point is printed.
    Sweep(SweepOptions),
    /// Compare the costs of designs in closed loop as a noise grows
    Robustness(RobustnessOptions),
    /// Follow the front of information against cost
    Pareto(ParetoOptions),
    /// Find how little information would do: certified bounds over all sensors and controllers
    Bound(BoundOptions),
    /// Choose sensors from a catalogue, and say what each of them is worth
    ///
    /// With --budget or --count, the set of the least expected cost (or of the most information) within them; with --cost,
    /// the cheapest set that keeps the expected cost within it. Without a catalogue in the task file, the candidates are
    /// the task's own measurements, without prices; where nothing has a price, the cheapest set is the smallest.
    Sensors(SensorsOptions),
    /// Record the paths of design searches
    Trace(TraceOptions),
    /// Make all studies of a study file, and a report of them
    Study(StudyOptions),
    /// Write one HTML page of results
    Report(ReportOptions),
    /// Draw a figure of a result
    Plot(PlotOptions),
    /// Print a result again
    Show(ShowOptions),
    /// Write the controller of a design as C, JSON or arrays of NumPy
    ///
    /// It is a linear, time-varying Kalman filter and control law around the plan: docs/controller.md has its formulas.
    Export(ExportOptions),
    /// Run a design in closed loop on MuJoCo
    ///
    /// Plan, gains and extended Kalman filter of a result of `supple design` or `supple evaluate` run on MuJoCo beside the
    /// task's own model, under the same noise. Writes validation.json into the folder. Needs Python with the packages supple
    /// and mujoco.
    Validate(ValidateOptions),
    /// Show the links and joints of a robot file, or its dynamics at a state
    ///
    /// Without a state: the tree of links and joints, with masses, limits and warnings. With one (any of --q, --v and
    /// --tau), or with --json: the dynamics as one JSON object. What is left out of a state is 0. With --to: the robot in
    /// another format, with gravity as --gravity or else the file says.
    Robot(RobotOptions),
    /// Print the JSON schema of task files
    Schema,
    /// Write a commented task file that runs
    New(NewOptions),
    /// Print a script that completes commands in a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// Reads a whole number between two others. The greatest keep what is asked for within memory.
fn count(least: u64, most: u64) -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(least..=most)
}

/// A task file, and values to set in it.
#[derive(Args, Debug)]
pub struct TaskArguments {
    /// Task file
    pub task: PathBuf,
    /// Set a parameter; may be given several times
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Print every warning, and not one line for all of a kind
    #[arg(long)]
    pub verbose: bool,
}

impl TaskArguments {
    /// The task, and its parameters as set; warnings go to standard error.
    pub fn load(&self) -> Result<LoadedTask, Failure> {
        let mut loaded = LoadedTask::load(&self.task, &[])?;
        for setting in &self.set {
            let wrong = |what: &str| Failure::usage(format!("--set {setting}: {what}"));
            let (name, value) = setting.split_once('=').ok_or_else(|| wrong("write NAME=VALUE"))?;
            let value: f64 = value.trim().parse().map_err(|_| wrong("the value is not a number"))?;
            let set = loaded.problem.parameters.set(&mut loaded.phi, name.trim(), value);
            set.map_err(|error| wrong(&error.to_string()))?;
        }
        let problem = &loaded.problem;
        let warnings = if self.verbose { &problem.every_warning } else { &problem.warnings };
        warnings.iter().for_each(|warning| warn(warning));
        Ok(loaded)
    }
}

/// Where a result goes.
#[derive(Args, Debug)]
pub struct Output {
    /// Folder to keep the result in, with all that made it and what it does over time
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
}

impl Output {
    /// Checks that the result can be kept, before long work is done for it.
    pub fn check(&self) -> Result<(), Failure> {
        match &self.out {
            Some(folder) => Ok(check_writable(folder, RESULT)?),
            None => Ok(()),
        }
    }
}

#[derive(Args, Debug)]
pub struct DesignOptions {
    #[command(flatten)]
    pub task: TaskArguments,
    /// Optimiser
    #[arg(long, value_enum)]
    pub method: Option<MethodArgument>,
    /// Gradient to follow
    #[arg(long, value_enum)]
    pub gradient: Option<GradientArgument>,
    /// Information to minimise
    #[arg(long, value_enum)]
    pub information: Option<InformationArgument>,
    /// Starts: the initial values, then seeded random ones
    #[arg(long, value_name = "N", value_parser = count(1, 10_000))]
    pub starts: Option<usize>,
    /// Seed of everything random
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Closed-loop roll-outs at the first and at the best design; 0 for none [default: that of the task, 256]
    #[arg(long, value_name = "N", value_parser = count(0, 100_000_000))]
    pub rollouts: Option<usize>,
    #[command(flatten)]
    pub output: Output,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum InformationArgument {
    /// The least that any sensors and any controller need at the cost limit
    Needed,
    /// What reaches the controls
    Used,
    /// What the measurements give
    Measured,
}

impl InformationArgument {
    /// What counts.
    pub fn weights(self) -> InformationWeights {
        let none = InformationWeights { needed: 0.0, used: 0.0, measured: 0.0 };
        match self {
            Self::Needed => InformationWeights { needed: 1.0, ..none },
            Self::Used => InformationWeights { used: 1.0, ..none },
            Self::Measured => InformationWeights { measured: 1.0, ..none },
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum MethodArgument {
    /// Sequential quadratic programming
    Sqp,
    /// The paper's barrier descent, its signs mended
    Barrier,
}

impl From<MethodArgument> for Method {
    fn from(method: MethodArgument) -> Self {
        match method {
            MethodArgument::Sqp => Self::Sqp,
            MethodArgument::Barrier => Self::Barrier,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum GradientArgument {
    /// Everything moves with the design
    Total,
    /// Trajectory and gains held fixed, as in the paper
    Frozen,
}

impl From<GradientArgument> for GradientKind {
    fn from(gradient: GradientArgument) -> Self {
        match gradient {
            GradientArgument::Total => Self::Total,
            GradientArgument::Frozen => Self::Frozen,
        }
    }
}

#[derive(Args, Debug)]
pub struct EvaluateOptions {
    #[command(flatten)]
    pub task: TaskArguments,
    /// Gradients to print
    #[arg(long, value_enum, default_value_t = GradientChoice::None)]
    pub gradient: GradientChoice,
    /// Closed-loop roll-outs with noise and an extended Kalman filter; 0 for none [default: that of the task, 256]
    #[arg(long, value_name = "N", value_parser = count(0, 100_000_000))]
    pub rollouts: Option<usize>,
    /// Attempts to find a cheaper plan on another branch of local minima
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = count(0, 10_000))]
    pub branches: usize,
    /// Seed of roll-outs and branch searches
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    pub output: Output,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum GradientChoice {
    /// Everything moves with the design
    Total,
    /// Trajectory and gains held fixed, as in the paper
    Frozen,
    /// Both
    Both,
    /// None
    None,
}

#[derive(Args, Debug)]
pub struct CheckOptions {
    #[command(flatten)]
    pub task: TaskArguments,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RobotFormat {
    /// The format of MuJoCo
    Mjcf,
}

/// What the dynamics of `supple robot` are.
const DYNAMICS: &str = "\
Dynamics, in SI units and radians:
  {\"joints\": [..], \"mass_matrix\": [[..]], \"bias\": [..], \"acceleration\": [..],
   \"frames\": {\"LINK\": {\"position\": [..], \"rotation\": [[..]]}, ..}, \"warnings\": [..]}
They satisfy mass_matrix acceleration + bias = tau: the bias holds Coriolis forces and gravity less the forces of \
springs, dampers and friction in the joints. Friction is f v / sqrt(v^2 + 0.01^2), as in robot models by default. \
`acceleration` is null, with a warning, where the mass matrix is singular. Frames are those of the links in the \
world; rotations are by rows. Warnings go to standard error.

Lists such as --q -0.5,1 are in the order of `joints`, which the tree shows too: the joints that move and follow no \
other. What is left out at the end of a list is 0.";

#[derive(Args, Debug)]
#[command(after_long_help = DYNAMICS)]
pub struct RobotOptions {
    /// Robot file: URDF, SDF or MJCF
    pub file: PathBuf,
    /// Let joints that follow others (mimic) move on their own
    #[arg(long)]
    pub independent_mimic: bool,
    /// Folder with packages: where package://NAME/ and model://NAME/ are looked for; may be given several times
    #[arg(long = "package-root", value_name = "DIR")]
    pub package_roots: Vec<PathBuf>,
    /// Positions, rad or m
    #[arg(long, value_name = "A,B,..", allow_hyphen_values = true)]
    pub q: Option<String>,
    /// Velocities, rad/s or m/s
    #[arg(long, value_name = "A,B,..", allow_hyphen_values = true)]
    pub v: Option<String>,
    /// Torques or forces of the drives, N m or N
    #[arg(long, value_name = "A,B,..", allow_hyphen_values = true)]
    pub tau: Option<String>,
    /// Gravity in the world, m/s^2; 0,0,-9.81 where left out, whatever the file says
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub gravity: Option<String>,
    /// Write the robot as a file of another format: `mjcf`, which MuJoCo reads
    #[arg(long, value_enum, value_name = "FORMAT", conflicts_with_all = ["q", "v", "tau", "json"])]
    pub to: Option<RobotFormat>,
    /// File to write; standard output where left out
    #[arg(long, value_name = "PATH", requires = "to")]
    pub out: Option<PathBuf>,
    /// Print every warning, and not one line for all of a kind
    #[arg(long)]
    pub verbose: bool,
    /// Print the dynamics as one JSON object and nothing else; without a state, those at rest with every position at 0
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct NewOptions {
    /// Name of the task; the file is NAME.toml
    pub name: String,
    /// Robot file, URDF, SDF or MJCF, of which the task moves a limb
    #[arg(long, value_name = "FILE")]
    pub robot: Option<PathBuf>,
    /// Folder with packages of the robot file; may be given several times
    #[arg(long = "package-root", value_name = "DIR", requires = "robot")]
    pub package_roots: Vec<PathBuf>,
}
