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
mod kept;
mod multipliers;
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

pub use crate::branches::{Attempts, cheapest_of, minima_at, plan_at};
pub use crate::candidates::best_plan;
pub use crate::settings::{DesignSettings, GradientKind, InformationWeights, Method, ROLLOUTS};
pub use aim::Aim;
pub use control::{Control, Event, NoObserver, Observer};
pub use entries::Units;
pub use kept::{KeepNone, KeptCombinations};
pub use outer::{Ending, Optimiser, OuterPoint, OuterProblem};
pub use result::{CatalogueDesign, CatalogueMethod, Combination, Design};
pub use searcher::Searcher;
pub use split::{Change, Split};
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
///
/// ```
/// use supple::design::{Control, DesignSettings, design};
/// # let task = r#"
/// #     model = { kind = "linear", A = [[1.0, 0.1], [0.1, 1.0]], B = [[0.0], [0.1]], C = [[1.0, 0.0]] }
/// #     parameters.variance = { initial = 1e-4, bounds = [1e-6, 1e-2], scale = "log", unit = "m^2" }
/// #     [[tasks]]
/// #     name = "balance"
/// #     steps = 50
/// #     time_step = 0.1
/// #     bound = 15.0
/// #     initial_state = [1.0, 0.0]
/// #     noise = { initial = [1e-2, 1e-2], process = [0.0, 1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0, 0.0], [0.0, 0.1]], R = [[0.1]] }]
/// # "#;
///
/// // The task of the front page.
/// let problem = supple_file::parse(task, "balance.toml")?;
/// let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
/// let settings = DesignSettings { starts: 1, ..problem.design.clone() };
/// let found = design(&problem, &phi, &settings, Control::default())?;
///
/// // A noisier sensor delivers less information, and the expected cost stays within its limit.
/// let best = found.found();
/// assert!(best.status.meets_bounds() && best.to[0] > phi[0]);
/// assert!(task.bound.is_some() && best.costs[0] <= 15.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn design(problem: &Problem, phi: &[f64], settings: &DesignSettings, control: Control) -> Result<Design, Error> {
    problem.check_design(phi)?;
    let searcher = Searcher::new(problem, settings, Aim::default(), control);
    searcher.choose(searcher.search(phi)?)
}
