//! Arguments of `supple robot` and `supple new`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::template::Template;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RobotFormat {
    /// The format of MuJoCo
    Mjcf,
}

/// Help text on the dynamics printed by `supple robot`.
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
    /// Robot file (URDF, SDF or MJCF), or a task file, whose robot is shown with the task's changes
    pub file: PathBuf,
    /// Let mimic joints move independently
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
    /// Gravity in the world frame, m/s^2 [default: the file's, or 0,0,-9.81]
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

/// Help text on the numbers that `supple new --set` accepts.
const NEW_NUMBERS: &str = "\
Numbers of templates for --set, in SI units: force (N), travel, clearance, tolerance, wall_sd, smoothing and tip_sd (m), \
time (s), mass (kg), stiffness (N/m) and tolerable deflection (m) of the mount, force_sd (N), bandwidth of the joints (Hz), \
disturbance (rad/s after one second), margin of the cost limit (0 to 1: from the cost with the precise sensor to that with \
the coarsest). \
docs/choosing.md explains the rules of thumb used for the defaults.

On a terminal, missing options are prompted for.";

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
    /// Link or frame that the tool is mounted on, or that reaches the point [default: the most likely tool frame]
    #[arg(long, value_name = "NAME", requires = "robot")]
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
