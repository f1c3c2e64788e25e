//! Proofs of what is printed, that share nothing with the search: intervals with outward rounding, from the problem as
//! given and a point of the dual (theory, "Proof").
//!
//! Nothing here uses the rest of the library. The search, its reductions and its linear algebra may be wrong in any way;
//! then a bound is not proved, or a worse one is.

mod elimination;
mod filter;
mod frame;
mod given;
mod information;
mod interval;
mod law;
mod matrix;
mod payment;
mod quotient;
mod riccati;
mod steady;
mod steady_law;
mod wide;
mod wides;

pub(super) use filter::{Filtered, Sensor, over_horizon};
pub(super) use given::{Dual, DualStep, Given, Stage};
pub(super) use information::Proving;
pub(super) use interval::Interval;
pub(super) use law::{Along, AlongStep, law};
pub(super) use matrix::Matrix;
pub(super) use payment::steady_law_distance;
pub(super) use quotient::Quotient;
pub(super) use steady::steady;
pub(super) use steady_law::{SteadyLaw, Unsettled, steady_law};
