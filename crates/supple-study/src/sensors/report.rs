use serde::{Deserialize, Serialize};
use supple::sensors::{Candidate, Chosen, Goal, Relaxation, Rule, Selection, Worth};
use supple::{Named, PlanCheck};

use super::options::SensorsOptions;

/// Bits of a nat.
const BITS: f64 = 1.0 / std::f64::consts::LN_2;

/// A study of sensors.
///
/// Example: the [module](crate::sensors).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Sensors {
    /// What was asked for.
    pub options: SensorsOptions,
    /// All parameters.
    pub parameters: Named,
    /// The tasks that were looked at. Costs are sums over them; information is the sum with the tasks' weights, if there are
    /// several.
    pub tasks: Vec<String>,
    /// Whether there is a catalogue; otherwise the candidates are the task's own measurements.
    pub catalogue: bool,
    /// With no candidate, but the measurements that are always there.
    pub none: SensorSet,
    /// With all candidates, whatever the limits.
    pub all: SensorSet,
    /// The greedy set; `None` if it reaches no bound on the cost.
    pub greedy: Option<SensorSet>,
    /// The best set that a search of all found; `None` if it was not asked for.
    pub best: Option<SensorSet>,
    /// The better of the two.
    pub chosen: SensorSet,
    /// How good any set could be.
    pub certificate: Certificate,
    /// Every candidate, in order.
    pub sensors: Vec<SensorValue>,
    /// What speaks against the plans, which are made with all candidates.
    #[serde(default)]
    pub plans: Vec<PlanCheck>,
    /// Which measurements are one candidate, and why; where the plan depends on the sensors; and a budget without prices.
    #[serde(default)]
    pub remarks: Vec<String>,
}

/// A set of sensors.
///
/// Example: the [module](crate::sensors).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SensorSet {
    /// Names, in the order in which they were taken.
    pub sensors: Vec<String>,
    /// Expected cost.
    pub expected_cost: f64,
    /// Directed information, bits.
    pub information_bits: f64,
    /// Prices of all together.
    pub price: f64,
    /// How it came about.
    pub by: SetBy,
}

/// How a set of sensors came about.
///
/// Example: the [module](crate::sensors).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SetBy {
    /// It was not searched for.
    Given,
    /// Greedily, by gain.
    Gain,
    /// Greedily, by gain per unit of price.
    GainPerPrice,
    /// By a search of all sets.
    Search,
}

/// How all sets were searched.
///
/// Example: the [module](crate::sensors).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Search {
    /// One by one.
    Exhaustive,
    /// By branch and bound.
    BranchAndBound,
}

/// How good any set within the limits could be. Bounds are in units of the goal: expected cost from below, bits from
/// above, or price from below.
///
/// Example: the [module](crate::sensors).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// No set does better, by the relaxed problem alone.
    #[serde(deserialize_with = "supple::or_nan")]
    pub bound: f64,
    /// Certified lower bound on the greedy set's share of the best possible gain over no candidate; for prices, the bound
    /// divided by its price. `None` without a greedy set.
    pub certified_ratio: Option<f64>,
    /// How all sets were searched; `None` if they were not.
    pub search: Option<Search>,
    /// No set does better, by the search.
    pub searched_bound: Option<f64>,
    /// Whether the search proved its set to be the best one.
    pub proved: bool,
    /// The greedy set's share of the best gain that the search leaves possible: exact if the search proved its set optimal.
    pub ratio: Option<f64>,
    /// Sets that were tried, or regions.
    pub tried: usize,
}

/// What one sensor is worth.
///
/// Example: the [module](crate::sensors).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SensorValue {
    /// Its name.
    pub name: String,
    /// What kind it is.
    pub kind: String,
    /// Its price.
    pub price: f64,
    /// Whether it is in the chosen set.
    pub chosen: bool,
    /// Expected cost that it saves as the only candidate.
    pub saved_alone: f64,
    /// Expected cost that it saves where all other candidates are there.
    pub saved_beyond_others: f64,
    /// Expected cost that it saves, or would save, in the chosen set.
    pub saved_in_set: f64,
    /// Bits that it gives as the only candidate.
    pub bits_alone: f64,
    /// Bits that it gives beyond all other candidates.
    pub bits_beyond_others: f64,
    /// Expected cost that it saves alone, per unit of price; none without a price.
    pub saved_alone_per_price: Option<f64>,
    /// Its weight in the relaxed problem where the certificate was found, 0 to 1.
    pub weight: f64,
}

/// What a search of all sets found.
pub(super) struct Searched {
    pub chosen: Chosen,
    pub kind: Search,
    /// In units of the goal.
    pub bound: f64,
    pub proved: bool,
}

impl SetBy {
    pub(super) fn of(rule: Option<Rule>) -> Self {
        match rule {
            Some(Rule::Gain) => Self::Gain,
            Some(Rule::GainPerPrice) => Self::GainPerPrice,
            None => Self::Search,
        }
    }
}

impl SensorSet {
    pub(super) fn of(selection: &Selection, sensors: &[usize], by: SetBy) -> Self {
        let worth = worth_of(selection, sensors);
        Self {
            sensors: sensors.iter().map(|&one| selection.candidates[one].name.clone()).collect(),
            expected_cost: worth.cost,
            information_bits: worth.information * BITS,
            price: selection.price(sensors),
            by,
        }
    }
}

impl Certificate {
    pub(super) fn of(
        goal: Goal,
        none: Worth,
        greedy: Option<&Chosen>,
        relaxed: &Relaxation,
        searched: Option<&Searched>,
    ) -> Self {
        // An unfinished search may have a weaker bound than the relaxed problem.
        let of_search = searched.map(|found| match goal {
            Goal::MostInformation => found.bound.min(relaxed.bound),
            _ => found.bound.max(relaxed.bound),
        });
        let of_search = searched.zip(of_search).map(|(found, bound)| if found.proved { found.bound } else { bound });
        let unit = if goal == Goal::MostInformation { BITS } else { 1.0 };
        Self {
            bound: relaxed.bound * unit,
            certified_ratio: greedy.map(|greedy| ratio(goal, none, greedy, relaxed.bound)),
            search: searched.map(|found| found.kind),
            searched_bound: of_search.map(|bound| bound * unit),
            proved: searched.is_some_and(|found| found.proved),
            ratio: greedy.zip(of_search).map(|(greedy, bound)| ratio(goal, none, greedy, bound)),
            tried: searched.map_or(0, |found| found.chosen.tried) + greedy.map_or(0, |greedy| greedy.tried),
        }
    }
}

/// Expected cost, information in nats, or price of a set, by the goal.
pub(super) fn value_of(goal: Goal, chosen: &Chosen) -> f64 {
    match goal {
        Goal::LeastCost => chosen.worth.cost,
        Goal::MostInformation => chosen.worth.information,
        Goal::LeastPrice { .. } => chosen.price,
    }
}

/// What a set gains over no candidate at all: cost saved, or nats.
fn gain(goal: Goal, none: Worth, worth: Worth) -> f64 {
    match goal {
        Goal::MostInformation => worth.information - none.information,
        _ => none.cost - worth.cost,
    }
}

/// The share of the best possible gain that a set has, where `bound` bounds the goal.
fn ratio(goal: Goal, none: Worth, chosen: &Chosen, bound: f64) -> f64 {
    let (of_set, most) = match goal {
        Goal::LeastPrice { .. } => (bound, value_of(goal, chosen)),
        Goal::LeastCost => (gain(goal, none, chosen.worth), none.cost - bound),
        Goal::MostInformation => (gain(goal, none, chosen.worth), bound - none.information),
    };
    // If there is nothing to gain beyond rounding, or nothing to pay, the set is optimal.
    let rounding = match goal {
        Goal::LeastPrice { .. } => 0.0,
        Goal::LeastCost => 1e-9 * none.cost.abs(),
        Goal::MostInformation => 1e-9 * (1.0 + none.information),
    };
    if most > rounding { (of_set / most).clamp(0.0, 1.0) } else { 1.0 }
}

fn worth_of(selection: &Selection, sensors: &[usize]) -> Worth {
    let mut there = vec![false; selection.candidates.len()];
    sensors.iter().for_each(|&one| there[one] = true);
    selection.worth(&there)
}

/// What every candidate is worth.
pub(super) fn values(selection: &Selection, kinds: &[String], chosen: &[usize], weights: &[f64]) -> Vec<SensorValue> {
    let all: Vec<usize> = (0..selection.candidates.len()).collect();
    let (of_none, of_all) = (worth_of(selection, &[]), worth_of(selection, &all));
    let without = |set: &[usize], one: usize| -> Vec<usize> { set.iter().copied().filter(|&i| i != one).collect() };
    let value = |one: usize| {
        let candidate = &selection.candidates[one];
        let alone = worth_of(selection, &[one]);
        let rest = worth_of(selection, &without(&all, one));
        let set = without(chosen, one);
        let with: Vec<usize> = set.iter().copied().chain([one]).collect();
        let saved_alone = of_none.cost - alone.cost;
        SensorValue {
            name: candidate.name.clone(),
            kind: kinds[one].clone(),
            price: candidate.price,
            chosen: chosen.contains(&one),
            saved_alone,
            saved_beyond_others: rest.cost - of_all.cost,
            saved_in_set: worth_of(selection, &set).cost - worth_of(selection, &with).cost,
            bits_alone: (alone.information - of_none.information) * BITS,
            bits_beyond_others: (of_all.information - rest.information) * BITS,
            saved_alone_per_price: (candidate.price > 0.0).then(|| saved_alone / candidate.price),
            weight: weights[one],
        }
    };
    all.iter().map(|&one| value(one)).collect()
}

/// Of a task's own measurements, those that are chosen together.
pub(super) fn joined(selection: &Selection) -> Vec<String> {
    let joined = selection.candidates.iter().filter(|candidate| candidate.rows.len() > 1);
    let remark = |candidate: &Candidate| {
        format!(
            "{} are one candidate, chosen together: the noise of these measurements is correlated, in `noise.measurement`",
            candidate.name
        )
    };
    joined.map(remark).collect()
}
