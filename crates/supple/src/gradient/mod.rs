//! Gradients of directed information and expected cost by adjoints (theory, section G).

mod frozen;
mod recursion;
mod riccati_adjoint;
mod total;

pub use frozen::{FrozenGradient, frozen_gradient};
pub use recursion::recursion_radius;
pub(crate) use recursion::spectral_radius;
pub(crate) use riccati_adjoint::reverse_riccati;
pub use total::{Functional, GradientWorkspace, TotalGradient, total_gradient};
