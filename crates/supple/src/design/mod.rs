//! Design: the least information at which every task meets its bound (theory, section D), or the least cost.
//!
//! A new optimiser takes one file with an [`Optimiser`], an entry of [`Method`] and a line in `searcher.rs`; an optimiser
//! of another crate is passed to [`Searcher::with_optimiser`].

mod aim;
mod barrier;
mod catalogue;
mod cobyla;
mod control;
mod entries;
mod exchange;
mod optimality;
mod outer;
mod result;
mod rounds;
mod search;
mod searcher;
mod split;
mod sqp;
mod start;
mod summary;
mod visit;
mod visited;

pub use crate::branches::{Attempts, best_plan, plan_at};
pub use crate::settings::{DesignSettings, GradientKind, InformationWeights, Method, ROLLOUTS};
pub use aim::Aim;
pub use control::{Control, Event, NoObserver, Observer};
pub use entries::Units;
pub use outer::{Ending, Optimiser, OuterPoint, OuterProblem};
pub use result::{CatalogueDesign, CatalogueMethod, Combination, Design};
pub use searcher::Searcher;
pub use split::Split;
pub use summary::{DesignStatus, StartSummary};

use crate::Error;
use crate::problem::Problem;

/// Searches for the design with the least information that meets every bound, from `phi` and from seeded random
/// starts, in parallel; then chooses from the catalogues that parameters have, see [`Searcher::choose`]. The result does not
/// depend on the number of threads.
///
/// # Errors
/// Where `phi` has the wrong length, not even the first start can be evaluated, or total gradients are asked for along
/// plans that have none.
pub fn design(problem: &Problem, phi: &[f64], settings: &DesignSettings, control: Control) -> Result<Design, Error> {
    problem.check_design(phi)?;
    let searcher = Searcher::new(problem, settings, Aim::default(), control);
    searcher.choose(searcher.search(phi)?)
}
