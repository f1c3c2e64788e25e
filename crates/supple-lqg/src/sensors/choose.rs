use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use supple_kernels::halt;

use super::{Memory, Selection, Worth};
use crate::Error;

/// The goal for which a set of sensors is chosen.
///
/// Example: [`Selection`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// The least expected cost within the limits.
    LeastCost,
    /// The most information within the limits.
    MostInformation,
    /// The least price, and among equal prices the fewest sensors, with which the expected cost is at most this.
    LeastPrice {
        /// The bound on the expected cost.
        cost: f64,
    },
}

/// Limits on a set of sensors.
///
/// Example: [`Selection`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Maximum total price.
    pub budget: Option<f64>,
    /// Maximum number of sensors.
    pub count: Option<usize>,
}

/// In which order greedy choice takes sensors.
///
/// Example: [`Searched`](crate::sensors::Searched).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// The one that gains most.
    Gain,
    /// The one that gains most per unit of price.
    GainPerPrice,
}

/// A chosen set.
///
/// Example: [`Selection`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Chosen {
    /// Its candidates, by index in [`Selection::candidates`]: in the order in which they were taken, or ascending.
    pub sensors: Vec<usize>,
    /// Its cost and information.
    pub worth: Worth,
    /// Its total price.
    pub price: f64,
    /// The order that found it, where it was greedy.
    pub rule: Option<Rule>,
    /// Sets that were tried.
    pub tried: usize,
}

/// Numbers that differ by less than this share are treated as equal.
pub(super) const SAME: f64 = 1e-12;

impl Limits {
    /// Whether anything can be within them.
    fn check(&self) -> Result<(), Error> {
        match self.budget.filter(|budget| !(0.0..f64::INFINITY).contains(budget)) {
            Some(found) => Err(Error::OutOfRange { what: "the budget", found, valid: "0 or more, or no budget" }),
            None => Ok(()),
        }
    }

    /// Whether one more sensor of a given price fits.
    pub(super) fn fits(&self, price: f64, count: usize, more: f64) -> bool {
        let room = |budget: f64| price + more <= budget + SAME * budget.abs();
        self.budget.is_none_or(room) && self.count.is_none_or(|most| count < most)
    }
}

impl Goal {
    /// The quantity to minimise: the expected cost, or the information with its sign changed.
    pub(super) fn merit(self, worth: Worth) -> f64 {
        match self {
            Self::LeastCost | Self::LeastPrice { .. } => worth.cost,
            Self::MostInformation => -worth.information,
        }
    }

    /// Whether it can be compared with, within these limits.
    pub(super) fn check(self, limits: Limits) -> Result<(), Error> {
        match self {
            Self::LeastPrice { cost } if cost.is_nan() => {
                let what = "the bound on the expected cost";
                Err(Error::OutOfRange { what, found: cost, valid: "any number" })
            }
            _ => limits.check(),
        }
    }

    pub(super) fn is_met(self, worth: Worth) -> bool {
        match self {
            Self::LeastPrice { cost } => worth.cost <= cost + SAME * cost.abs(),
            Self::LeastCost | Self::MostInformation => false,
        }
    }
}

impl Selection {
    /// Takes one sensor after the other, by gain and by gain per unit of price, and keeps the better of the two sets.
    /// Sensors without which the set is as good are left out. A requested stop ends it early.
    ///
    /// # Errors
    /// Where neither set reaches the bound of [`Goal::LeastPrice`], which does not prove that none does; if the budget is not
    /// a number of at least 0.
    pub fn greedy(&self, goal: Goal, limits: Limits) -> Result<Chosen, Error> {
        goal.check(limits)?;
        self.greedily(goal, limits).ok_or_else(|| self.not_found(goal))
    }

    /// The same; `None` where neither set reaches the bound of [`Goal::LeastPrice`].
    pub(super) fn greedily(&self, goal: Goal, limits: Limits) -> Option<Chosen> {
        let both = [Rule::Gain, Rule::GainPerPrice].map(|rule| self.greedy_by(goal, limits, rule));
        let tried = both.iter().flatten().map(|chosen| chosen.tried).sum();
        let better = |a: &Chosen, b: &Chosen| self.order(goal, a, b);
        both.into_iter().flatten().min_by(better).map(|chosen| Chosen { tried, ..chosen })
    }

    /// Which of two sets is better: the lesser comes first. Of sets that are as good up to rounding, the cheaper one is better.
    pub(super) fn order(&self, goal: Goal, a: &Chosen, b: &Chosen) -> std::cmp::Ordering {
        let key = |chosen: &Chosen| match goal {
            Goal::LeastPrice { .. } => (chosen.price, chosen.sensors.len() as f64, chosen.worth.cost),
            _ => (goal.merit(chosen.worth), chosen.price, chosen.sensors.len() as f64),
        };
        let (a, b) = (key(a), key(b));
        let is_tie = (a.0 - b.0).abs() <= SAME * a.0.abs().max(b.0.abs());
        let first = if is_tie { std::cmp::Ordering::Equal } else { a.0.total_cmp(&b.0) };
        first.then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2))
    }

    fn greedy_by(&self, goal: Goal, limits: Limits, rule: Rule) -> Option<Chosen> {
        let count = self.candidates.len();
        let mut z = vec![0.0; count];
        let (mut sensors, mut price, mut tried) = (Vec::new(), 0.0, 1);
        let mut worth = self.worth_with(&z, &mut self.memory(false));
        while !goal.is_met(worth) && !halt::is_requested() {
            let fits = |one: &usize| z[*one] == 0.0 && limits.fits(price, sensors.len(), self.candidates[*one].price);
            let open: Vec<usize> = (0..count).filter(fits).collect();
            let with = |memory: &mut Vec<Memory>, &one: &usize| {
                let mut with = z.clone();
                with[one] = 1.0;
                (one, self.worth_with(&with, memory))
            };
            let found: Vec<(usize, Worth)> = open.par_iter().map_init(|| self.memory(false), with).collect();
            tried += found.len();
            let score = |&(one, with): &(usize, Worth)| {
                let gain = goal.merit(worth) - goal.merit(with);
                match rule {
                    Rule::Gain => gain,
                    Rule::GainPerPrice => gain / self.candidates[one].price.max(f64::MIN_POSITIVE),
                }
            };
            let most = found.iter().map(score).fold(f64::NEG_INFINITY, f64::max);
            let as_good = |found: &&(usize, Worth)| score(found) >= most - SAME * goal.merit(worth).abs();
            let price_of = |(one, _): &(usize, Worth)| self.candidates[*one].price;
            let best = found.iter().filter(as_good).min_by(|a, b| price_of(a).total_cmp(&price_of(b)));
            let Some(&(one, with)) = best.filter(|best| score(best) > 0.0) else { break };
            z[one] = 1.0;
            sensors.push(one);
            price += self.candidates[one].price;
            worth = with;
        }
        if matches!(goal, Goal::LeastPrice { .. }) && !goal.is_met(worth) {
            return None;
        }
        let chosen = Chosen { sensors, worth, price, rule: Some(rule), tried };
        Some(self.pruned(goal, chosen))
    }

    /// Removes sensors without which the set is as good, the most expensive first.
    pub(super) fn pruned(&self, goal: Goal, mut chosen: Chosen) -> Chosen {
        let mut memory = self.memory(false);
        let mut by_price = chosen.sensors.clone();
        by_price.sort_by(|&a, &b| self.candidates[b].price.total_cmp(&self.candidates[a].price).then(b.cmp(&a)));
        for one in by_price {
            let rest: Vec<usize> = chosen.sensors.iter().copied().filter(|&other| other != one).collect();
            let worth = self.worth_with(&self.weights_of(&rest), &mut memory);
            chosen.tried += 1;
            let (before, after) = (goal.merit(chosen.worth), goal.merit(worth));
            let as_good = match goal {
                Goal::LeastPrice { .. } => goal.is_met(worth),
                _ => after - before <= SAME * before.abs(),
            };
            if as_good {
                chosen.sensors = rest;
                chosen.worth = worth;
            }
        }
        chosen.price = self.price(&chosen.sensors);
        chosen
    }

    /// Weights of a set: 1 and 0.
    pub(super) fn weights_of(&self, sensors: &[usize]) -> Vec<f64> {
        let mut z = vec![0.0; self.candidates.len()];
        sensors.iter().for_each(|&one| z[one] = 1.0);
        z
    }

    /// The best of all sets within the limits, in parallel; the result does not depend on the number of threads.
    /// `going` decides before each of [`exhaustive_rounds`](Self::exhaustive_rounds) rounds whether to continue.
    ///
    /// A set that has room for another sensor is skipped: it cannot be better than the set with it. With more than 15
    /// candidates there are many sets: [`branch_and_bound`](Self::branch_and_bound) need not try all of them.
    ///
    /// # Errors
    /// Where there are more than 20 candidates, or no set reaches the bound of [`Goal::LeastPrice`]; if the budget is not a
    /// number of at least 0; [`Error::Stopped`] if it was stopped.
    pub fn exhaustive(&self, goal: Goal, limits: Limits, going: &mut dyn FnMut() -> bool) -> Result<Chosen, Error> {
        goal.check(limits)?;
        let count = self.candidates.len();
        if count > MOST_EXHAUSTIVE {
            let what = "the number of candidates of an exhaustive search".to_owned();
            return Err(Error::TooMany { what, found: count, most: MOST_EXHAUSTIVE });
        }
        let sets = self.sets(goal, limits);
        let mut best: Option<Chosen> = None;
        for round in sets.chunks(ROUND) {
            if !going() {
                return Err(Error::Stopped);
            }
            let one = |memory: &mut Vec<Memory>, set: &Vec<usize>| Chosen {
                worth: self.worth_with(&self.weights_of(set), memory),
                price: self.price(set),
                sensors: set.clone(),
                rule: None,
                tried: sets.len(),
            };
            let found: Vec<Chosen> = round.par_iter().map_init(|| self.memory(false), one).collect();
            let usable = |chosen: &Chosen| !matches!(goal, Goal::LeastPrice { .. }) || goal.is_met(chosen.worth);
            for chosen in found.into_iter().filter(usable) {
                if best.as_ref().is_none_or(|best| self.order(goal, &chosen, best).is_lt()) {
                    best = Some(chosen);
                }
            }
            // Sets come by increasing price: no cheaper one is left.
            if best.is_some() && matches!(goal, Goal::LeastPrice { .. }) {
                break;
            }
        }
        best.map(|best| self.pruned(goal, best)).ok_or_else(|| self.insufficient(goal))
    }

    /// The error that no set within the limits reaches the bound of [`Goal::LeastPrice`].
    pub(super) fn insufficient(&self, goal: Goal) -> Error {
        let bound = if let Goal::LeastPrice { cost } = goal { cost } else { f64::NEG_INFINITY };
        Error::NoSensorsSuffice { bound, least: self.worth(&vec![true; self.candidates.len()]).cost }
    }

    /// The error that none was found, which proves nothing unless all candidates together are not good enough either.
    pub(super) fn not_found(&self, goal: Goal) -> Error {
        match goal {
            Goal::LeastPrice { cost } if self.worth(&vec![true; self.candidates.len()]).cost <= cost => {
                Error::NoSensorsFound { bound: cost }
            }
            _ => self.insufficient(goal),
        }
    }

    /// How many rounds [`exhaustive`](Self::exhaustive) has at most.
    #[must_use]
    pub fn exhaustive_rounds(&self, goal: Goal, limits: Limits) -> usize {
        self.sets(goal, limits).len().div_ceil(ROUND)
    }

    /// Sets to try, each in ascending order.
    fn sets(&self, goal: Goal, limits: Limits) -> Vec<Vec<usize>> {
        let count = self.candidates.len().min(MOST_EXHAUSTIVE);
        let set = |mask: usize| -> Vec<usize> { (0..count).filter(|one| mask >> one & 1 == 1).collect() };
        let within = |set: &Vec<usize>| {
            let price = self.price(set);
            let fits = Limits { count: None, ..limits }.fits(price, 0, 0.0);
            fits && limits.count.is_none_or(|most| set.len() <= most)
        };
        let is_full = |set: &Vec<usize>| {
            let price = self.price(set);
            !(0..count).any(|one| !set.contains(&one) && limits.fits(price, set.len(), self.candidates[one].price))
        };
        let by_price = matches!(goal, Goal::LeastPrice { .. });
        let sets = (0..1_usize << count).map(set).filter(within);
        let mut sets: Vec<Vec<usize>> = sets.filter(|set| by_price || is_full(set)).collect();
        if by_price {
            sets.sort_by(|a, b| self.price(a).total_cmp(&self.price(b)).then(a.len().cmp(&b.len())));
        }
        sets
    }
}

/// Maximum number of candidates of an exhaustive search.
const MOST_EXHAUSTIVE: usize = 20;

/// Sets of a round.
const ROUND: usize = 256;
