//! A quantity, a coupling, a norm, an optimiser and a model that the library has never heard of: one file each.

mod bearing;
mod cart_pole;
mod cauchy;
mod pattern_search;
mod tendon;

pub use bearing::Bearing;
pub use cart_pole::{CartPole, GRAVITY};
pub use cauchy::Cauchy;
pub use pattern_search::PatternSearch;
pub use tendon::Tendon;

use supple::Kinds;

/// The kinds of the library and those of this crate.
pub fn kinds() -> Kinds {
    Kinds::default().with_quantity::<Bearing>().with_coupling::<Tendon>().with_norm::<Cauchy>().with_model::<CartPole>()
}
