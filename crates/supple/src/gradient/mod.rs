//! Gradients of directed information and expected cost by adjoints (theory, section G).

mod frozen;
mod implicit;
mod partials;
mod recursion;
mod riccati_adjoint;
mod slope;
mod total;

pub use frozen::{FrozenGradient, frozen_gradient};
pub(crate) use implicit::belief_plan_gradient;
pub use partials::Partials;
pub(crate) use partials::add_dense;
pub use recursion::recursion_radius;
pub(crate) use recursion::spectral_radius;
pub(crate) use riccati_adjoint::reverse_riccati;
pub(crate) use slope::{Quantity, Steepness, slope_by_controls};
pub(crate) use total::information_at_rest;
pub use total::{Functional, GradientWorkspace, TotalGradient, total_gradient};
