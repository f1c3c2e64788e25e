//! Time-varying LQG over arrays: Riccati and Kalman sweeps, directed information, adjoints of all of them,
//! certified lower bounds of the information that a task needs, and the choice of sensors.
//!
//! The crate has no notion of models, parameters or files. Its input is [`Knots`]: a system along a trajectory as `A_t`,
//! `B_t`, `C_t` and the second-order expansion of its cost, and [`Noise`] as covariance matrices. Everything else is a
//! sweep over these arrays:
//!
//! | question | function |
//! |---|---|
//! | Which feedback is optimal, and what is the cost of state uncertainty? | [`solve_riccati`] |
//! | What does a Kalman filter know at each step? | [`kalman`] |
//! | How much information do the measurements deliver, `DI(x -> y)`? | [`information()`] |
//! | How much of it does the controller use, `DI(x -> u)`? | [`control_information`] |
//! | What does each kind of noise cost? | [`cost_parts`] |
//! | What is the minimum over all sensors and controllers? | [`bound::minimum_information`] |
//! | Which sensors are worth their price? | [`sensors::Selection`] |
//! | Which feedback if large costs count more? | [`risk::solve`] |
//! | What are their gradients with respect to all arrays? | [`reverse_kalman`], [`reverse_riccati`],
//! [`add_control_partials`], [`bound::Sensitivity`] |
//!
//! # A Kalman filter and its information
//!
//! ```
//! use supple_lqg::{Belief, Information, Knots, LinearQuadratic, Noise, constant, information, kalman};
//!
//! // A frictionless mass under random disturbances, with position measurements every 0.1 s.
//! let (a, b, c) = ([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]], [[1.0, 0.0]]);
//! let plant = LinearQuadratic { a: &a, b: &b, c: &c, q: &[[1.0, 0.0], [0.0, 0.1]], r: &[[0.01]] };
//! let knots = Knots::linear(100, plant)?;
//! let noise = Noise {
//!     initial: constant(&[[0.01, 0.0], [0.0, 0.01]]),
//!     process: constant(&[[1e-6, 0.0], [0.0, 1e-4]]),
//!     measurement: constant(&[[1e-4]]),
//! };
//! let (mut belief, mut measured) = (Belief::zeros(2, 1, 100), Information::default());
//! kalman(&knots, &noise, &mut belief)?;
//! information(&belief, &noise, &mut measured)?;
//! let bits = measured.total / std::f64::consts::LN_2;
//! assert!((bits - 38.63).abs() < 0.01);
//! # Ok::<(), supple_lqg::Error>(())
//! ```
//!
//! # The minimum information of a plant
//!
//! ```
//! use supple_lqg::bound::{BoundSettings, Stationary, stationary_minimum};
//! use supple_lqg::constant;
//!
//! // x+ = 1.5 x + u + w, w of variance 1, with the cost x^2 / 2 per step.
//! let plant = Stationary::new(&constant(&[[1.5, 1.0]]), &constant(&[[1.0]]), &constant(&[[1.0, 0.0], [0.0, 0.0]]))?;
//! let found = stationary_minimum(&plant, 2.0, &BoundSettings::default())?;
//! // The prior variance is 4 and the posterior variance must be 4/3: log2 sqrt(4 / (4/3)) bits.
//! assert!((found.nats - 0.5 * 3f64.ln()).abs() < 1e-6);
//! assert!(found.lower_nats <= found.nats, "proved by intervals");
//! # Ok::<(), supple_lqg::Error>(())
//! ```
//!
//! Equations are cited by their numbers in the theory, `docs/theory` of the repository.

mod arrays;
pub mod belief;
pub mod bound;
mod carried;
mod cost;
#[doc(hidden)]
pub mod dense;
mod error;
mod given;
mod information;
mod knots;
mod noise;
mod partials;
mod recursion;
mod riccati;
mod riccati_adjoint;
pub mod risk;
mod semidefinite;
pub mod sensors;
mod shape;
mod transport;

pub use arrays::{Entries, FromEntries, constant, matrix, sequence};
pub use belief::{
    Belief, BeliefAdjoint, BeliefSeeds, Innovation, InnovationCovariance, SampleNoise, correct_each, kalman,
    predict_each, reverse_kalman, solve_column,
};
pub use bound::Horizon;
pub use cost::{CostParts, cost_parts, noise_cost};
pub use error::Error;
pub use information::{Information, add_control_partials, control_information, entropy_form, information, paper_form};
pub use knots::{Dimensions, KnotAdjoints, Knots, LinearQuadratic, TimeVarying};
pub use noise::Noise;
pub use partials::Partials;
pub use recursion::{recursion_radius, spectral_radius};
pub use riccati::{
    ControlBounds, Decrease, Limits, Lq, Policy, Regularisation, Rooted, least_cost_rounding, solve_limited, solve_lq,
    solve_riccati,
};
pub use riccati_adjoint::{RiccatiAdjoint, RiccatiSeeds, reverse_riccati};
pub use semidefinite::{mend, refuse_indefinite, semidefinite_factor};
pub use supple_kernels::Matrices;

// The example of the README runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
