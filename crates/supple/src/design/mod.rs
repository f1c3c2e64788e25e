//! Design: the least information at which every task meets its bound (theory, section D).
//!
//! A new optimiser is one file with a function from a `Search` to its `Ending`, and one line in [`Method`] and
//! `Search::run`.

mod barrier;
mod branches;
mod search;
mod settings;
mod sqp;
mod start;
mod visit;

pub use branches::best_plan;
pub(crate) use branches::{best_of_guesses, search_branches, uniform};
pub use search::{Control, Event, NoObserver, Observer};
pub(crate) use search::{Ending, Search};
pub use settings::{DesignSettings, GradientKind, Method};
pub use start::{Design, DesignStatus, StartSummary, design};
