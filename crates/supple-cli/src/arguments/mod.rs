use std::path::PathBuf;

use clap::builder::RangedU64ValueParser;
use clap::{Args, Parser, Subcommand, ValueEnum};
use supple::Level;
use supple::design::InformationWeights;
use supple::design::{GradientKind, Method};
use supple_study::LoadedTask;

use crate::commands::Asks;
use crate::failure::Failure;
use crate::output::warn;
use crate::template::Template;

mod studies;

pub use studies::{
    AtArgument, BoundOptions, ControllerFormatArgument, ExploreOptions, ExportOptions, FigureArgument, Format,
    ParetoOptions, PlotOptions, ReportOptions, RobustnessOptions, SensorGoalArgument, SensorMethodArgument,
    SensorsOptions, ShowOptions, StudyOptions, SweepOptions, TraceOptions, ValidateOptions, Width,
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
    /// Threads to use [default: all cores]. Results do not depend on this number
    #[arg(long, global = true, value_name = "N", value_parser = count(1, 1024))]
    threads: Option<usize>,
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
        if let Some(threads) = self.threads {
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
    /// Serves a page on 127.0.0.1 to the browser of this machine: sliders for all parameters, limits and noise; plan,
    /// information, costs and the robot in motion while they move; a map, searches and roll-outs. Nothing leaves the
    /// machine, and only the printed address with its token is answered. Ctrl-C ends it.
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

/// The commands that do a study of a task.
#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// Find the parameters with the least information that stay within every cost limit
    Design(DesignOptions),
    /// Plan the tasks at given parameters and compute information, cost and gradients
    Evaluate(EvaluateOptions),
    /// Evaluate a grid of designs
    ///
    /// With --out, a journal in the folder records finished points, and the same command resumes after an interruption.
    /// With --json, one JSON object per point is printed.
    Sweep(SweepOptions),
    /// Compare the costs of designs in closed loop as a noise variance grows
    Robustness(RobustnessOptions),
    /// Trace the Pareto front of information and cost
    Pareto(ParetoOptions),
    /// Compute the minimum information required, over all sensors and controllers, with a certificate
    Bound(BoundOptions),
    /// Choose sensors from a catalogue and report what each sensor is worth
    ///
    /// With --budget or --count: the set within these limits that has the lowest expected cost (or the most
    /// information). With --cost: the cheapest set that keeps the expected cost within the limit. If the task file has
    /// no catalogue, the candidates are the task's own measurements, without prices; if nothing has a price, the
    /// cheapest set is the smallest.
    Sensors(SensorsOptions),
    /// Record the paths of design searches
    Trace(TraceOptions),
}

impl StudyCommand {
    /// What is asked for.
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

/// Reads a whole number between two others. The greatest keep what is asked for within memory.
fn count(least: u64, most: u64) -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(least..=most)
}

/// A task file, and values to set in it.
#[derive(Args, Debug)]
pub struct TaskArguments {
    /// Task file
    pub task: PathBuf,
    /// Set a parameter; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Print every warning instead of one line per kind
    #[arg(long)]
    pub verbose: bool,
}

impl TaskArguments {
    /// The task, and its parameters as set.
    pub fn load(&self) -> Result<LoadedTask, Failure> {
        let mut loaded = LoadedTask::load(&self.task, &[])?;
        set(&mut loaded, &self.set)?;
        Ok(loaded)
    }

    /// Prints the task's warnings on standard error.
    pub fn warn(&self, loaded: &LoadedTask) {
        let problem = &loaded.problem;
        let warnings = if self.verbose { &problem.every_warning } else { &problem.warnings };
        warnings.iter().for_each(|warning| warn(warning));
    }
}

/// Sets parameters of a task by `NAME=VALUE`.
pub fn set(loaded: &mut LoadedTask, settings: &[String]) -> Result<(), Failure> {
    for setting in settings {
        let wrong = |what: &str| Failure::usage(format!("--set {setting}: {what}"));
        let (name, value) = setting.split_once('=').ok_or_else(|| wrong("write NAME=VALUE"))?;
        let value: f64 = value.trim().parse().map_err(|_| wrong("the value is not a number"))?;
        let set = loaded.problem.parameters.set(&mut loaded.phi, name.trim(), value);
        set.map_err(|error| wrong(&error.to_string()))?;
    }
    Ok(())
}

/// Where a result goes.
#[derive(Args, Debug)]
pub struct Output {
    /// Folder for the result, its trajectories, and everything needed to reproduce it
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct DesignOptions {
    #[command(flatten)]
    pub task: TaskArguments,
    /// Optimiser
    #[arg(long, value_enum)]
    pub method: Option<MethodArgument>,
    /// Gradient to use
    #[arg(long, value_enum)]
    pub gradient: Option<GradientArgument>,
    /// Information to minimise
    #[arg(long, value_enum)]
    pub information: Option<InformationArgument>,
    /// Number of starts: the initial values first, then seeded random values
    #[arg(long, value_name = "N", value_parser = count(1, 10_000))]
    pub starts: Option<usize>,
    /// Seed of all random numbers
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Closed-loop roll-outs at the first and at the best design; 0 for none [default: the value in the task file, or
    /// 256, or fewer with more than 32 states]
    #[arg(long, value_name = "N", value_parser = count(0, 10_000_000))]
    pub rollouts: Option<usize>,
    #[command(flatten)]
    pub output: Output,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum InformationArgument {
    /// The minimum that any sensors and any controller need to stay within the cost limit
    Needed,
    /// Information that the controller uses
    Used,
    /// Information in the measurements
    Measured,
}

impl InformationArgument {
    /// What counts.
    pub fn weights(self) -> InformationWeights {
        match self {
            Self::Needed => InformationWeights::NEEDED,
            Self::Used => InformationWeights::USED,
            Self::Measured => InformationWeights::MEASURED,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum MethodArgument {
    /// Sequential quadratic programming
    Sqp,
    /// Linear approximations without gradients
    Cobyla,
    /// The paper's barrier descent, with signs corrected
    Barrier,
}

impl From<MethodArgument> for Method {
    fn from(method: MethodArgument) -> Self {
        match method {
            MethodArgument::Sqp => Self::Sqp,
            MethodArgument::Cobyla => Self::Cobyla,
            MethodArgument::Barrier => Self::Barrier,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum GradientArgument {
    /// Plan, feedback and filter all vary with the parameters
    Total,
    /// Trajectory and gains are held fixed, as in the paper
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
    /// Closed-loop roll-outs with noise and an extended Kalman filter; 0 for none [default: the value in the task file,
    /// or 256, or fewer with more than 32 states]
    #[arg(long, value_name = "N", value_parser = count(0, 10_000_000))]
    pub rollouts: Option<usize>,
    /// Attempts to find a cheaper plan at another local minimum
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
    /// Plan, feedback and filter all vary with the parameters
    Total,
    /// Trajectory and gains are held fixed, as in the paper
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
They satisfy mass_matrix acceleration + bias = tau: the bias is Coriolis forces and gravity minus the forces of \
springs, dampers and friction in the joints. Friction is f v / sqrt(v^2 + 0.01^2), the default in robot models. \
`acceleration` is null, with a warning, if the mass matrix is singular. Frames are the links' frames in the world; \
rotation matrices are lists of rows. Warnings are reported on standard error.

Lists such as --q -0.5,1 are in the order of `joints`, which the tree also shows: the moving joints that do not \
follow another joint. Entries omitted at the end of a list are 0.";

#[derive(Args, Debug)]
#[command(after_long_help = DYNAMICS)]
pub struct RobotOptions {
    /// Robot file (URDF, SDF or MJCF), or a task file: its robot with everything that the task changes in it
    pub file: PathBuf,
    /// Let joints that follow others (mimic) move independently
    #[arg(long)]
    pub independent_mimic: bool,
    /// Folder with packages, searched for package://NAME/ and model://NAME/; may be repeated
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
    /// Gravity in the world frame, m/s^2 [default: 0,0,-9.81, regardless of the file; with --to, the file's]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub gravity: Option<String>,
    /// Write the robot as a file of another format: `mjcf`, which MuJoCo reads
    #[arg(long, value_enum, value_name = "FORMAT", conflicts_with_all = ["q", "v", "tau", "json"])]
    pub to: Option<RobotFormat>,
    /// File to write [default: standard output]
    #[arg(long, value_name = "PATH", requires = "to")]
    pub out: Option<PathBuf>,
    /// Print every warning instead of one line per kind
    #[arg(long)]
    pub verbose: bool,
    /// Print the dynamics as one JSON object and nothing else; without a state, at rest with every position at 0
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum ModelKind {
    /// Two masses and a wall
    TwoMass,
    /// A linear system in discrete time
    Linear,
    /// An arm of rigid bodies, with its robot file
    Robot,
}

/// What `--set` of `supple new` may name.
const NEW_NUMBERS: &str = "\
Numbers of templates for --set, in SI units: force (N), travel, clearance, tolerance, wall_sd and tip_sd (m), time (s), \
mass (kg) and stiffness (N/m) of the mount, force_sd (N), disturbance (rad/s in a second), margin of the cost limit. \
docs/choosing.md explains the rules of thumb by which they are chosen otherwise.

Options that are missing are asked for on a terminal.";

#[derive(Args, Debug)]
#[command(after_long_help = NEW_NUMBERS)]
pub struct NewOptions {
    /// Name of the task; the file is NAME.toml
    pub name: String,
    /// Kind of model [default: two_mass]
    #[arg(long, value_enum, conflicts_with_all = ["robot", "template"])]
    pub model: Option<ModelKind>,
    /// Robot file (URDF, SDF or MJCF); the task moves one of its limbs
    #[arg(long, value_name = "FILE")]
    pub robot: Option<PathBuf>,
    /// Folder with packages of the robot file; may be repeated
    #[arg(long = "package-root", value_name = "DIR", requires = "robot")]
    pub package_roots: Vec<PathBuf>,
    /// What the robot does, with a tool on a compliant mount [default: the limb reaches a point, without a mount]
    #[arg(long, value_enum, requires = "robot")]
    pub template: Option<Template>,
    /// Link or frame that the tool is mounted on [default: the one that looks most like it]
    #[arg(long, value_name = "NAME", requires = "template")]
    pub frame: Option<String>,
    /// Outward normal of the wall, such as +z or 0,-1,1 [default: that of the best posture]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, requires = "template")]
    pub wall: Option<String>,
    /// Where the tool starts, m in the world [default: the best posture]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, requires = "template")]
    pub at: Option<String>,
    /// Set a number of the template; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE", requires = "template")]
    pub set: Vec<String>,
}
