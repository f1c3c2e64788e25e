//! Design compliant robots that need little information to be controlled.
pub mod aims;
mod belief_plan;
pub mod bound;
mod branches;
pub mod check;
mod continuation;
mod controller;
mod cost_parts;
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
mod linearisation;
pub mod pipeline;
pub mod plan;
mod problem;
mod sampled_plan;
pub mod sensors;
pub mod settings;
pub mod simulate;
mod stability;
mod touching;

pub use controller::{Controller, ControllerRun};
pub use cost_parts::{CostParts, cost_parts};
pub use elsewhere::{Elsewhere, Other, Runs};
pub use error::Error;
pub use evaluation::{
    ContactCurve, ControlInformation, ControllerReport, CostCurve, CostReport, EvaluateOptions, Evaluation,
    FrozenReport, GradientReport, InformationReport, LimitReached, MeasurementReport, NeededInformation, Objective,
    QuantityCurve, TaskEvaluation, TotalReport, TrajectoryReport, Trust, Verdict, number_warnings, plan_warnings,
};
pub use feasibility::{FEASIBILITY, meets, violation};
pub use growth::stability;
pub use knots::Linearise;
pub use linearisation::{Linearisation, Rows};
pub use plan::VALID_STATIONARITY;
pub use problem::{CatalogueSensor, Problem, Task, TaskNumbers, check_rollouts, most_steps};
pub use settings::MOST_ROLLOUTS;
pub use stability::Stability;
pub use supple_kernels::{Level, Matrices, Scalar, Scratch, halt, math};
pub use supple_lqg as lqg;
pub use supple_lqg::Dimensions;
pub use supple_model::{
    CENTER_OF_MASS, Channel, Channels, Contact, ContactReport, ContactState, FRAME_SIGNALS, FileError, FileSensor,
    Instruction, Kinds, Limit, LimitViolation, Limited, Linear, Model, NEGLIGIBLE_FORCE, Named, Names, OwnCost, POWER,
    PlainFile, Point, Price, PriceReport, Recorded, RecordedParts, Sensed, Tape, TapeError, TapeParts, Trajectory,
    TwoMass, Value, WantedForce, cost, coupling, followed, frame_signals, is_name, limits_violated, noise, or_nan,
    parameters, quantity, scene, system, time_of,
};
pub use supple_robot as robot;
pub use touching::{contact_reports, contact_warnings, misses_contact};

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;
