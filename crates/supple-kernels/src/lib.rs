//! Numbers, SIMD lanes and small dense kernels, independent of control and robotics. Functions are written once over any
//! [`Scalar`]; recorded as a graph, they are differentiated exactly and run for eight points at once, with the same bits
//! whatever the number of threads.
//!
//! The crate is the lowest layer of supple and depends on no other: `supple-lqg` sweeps over its [`Matrices`], and
//! `supple-model` records physics with its [`graph`].
//!
//! | what | main items |
//! |---|---|
//! | the number type over which functions are written | [`Scalar`], [`math`] with the same bits on every machine |
//! | expressions, recorded, differentiated and compiled | [`graph`]: [`Node`](graph::Node), [`jacobian`](graph::jacobian), [`Program`](graph::Program) |
//! | forward derivatives along several directions, nested for higher orders | [`Dual`] |
//! | eight numbers at once, with the best instructions of the machine | [`Lanes`], [`dispatch`](dispatch()), [`Job`] |
//! | a sequence of equal-sized matrices in one padded, aligned buffer | [`Matrices`], [`rows`] |
//! | symmetric block tridiagonal matrices; solves over any scalar | [`Band`], [`Ldl`] |
//! | memory that sweeps reuse; the request to stop | [`Scratch`], [`halt`] |
//!
//! # Record, differentiate, run
//!
//! ```
//! use supple_kernels::graph::{Node, Program, Target, jacobian, record};
//! use supple_kernels::{LANES, Scalar};
//!
//! /// The torque of a pendulum with a spring at its joint, N m: written once, for numbers, duals and nodes.
//! fn torque<S: Scalar>(angle: S, stiffness: S) -> S {
//!     angle.sin() * 9.81 + stiffness * angle
//! }
//!
//! // The angle, rad, is entry 0 of source 0; the stiffness, N m/rad, is parameter 0. Sink 0 receives torque and slope.
//! let program = record(|| {
//!     let angle = Node::entry(0, 0);
//!     let value = torque(angle, Node::parameter(0));
//!     let slope = jacobian(&[value], &[angle])[0][0];
//!     Program::compile(&[(value, Target::Set { sink: 0, offset: 0 }), (slope, Target::Set { sink: 0, offset: 1 })])
//! });
//! let mut found = [0.0; LANES];
//! program.run_single(&[&[0.3; LANES]], &[20.0], &mut [&mut found]);
//! assert!((found[0] - torque(0.3, 20.0)).abs() < 1e-12);
//! assert!((found[1] - (9.81 * 0.3_f64.cos() + 20.0)).abs() < 1e-12);
//! ```
//!
//! # Inlining
//!
//! Operations and kernels are `#[inline(always)]`: a function that is not inlined under run-time dispatch falls back to
//! baseline instructions and runs tens of times slower. Large code that is called from many places is a [`Job`] that
//! [`Lanes::apart`] runs: a separate function that keeps the instructions.

mod band;
mod dispatch;
mod dual;
mod fused;
pub mod graph;
pub mod halt;
mod lanes;
mod ldl;
pub mod math;
mod matrices;
mod pair;
mod real;
pub mod rows;
mod scalar;
mod scratch;

pub use band::{Band, BandRow, RIGHT_SIDES};
pub use dispatch::{Level, dispatch, dispatch_portable};
pub use dual::Dual;
pub use lanes::{Job, LANES, Lanes};
pub use ldl::Ldl;
pub use matrices::{Matrices, padded};
pub use scalar::{Scalar, Single};
pub use scratch::Scratch;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;
