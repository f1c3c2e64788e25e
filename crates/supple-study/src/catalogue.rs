//! Choices from catalogues, as reports tell them.

use serde::{Deserialize, Serialize};
use supple::design::{CatalogueDesign, CatalogueMethod, Combination, Design, DesignStatus, Searcher};
use supple::{Named, Problem};

/// How many of the best combinations are reported.
const BEST: usize = 10;

/// The entries of catalogues that were chosen.
///
/// ```
/// use supple::design::DesignSettings;
/// use supple_study::design::run;
/// use supple_study::{LoadedTask, Source, Watch};
/// # let text = r#"
/// #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
/// #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0], catalogue = [1e-3, 1e-2, 1e-1] }
/// #     [[tasks]]
/// #     name = "hold"
/// #     steps = 20
/// #     time_step = 0.1
/// #     bound = 2.0
/// #     initial_state = [1.0]
/// #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
/// # "#;
/// # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
///
/// // The task of the front page with a cost limit of 2, and `catalogue = [1e-3, 1e-2, 1e-1]` for the variance.
/// let task = LoadedTask::restore(&[source])?;
/// let settings = DesignSettings { starts: 1, ..task.problem.design.clone() };
/// let report = run(&task, &settings, None, Watch::default())?;
/// let catalogue = report.catalogue.as_ref().ok_or("a parameter has a catalogue")?;
/// assert_eq!((catalogue.chosen[0].parameter.as_str(), catalogue.chosen[0].value), ("variance", 0.1));
/// assert!(catalogue.continuous.status.meets_bounds() && catalogue.best[0].status.meets_bounds());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CatalogueReport {
    /// How they were chosen.
    pub method: CatalogueMethod,
    /// How many combinations of entries there are.
    pub combinations: u64,
    /// How many of them were designed, or could not be.
    pub designed: usize,
    /// How many of them meet every bound.
    pub feasible: usize,
    /// How many could not be designed.
    pub failed: usize,
    /// Why the first of these could not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Whether the choice came to its end: all combinations were tried, or no neighbour of the chosen one is
    /// better, nor any that differs from it in one catalogue.
    pub complete: bool,
    /// The chosen entry of each catalogue.
    pub chosen: Vec<ChosenEntry>,
    /// What the chosen entries cost together, in the currency of the catalogues; `None` if an entry has no price.
    pub price: Option<f64>,
    /// The best design without catalogues.
    pub continuous: ContinuousOptimum,
    /// Bits by which the chosen design exceeds `continuous`, weighted prices included; `None` if either misses a limit, or
    /// if entries have prices that count, since `continuous` does not pay them.
    pub gap_bits: Option<f64>,
    /// The best combinations of entries, the chosen one first: at most 10.
    pub best: Vec<CombinationReport>,
}

/// An entry of a catalogue that was chosen.
///
/// Example: [`CatalogueReport`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ChosenEntry {
    /// The parameter.
    pub parameter: String,
    /// The value, in the unit of the parameter.
    pub value: f64,
    /// What its maker calls it.
    pub name: Option<String>,
    /// What it costs to buy.
    pub price: Option<f64>,
    /// The value of the best design without catalogues.
    pub continuous: f64,
}

/// The best design without catalogues.
///
/// Example: [`CatalogueReport`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ContinuousOptimum {
    /// How its search ended.
    pub status: DesignStatus,
    /// All parameters.
    pub parameters: Named,
    /// Its information, bits.
    #[serde(deserialize_with = "supple::or_nan")]
    pub information_bits: f64,
    /// Expected cost of each task.
    pub expected_costs: Vec<f64>,
    /// How far the worst task is above its bound, relative to it.
    #[serde(deserialize_with = "supple::or_nan")]
    pub violation: f64,
}

/// A combination of entries, with the other parameters optimised.
///
/// Example: [`CatalogueReport`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CombinationReport {
    /// How its search ended; where nothing but catalogues is designed, whether it meets every bound.
    pub status: DesignStatus,
    /// All parameters.
    pub parameters: Named,
    /// Its information, bits.
    #[serde(deserialize_with = "supple::or_nan")]
    pub information_bits: f64,
    /// How far the worst task is above its bound, relative to it.
    #[serde(deserialize_with = "supple::or_nan")]
    pub violation: f64,
}

impl CatalogueReport {
    /// How far the chosen design is from that without catalogues, as a sentence.
    pub fn distance(&self, number: impl Fn(f64) -> String) -> String {
        let free = self.continuous.information_bits;
        let more = self.best.first().map_or(f64::NAN, |chosen| chosen.information_bits - free);
        match self.gap_bits {
            Some(gap) if (gap - more).abs() <= 1e-9 * free.abs() => format!(
                "Without catalogues, the optimum has {} bits: {} less, {:.2} %.",
                number(free),
                number(gap),
                100.0 * gap / (free + gap).abs().max(1e-300)
            ),
            Some(gap) => format!(
                "Without catalogues, at {} bits, the sum of information and prices would be {} bits less.",
                number(free),
                number(gap)
            ),
            None if !self.continuous.status.meets_bounds() => {
                "Without catalogues, no design within all cost limits was found either.".to_owned()
            }
            None if self.chosen.iter().any(|entry| entry.price.is_some()) => {
                format!(
                    "Without catalogues, and without paying for their entries, the optimum has {} bits.",
                    number(free)
                )
            }
            None => format!("Without catalogues, the optimum has {} bits.", number(free)),
        }
    }

    /// Of a design, where it has catalogues.
    pub(crate) fn of(searcher: &Searcher, found: &Design) -> Option<Self> {
        let design = found.catalogue.as_ref()?;
        let problem = searcher.problem;
        let chosen = chosen(problem, design);
        let bits = |nats: f64| nats / std::f64::consts::LN_2;
        let named = |phi: &[f64]| Named::new(&problem.parameters, phi);
        let free = &design.continuous;
        let combination = |Combination { summary, .. }: &Combination| CombinationReport {
            status: summary.status,
            parameters: named(&summary.to),
            information_bits: bits(summary.information),
            violation: summary.violation,
        };
        Some(Self {
            method: design.method,
            combinations: design.combinations,
            designed: design.designed.len() + design.failed,
            feasible: design.feasible(searcher),
            failed: design.failed,
            error: design.first_error.as_ref().map(ToString::to_string),
            complete: design.complete,
            price: chosen.iter().map(|entry| entry.price).sum(),
            chosen,
            continuous: ContinuousOptimum {
                status: free.status,
                parameters: named(&free.to),
                information_bits: bits(free.information),
                expected_costs: free.costs.clone(),
                violation: free.violation,
            },
            gap_bits: design.gap(searcher).map(bits),
            best: design.designed.iter().take(BEST).map(combination).collect(),
        })
    }
}

fn chosen(problem: &Problem, design: &CatalogueDesign) -> Vec<ChosenEntry> {
    let places = problem.parameters.catalogued().into_iter();
    let entry = |(place, &entry): (usize, &usize)| {
        let parameter = problem.parameters.get(place);
        let entry = &parameter.catalogue[entry];
        ChosenEntry {
            parameter: parameter.name.clone(),
            value: entry.value,
            name: entry.name.clone(),
            price: entry.price,
            continuous: design.continuous.to[place],
        }
    };
    places.zip(&design.chosen().entries).map(entry).collect()
}
