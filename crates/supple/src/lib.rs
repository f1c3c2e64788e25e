//! Design compliant robots that need little information to be controlled.
pub mod belief;
mod cost_parts;
pub mod cost;
pub mod design;
mod error;
pub mod file;
pub mod gradient;
pub mod information;
pub mod knots;
mod model;
pub mod noise;
pub mod parameters;
pub mod pipeline;
pub mod plan;
mod problem;
pub mod system;
mod trajectory;
mod value;

pub use cost_parts::{CostParts, cost_parts};
pub use error::Error;
pub use file::FileError;
pub use problem::{Problem, Task};
pub use model::{Dimensions, Linear, Model, Point, TwoMass};
pub use supple_kernels::{Level, Matrices, Scalar, Scratch};
pub use trajectory::Trajectory;
pub use value::Value;
