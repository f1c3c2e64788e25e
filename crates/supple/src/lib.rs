//! Design compliant robots that need little information to be controlled.
pub mod aims;
pub mod belief;
pub mod bound;
pub mod check;
mod contacts;
mod controller;
pub mod cost;
mod cost_parts;
mod dense;
pub mod design;
mod error;
mod evaluation;
mod feasibility;
pub mod file;
pub mod gradient;
pub mod information;
pub mod knots;
mod lenient;
mod limits;
mod linearisation;
mod model;
pub mod noise;
pub mod parameters;
pub mod pipeline;
pub mod plan;
mod price;
mod problem;
pub mod scene;
pub mod sensors;
mod shape;
pub mod simulate;
mod stability;
pub mod system;
mod trajectory;
mod value;

pub use contacts::{
    Contact, ContactReport, ContactState, NEGLIGIBLE_FORCE, WantedForce, contact_reports, contact_warnings,
    misses_contact,
};
pub use controller::{Controller, ControllerRun};
pub use cost_parts::{CostParts, cost_parts};
pub use error::Error;
pub use evaluation::{
    ControlInformation, ControllerReport, CostReport, EvaluateOptions, Evaluation, FrozenReport, GradientReport,
    InformationReport, MeasurementReport, Named, NeededInformation, Objective, TaskEvaluation, TotalReport,
    TrajectoryReport, Trust, VALID_STATIONARITY, Verdict, number_warnings, plan_warnings,
};
pub use feasibility::{FEASIBILITY, meets, violation};
pub use file::FileError;
pub use lenient::or_nan;
pub use limits::{LimitViolation, limits_violated};
pub use linearisation::{Linearisation, Rows};
pub use model::{
    Channel, Channels, Dimensions, Instruction, Limit, Limited, Linear, Model, OwnCost, Point, Recorded, RecordedParts,
    Tape, TapeError, TapeParts, TwoMass,
};
pub use price::{Price, PriceReport};
pub use problem::{Problem, Task};
pub use stability::{Stability, stability};
pub use supple_kernels::{Level, Matrices, Scalar, Scratch};
pub use trajectory::Trajectory;
pub use value::{Value, is_name, with_names};
