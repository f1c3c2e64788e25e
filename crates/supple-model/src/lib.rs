//! Models of robots with named parameters.
//!
//! [`Model`] is what an author writes: sizes, the next state and the measurement, over any scalar.
//! [`Authored`](system::Authored) records that once, with its costs, and gives solvers a [`System`](system::System): values
//! and exact derivatives over batches of points.
//!
//! A [*quantity*](quantity) is something of the robot that has a name, a unit and a value at a state and control. With
//! noise it is a sensor, with targets, a [norm](cost::Norm) and weights a [`Cost`](cost::Cost), with bounds a limit, and
//! over time a curve: see [`followed`]. Every number of these is a [`Value`]: written out, a parameter, or an expression of
//! [`parameters`].
//!
//! [`Kinds`] holds all kinds of models, couplings, quantities and norms that task files may name, those of other crates too;
//! [`document`] reads their keys with errors that name file, line and key.
//!
//! Plans, gradients and designs are in the crate `supple`, task files in `supple-file`.
mod channels;
mod contacts;
pub mod cost;
pub mod document;
pub mod followed;
mod lenient;
pub mod limits;
pub mod model;
pub mod noise;
pub mod parameters;
pub mod physics;
pub mod quantity;
pub mod scene;
pub mod system;
mod trajectory;
pub mod value;

pub use channels::{Channel, Channels, Limit, Limited};
pub use contacts::{Contact, ContactReport, ContactState, NEGLIGIBLE_FORCE, WantedForce};
pub use document::FileError;
pub use lenient::or_nan;
pub use limits::{LimitViolation, limits_violated};
pub use model::{
    Instruction, Kinds, Linear, PlainFile, Recorded, RecordedParts, Tape, TapeError, TapeParts, TwoMass, coupling,
};
pub use parameters::{Named, Price, PriceReport};
pub use physics::{CENTER_OF_MASS, FRAME_SIGNALS, FileSensor, Model, OwnCost, POWER, Point, Sensed, frame_signals};
pub use supple_kernels::{Matrices, Scalar, Scratch};
pub use supple_lqg::Dimensions;
pub use trajectory::{Trajectory, time_of};
pub use value::{Names, Value, is_name};

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;
