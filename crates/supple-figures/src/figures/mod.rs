//! Figures of results: one file per kind.

mod belief;
mod bound;
mod gains;
mod grouping;
mod information;
mod landscape;
mod motion;
mod overlay;
mod pareto;
mod results;
mod robustness;

pub use belief::belief;
pub use bound::bound;
pub use gains::gains;
pub use grouping::MOST_ENTRIES;
pub use information::information;
pub use landscape::landscape;
pub use motion::motion;
pub use pareto::pareto;
pub use robustness::robustness;

use supple_study::Folder;

use crate::{Figure, FigureError};

/// A kind of figure.
///
/// Example: the [front page](crate).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// Information and cost over parameters, with the paths of searches.
    Landscape,
    /// States over time: plan, truth, estimate.
    Belief,
    /// Feedback gains and feedforward over time.
    Gains,
    /// Costs as a noise grows.
    Robustness,
    /// Information against cost.
    Pareto,
    /// Information over time, by measurement.
    Information,
    /// The least information over the cost to keep.
    Bound,
    /// The robot at several times, with contact forces.
    Motion,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 8] = [
        Self::Landscape,
        Self::Belief,
        Self::Gains,
        Self::Robustness,
        Self::Pareto,
        Self::Information,
        Self::Bound,
        Self::Motion,
    ];

    /// Its name, also that of its file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Landscape => "landscape",
            Self::Belief => "belief",
            Self::Gains => "gains",
            Self::Robustness => "robustness",
            Self::Pareto => "pareto",
            Self::Information => "information",
            Self::Bound => "bound",
            Self::Motion => "motion",
        }
    }
}

/// A figure of results, of one task: the first one where none is named.
///
/// # Errors
/// Where the results are not those that the figure shows, or no task has the name.
///
/// Example: the [front page](crate).
pub fn draw(kind: Kind, folders: &[Folder], task: Option<&str>) -> Result<Figure, FigureError> {
    match kind {
        Kind::Landscape => landscape(folders, task),
        Kind::Belief => belief(folders, task),
        Kind::Gains => gains(folders, task),
        Kind::Robustness => robustness(folders, task),
        Kind::Pareto => pareto(folders, task),
        Kind::Information => information(folders, task),
        Kind::Bound => bound(folders, task),
        Kind::Motion => motion(folders, task),
    }
}
