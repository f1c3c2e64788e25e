//! Numbers, SIMD lanes and small dense kernels of supple.
//!
//! Everything here is independent of control and robotics:
//!
//! - [`Scalar`]: what the physics of a model is written over, once;
//! - [`Dual`]: forward derivatives with several tangents at once, nested for higher orders;
//! - [`graph`]: physics recorded once, differentiated, and compiled to programs for the lanes;
//! - [`halt`]: a request to stop long computations;
//! - [`math`]: elementary functions with the same bits on every machine;
//! - [`Lanes`]: eight numbers at once, and [`dispatch`] which picks the machine's best instructions at run time;
//! - [`Matrices`]: a sequence of equal matrices in one padded, aligned buffer, and the [`rows`] kernels on it;
//! - [`Band`]: symmetric block tridiagonal matrices, factored and solved;
//! - [`Scratch`]: memory that kernels reuse, so that sweeps allocate nothing.
//!
//! Operations and kernels are `#[inline(always)]`: a function that is not inlined under run-time dispatch falls back
//! to baseline instructions and runs tens of times slower. What is large and called from many places is a [`Job`] that
//! [`Lanes::apart`] runs: a function of its own that keeps the instructions.

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
pub use scalar::Scalar;
pub use scratch::Scratch;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;
