//! The kinds of model that task files name, and how they are read.
//!
//! ```text
//! bodies -> compliance -> kinds -> file -> linear, robot, two_mass -> library
//! equipment -> any ---------^           -> equipped
//! ```
//!
//! # A linear model
//!
//! ```
//! use supple_model::system::{Authored, System};
//! use supple_model::{Linear, Value};
//!
//! let row = |entries: &[f64]| entries.iter().map(|&entry| Value::Number(entry)).collect::<Vec<_>>();
//! let model = Linear {
//!     A: vec![row(&[1.0, 0.1]), row(&[0.0, 1.0])],
//!     B: vec![row(&[0.0]), row(&[0.1])],
//!     C: vec![row(&[1.0, 0.0])],
//! };
//! let mut next = [0.0; 2];
//! Authored::new(model, Vec::new(), 0.1, 0).step(0, &[0.0, 1.0], &[2.0], &[], &mut next);
//! assert!((next[0] - 0.1).abs() < 1e-12 && (next[1] - 1.2).abs() < 1e-12);
//! ```

mod any;
mod bodies;
mod compliance;
pub mod coupling;
mod equipment;
mod equipped;
mod file;
mod kinds;
mod library;
mod linear;
mod recorded;
mod robot;
mod start;
mod two_mass;

pub use any::AnyModel;
pub use equipment::{Entry, Equipment, Recalled};
pub use file::{ModelFile, PlainFile};
pub use kinds::{Kinds, Source};
pub use linear::Linear;
pub use recorded::{Instruction, Recorded, RecordedParts, Tape, TapeError, TapeParts};
pub use robot::Robot;
pub use start::{PoseFile, Start};
pub use two_mass::TwoMass;
