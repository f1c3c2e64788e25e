//! Design: the least information at which every task meets its bound (theory, section D), or the least cost.
//!
//! A new optimiser is one file with a function from a `Search` to its `Ending`, and one line in [`Method`] and
//! `Search::run`.

mod aim;
mod barrier;
mod branches;
mod catalogue;
mod optimality;
mod result;
mod rounds;
mod search;
mod settings;
mod split;
mod sqp;
mod start;
mod visit;

pub use aim::Aim;
pub(crate) use branches::{best_of_guesses, search_branches, uniform};
pub use branches::{best_plan, plan_at};
pub use catalogue::{CatalogueDesign, CatalogueMethod, Combination};
pub use result::{Design, DesignStatus, StartSummary};
pub use search::{Control, Event, NoObserver, Observer};
pub(crate) use search::{Ending, Search};
pub use settings::{DesignSettings, GradientKind, Method, ROLLOUTS};
pub use split::Split;
pub use start::{Searcher, design};
