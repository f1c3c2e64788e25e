//! Design compliant robots that need little information to be controlled.
pub mod aims;
mod belief_plan;
pub mod bound;
mod branches;
mod channels;
pub mod check;
mod contacts;
mod continuation;
mod controller;
pub mod cost;
mod cost_parts;
pub mod design;
mod document;
mod elsewhere;
mod error;
mod evaluation;
mod feasibility;
pub mod file;
mod film;
pub mod followed;
pub mod gradient;
mod growth;
mod horizon;
mod knots;
mod lenient;
mod limits;
mod linearisation;
mod model;
pub mod noise;
pub mod parameters;
mod physics;
pub mod pipeline;
pub mod plan;
mod problem;
pub mod quantity;
mod sampled_plan;
pub mod scene;
pub mod sensors;
mod settings;
pub mod simulate;
mod stability;
pub mod system;
mod touching;
mod trajectory;
mod value;

pub use channels::{Channel, Channels, Limit, Limited};
pub use contacts::{Contact, ContactReport, ContactState, NEGLIGIBLE_FORCE, WantedForce};
pub use controller::{Controller, ControllerRun};
pub use cost_parts::{CostParts, cost_parts};
pub use document::FileError;
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
pub use lenient::or_nan;
pub use limits::{LimitViolation, limits_violated};
pub use linearisation::{Linearisation, Rows};
pub use model::{
    Instruction, Kinds, Linear, PlainFile, Recorded, RecordedParts, Tape, TapeError, TapeParts, TwoMass, coupling,
};
pub use parameters::{Named, Price, PriceReport};
pub use physics::{CENTER_OF_MASS, FRAME_SIGNALS, FileSensor, Model, OwnCost, POWER, Point, Sensed, frame_signals};
pub use plan::VALID_STATIONARITY;
pub use problem::{Problem, Task, check_rollouts, most_steps};
pub use settings::MOST_ROLLOUTS;
pub use stability::Stability;
pub use supple_kernels::{Level, Matrices, Scalar, Scratch, halt, math};
pub use supple_lqg as lqg;
pub use supple_lqg::Dimensions;
pub use supple_robot as robot;
pub use touching::{contact_reports, contact_warnings, misses_contact};
pub use trajectory::Trajectory;
pub use value::{Value, is_name, with_names};

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;
