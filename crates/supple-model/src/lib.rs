//! Models of robots with named parameters: physics, quantities, costs and noise are written once, over any [`Scalar`], and
//! recorded; solvers receive values and exact derivatives of every order they need. Models are written as one `impl`, or
//! read from task files, where any number can be a parameter or an expression of parameters.
//!
//! The crate builds on `supple-kernels` (recorded graphs), [`supple-lqg`](supple_lqg) (arrays along a trajectory) and
//! `supple-robot` (rigid bodies from URDF, SDF and MJCF). Plans, gradients and designs of its models are in the crate
//! `supple`, task files in `supple-file`.
//!
//! | what | main items |
//! |---|---|
//! | the physics that an author writes: sizes, next state, measurement | [`Model`], [`Point`] |
//! | what solvers call: values and derivatives over batches of points | [`System`](system::System), [`Authored`](system::Authored), [`Arrays`](system::Arrays) |
//! | a number, a parameter or an expression in its place | [`Value`], [`Names`], [`Parameters`](parameters::Parameters) |
//! | quantities: with noise a sensor, with a target a cost, with bounds a limit, over time a curve | [`quantity`], [`cost::Cost`], [`followed`] |
//! | covariances of initial state, process and measurement | [`NoiseModel`](noise::NoiseModel), [`Covariance`](noise::Covariance) |
//! | built-in models, and compliance elements of robots | [`TwoMass`], [`Linear`], [`Robot`](model::Robot), [`coupling`] |
//! | all kinds that task files may name, including those of other crates | [`Kinds`] |
//! | parsed files with errors that name file, line and key | [`Document`](document::Document), [`FileError`] |
//!
//! # A model and its parameters
//!
//! ```
//! use supple_model::system::{Authored, System};
//! use supple_model::{Names, TwoMass};
//!
//! // Masses of 1 kg and 2 kg; the spring between them, N/m, is a parameter, and the wall is half as stiff.
//! let names = Names::new(vec!["k".to_owned()]);
//! let model = TwoMass {
//!     mass: [1.0.into(), 2.0.into()],
//!     damping: [0.0.into(), 0.0.into()],
//!     stiffness: [names.value("k")?, names.value("k / 2")?],
//!     contact_smoothing: 0.0.into(),
//! };
//! assert_eq!(model.stiffness[1].resolve(&[300.0]), 150.0);
//!
//! // One explicit step of 0.1 s with k = 10 N/m from x = [x1, v1, x2, v2, wall], under a force u of 3 N.
//! let system = Authored::new(model, Vec::new(), 0.1, 1);
//! let (x, u, phi) = ([0.5, 0.0, 0.0, 0.0, 1.0], [3.0], [10.0]);
//! let mut next = [0.0; 5];
//! system.step(0, &x, &u, &phi, &mut next);
//! assert_eq!(next, [0.5, -0.2, 0.0, 0.25, 1.0]);
//! # Ok::<(), supple_model::ValueError>(())
//! ```

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

pub use channels::{Channel, Channels, Drive, Limit, Limited};
pub use contacts::{Contact, ContactReport, ContactState, NEGLIGIBLE_FORCE, WantedDepth, WantedForce};
pub use document::{FileError, Unfit};
pub use lenient::or_nan;
pub use limits::{LimitViolation, limits_violated};
pub use model::{
    Instruction, Kinds, Linear, PlainFile, Recorded, RecordedParts, Tape, TapeError, TapeParts, TwoMass, coupling,
};
pub use parameters::{Named, Price, PriceReport};
pub use physics::{
    CENTER_OF_MASS, EFFORT, FRAME_SIGNALS, FileSensor, Model, OwnCost, POWER, Point, Sensed, frame_signals,
};
pub use supple_kernels::{Matrices, Scalar, Scratch};
pub use supple_lqg::Dimensions;
pub use trajectory::{Trajectory, time_of};
pub use value::{Names, ParameterHandle, Value, ValueError, is_name};

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;
