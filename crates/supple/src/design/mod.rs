//! Design: the least information at which every task meets its bound (theory, section D), or the least cost.
//!
//! A new optimiser is one file with an [`Optimiser`], and one line in [`Method`] and `Searcher::optimiser`; one of another
//! crate's goes into [`Searcher::with_optimiser`].

mod aim;
mod barrier;
mod catalogue;
mod cobyla;
mod exchange;
mod optimality;
mod outer;
mod result;
mod rounds;
mod search;
mod split;
mod sqp;
mod start;
mod visit;
mod visited;

pub use crate::branches::{best_plan, plan_at};
pub use crate::settings::{DesignSettings, GradientKind, InformationWeights, Method, ROLLOUTS};
pub use aim::Aim;
pub use catalogue::{CatalogueDesign, CatalogueMethod, Combination};
pub use outer::{Ending, Optimiser, OuterPoint, OuterProblem, Units};
pub use result::{Design, DesignStatus, StartSummary};
pub(crate) use search::Search;
pub use search::{Control, Event, NoObserver, Observer};
pub use split::Split;
pub use start::{Searcher, design};
