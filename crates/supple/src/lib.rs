//! Design compliant robots that need little information to be controlled: a [`Problem`] is a robot with open parameters and
//! tasks with cost limits, and [`design`](design::design) finds the parameters at which the controller receives the least
//! sensor information while every task stays within its limit.
//!
//! The crate builds on `supple-model`, the modelling types, and [`supple-lqg`](lqg), the sweeps over arrays; it
//! re-exports what its users need from both. Problems are built from values or read from task files by `supple-file`;
//! `supple-study` runs grids, fronts and robustness studies of them and stores the results.
//!
//! | stage | main items |
//! |---|---|
//! | the problem: robot, noise, costs, parameters | [`Problem`], [`Task`], [`Model`], [`cost::Cost`], [`parameters`], [`Kinds`] |
//! | an iLQG plan with its belief, information and cost, in one file | [`pipeline`], [`plan`] |
//! | one design, evaluated: information, cost, gradients, roll-outs | [`Problem::evaluate`], [`EvaluateOptions`], [`Evaluation`] |
//! | the search for the best design | [`design::design`], [`settings`] |
//! | the minimum information over all sensors and controllers; the choice of sensors | [`bound`], [`sensors`] |
//! | the controller of a design, one step at a time, and closed-loop roll-outs | [`Controller`], [`simulate`] |
//! | comparison of all derivatives with finite differences | [`check`] |
//!
//! # Three kinds of information
//!
//! ```
//! use supple::EvaluateOptions;
//!
//! // A mass of 1 kg on a hilltop, x'' = x + u, in steps of 0.1 s; its position is measured, its speed is not.
//! let task = r#"
//!     model = { kind = "linear", A = [[1.0, 0.1], [0.1, 1.0]], B = [[0.0], [0.1]], C = [[1.0, 0.0]] }
//!     parameters.variance = { initial = 1e-4, bounds = [1e-6, 1e-2], scale = "log", unit = "m^2" }
//!     [[tasks]]
//!     name = "balance"
//!     steps = 50
//!     time_step = 0.1
//!     bound = 15.0
//!     initial_state = [1.0, 0.0]
//!     noise = { initial = [1e-2, 1e-2], process = [0.0, 1e-3], measurement = ["variance"] }
//!     costs = [{ kind = "quadratic", Q = [[1.0, 0.0], [0.0, 0.1]], R = [[0.1]] }]
//! "#;
//! let problem = supple_file::parse(task, "balance.toml")?;
//! let options = EvaluateOptions { needed: true, ..Default::default() };
//! let found = problem.evaluate(&problem.parameters.initial(), &options)?;
//!
//! // The sensor measures more than the controller uses, which uses more than meeting the cost limit requires.
//! let information = &found.tasks[0].information;
//! let used = information.used.as_ref().map_or(f64::NAN, |used| used.total_bits);
//! let needed = information.needed.as_ref().map_or(f64::NAN, |needed| needed.total_bits);
//! assert!(found.feasible, "the expected cost, 11.9, is within the limit of 15");
//! assert!((information.total_bits - 33.3).abs() < 0.01);
//! assert!(needed < used && used < information.total_bits, "{needed} {used}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod aims;
mod belief_plan;
pub mod bound;
mod branches;
mod candidates;
pub mod check;
mod continuation;
mod controller;
pub mod design;
mod elsewhere;
mod error;
mod evaluation;
mod feasibility;
mod film;
pub mod gradient;
mod growth;
mod horizon;
mod knots;
mod limited;
mod linearisation;
pub mod pipeline;
pub mod plan;
mod problem;
mod sampled_plan;
pub mod sensors;
pub mod settings;
pub mod simulate;
mod stability;
mod stop;
mod touching;

pub use controller::{Controller, ControllerRun};
pub use elsewhere::{Elsewhere, Other, Runs};
pub use error::Error;
pub use evaluation::{
    ContactCurve, ControllerReport, CostCurve, CostReport, CostTerm, EvaluateOptions, Evaluation, FrozenReport,
    GradientReport, InformationReport, LimitReached, MeasurementReport, NeededInformation, Objective, PlanCheck,
    QuantityCurve, TargetReport, TaskEvaluation, TotalReport, TrajectoryReport, Trust, UsedInformation, Verdict,
    number_warnings, plan_warnings,
};
pub use feasibility::{FEASIBILITY, meets, violation};
pub use growth::stability;
pub use knots::Linearise;
pub use linearisation::{Linearisation, Rows};
pub use plan::VALID_STATIONARITY;
pub use problem::{CatalogueSensor, Problem, Task, check_branches, check_rollouts, most_steps};
pub use settings::MOST_ROLLOUTS;
pub use stability::Stability;
pub use stop::Stop;
pub use supple_kernels::{Level, Matrices, Scalar, Scratch, halt, math};
pub use supple_lqg as lqg;
pub use supple_lqg::{CostParts, Dimensions, cost_parts};
pub use supple_model::model::Robot as RobotModel;
pub use supple_model::{
    CENTER_OF_MASS, Channel, Channels, Contact, ContactReport, ContactState, Drive, EFFORT, FRAME_SIGNALS, FileError,
    FileSensor, Instruction, Kinds, Limit, LimitViolation, Limited, Linear, Model, NEGLIGIBLE_FORCE, Named, Names,
    OwnCost, POWER, ParameterHandle, PlainFile, Point, Price, PriceReport, Recorded, RecordedParts, Sensed, Tape,
    TapeError, TapeParts, Trajectory, TwoMass, Unfit, Value, ValueError, WantedForce, cost, coupling, followed,
    frame_signals, is_name, limits_violated, noise, or_nan, parameters, quantity, scene, system, time_of,
};
pub use supple_robot as robot;
pub use touching::{contact_reports, contact_warnings, misses_contact};

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;
