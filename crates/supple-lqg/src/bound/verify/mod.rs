//! Proofs of the printed bounds that share no code with the search: interval arithmetic with outward rounding, starting
//! from the problem as given and a dual point (theory, "Proof").
//!
//! Nothing here uses the rest of the library. If the search, its reductions or its linear algebra are wrong,
//! a bound is not proved, or a weaker one is.

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
