//! Expressions as graphs: physics recorded once, differentiated, and compiled to straight-line programs for the lanes.
//!
//! ```text
//! record(|| physics over Node) -> vjp / tangent (more nodes) -> Program::compile -> run over a batch
//! ```
//!
//! A [`Node`] is a [`Scalar`](crate::Scalar) that records what is done to it. Equal expressions are one node, and what
//! constants determine is folded: a product with 0 is 0, so the structure of derivatives shows in the graph. Products
//! with 0 and quotients of 0 are 0 whatever the other factor is.

mod derive;
mod function;
mod instructions;
#[cfg(target_arch = "x86_64")]
mod native;
#[cfg(not(target_arch = "x86_64"))]
#[path = "not_native.rs"]
mod native;
mod node;
mod program;
mod repetition;
mod run;
mod schedule;

pub use derive::{depends, jacobian, tangent, vjp};
pub use function::{Function, call};
pub use node::{Node, record};
pub use program::{Program, Target};
pub use run::{Batch, OneByOne, Source};
