//! Gradients of directed information and expected cost by adjoints (theory, section G).

mod frozen;
mod kept;
mod slope;
mod total;
mod workspace;

pub use frozen::{FrozenGradient, frozen_gradient};
pub(crate) use slope::{Quantity, slope_by_controls};
pub(crate) use total::information_at_rest;
pub use total::{Functional, Planned, total_gradient};
pub use workspace::GradientWorkspace;
