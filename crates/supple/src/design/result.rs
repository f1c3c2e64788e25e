//! Results of a design search.

use serde::{Deserialize, Serialize};

use super::{DesignStatus, StartSummary};
use crate::Error;

/// The result of a design search.
///
/// Example: [`design`](crate::design::design()).
#[derive(Clone, Debug)]
pub struct Design {
    /// How it ended: at its best start, or at the entries that were chosen.
    pub status: DesignStatus,
    /// The index of the best start.
    pub best: usize,
    /// Every start that was run, in order. Starts ignore catalogues.
    pub starts: Vec<StartSummary>,
    /// The choice from catalogues, where parameters have any.
    pub catalogue: Option<CatalogueDesign>,
    /// Designs evaluated, over all starts and combinations.
    pub evaluations: usize,
    /// Of these, how many have a plan that never makes a contact whose force a cost tracks.
    pub without_contact: usize,
    /// Wall time, s.
    pub seconds: f64,
}

impl Design {
    /// Whether the design that was found meets every bound and the budget, with plans that converged; also where the search was
    /// stopped.
    #[must_use]
    pub fn meets_bounds(&self) -> bool {
        self.found().status.meets_bounds()
    }

    /// The design that was found; parameters with catalogues have catalogue values.
    #[must_use]
    pub fn found(&self) -> &StartSummary {
        self.catalogue.as_ref().map_or(&self.starts[self.best], |catalogue| &catalogue.chosen().summary)
    }
}

/// How the entries of catalogues were chosen.
///
/// Example: [`CatalogueDesign`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CatalogueMethod {
    /// All combinations of entries were designed, and the best was taken.
    AllCombinations,
    /// The design without catalogues was rounded, then replaced by better combinations of neighbouring entries for as long
    /// as there were any.
    Neighbourhood,
}

/// One entry of each catalogue, and the design with these values.
///
/// Example: [`CatalogueDesign`].
#[derive(Clone, Debug)]
pub struct Combination {
    /// Places of the entries in the catalogues, in the order of
    /// [`catalogued`](supple_model::parameters::Parameters::catalogued).
    pub entries: Vec<usize>,
    /// The design: the other parameters optimised, on the cheapest branches found.
    pub summary: StartSummary,
}

/// A choice from catalogues.
///
/// ```
/// use supple::design::{CatalogueMethod, Control, DesignSettings, design};
/// # let task = r#"
/// #     model = { kind = "linear", A = [[1.0, 0.1], [0.1, 1.0]], B = [[0.0], [0.1]], C = [[1.0, 0.0]] }
/// #     parameters.variance = { initial = 1e-4, bounds = [1e-6, 1e-2], catalogue = [1e-4, 1e-3, 1e-2] }
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
/// // The task of the front page with `catalogue = [1e-4, 1e-3, 1e-2]` for the variance.
/// let problem = supple_file::parse(task, "balance.toml")?;
/// let settings = DesignSettings { starts: 1, ..problem.design.clone() };
/// let found = design(&problem, &problem.parameters.initial(), &settings, Control::default())?;
/// let catalogue = found.catalogue.as_ref().ok_or("a parameter has a catalogue")?;
/// assert_eq!((catalogue.method, catalogue.combinations), (CatalogueMethod::AllCombinations, 3));
/// assert_eq!((&catalogue.chosen().entries[..], catalogue.chosen().summary.to[0]), (&[2][..], 1e-2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct CatalogueDesign {
    /// How the entries were chosen.
    pub method: CatalogueMethod,
    /// Number of combinations; saturates at the largest `u64`.
    pub combinations: u64,
    /// Whether the choice was completed: all combinations designed, or no neighbour better. It is incomplete if it was
    /// stopped or would have needed more combinations than allowed.
    pub complete: bool,
    /// The combinations that were designed, the best first. At least one.
    pub designed: Vec<Combination>,
    /// How many combinations could not be designed.
    pub failed: usize,
    /// Why the first of them could not.
    pub first_error: Option<Error>,
    /// The best design without catalogues: of the starts, or found from the chosen entries where these were better.
    pub continuous: StartSummary,
}

impl CatalogueDesign {
    /// The best combination.
    #[must_use]
    pub fn chosen(&self) -> &Combination {
        &self.designed[0]
    }
}
