use rayon::prelude::*;

use super::relax::Region;
use super::{Chosen, Goal, Limits, Selection};
use crate::Error;

/// The best set that branch and bound found, and a bound on any set.
///
/// Example: [`Selection`].
#[derive(Clone, Debug, PartialEq)]
pub struct Searched {
    /// The best set found.
    pub chosen: Chosen,
    /// No set within the limits does better: expected cost, information in nats, or price, by the goal.
    pub bound: f64,
    /// Whether the set is the best one, to 1e-7 of the change that all sensors make.
    pub proved: bool,
}

/// A region that may hold a better set.
struct Node {
    region: Region,
    bound: f64,
    weights: Vec<f64>,
}

/// Regions examined at once.
const BATCH: usize = 8;

/// How much better a set must be to count as better, relative to what all sensors together change.
const TOLERANCE: f64 = 1e-7;

impl Selection {
    /// The best set within the limits by branch and bound: regions are bounded by [`bound`](Self::bound), the most
    /// promising ones divided first, at the candidate whose weight is most undecided. It ends when no region is left that
    /// could hold a better set, or with the best so far once `most` regions were examined or `going` is false before one
    /// of its rounds. Deterministic, whatever the number of threads.
    ///
    /// # Errors
    /// Where no set reaches the bound of [`Goal::LeastPrice`], or none was found in time; if the budget is not a number of at
    /// least 0.
    pub fn branch_and_bound(
        &self,
        goal: Goal,
        limits: Limits,
        most: usize,
        going: &mut dyn FnMut() -> bool,
    ) -> Result<Searched, Error> {
        goal.check(limits)?;
        let count = self.candidates.len();
        // If greedy choice found no set, any set is better.
        let mut best = self.greedily(goal, limits).map(|best| Chosen { rule: None, ..best });
        let span = match goal {
            Goal::LeastPrice { .. } => self.price(&(0..count).collect::<Vec<_>>()),
            _ => goal.merit(self.worth(&vec![false; count])) - goal.merit(self.worth(&vec![true; count])),
        };
        let slack = if span.is_finite() { TOLERANCE * span.abs() } else { 0.0 };
        let mut open = vec![self.node(goal, Region::whole(&self.candidates, limits))];
        let mut closed = f64::INFINITY;
        let mut looked = 1;
        loop {
            let reach = self.reach(goal, best.as_ref()) - slack;
            let (left, pruned): (Vec<Node>, Vec<Node>) = open.into_iter().partition(|node| node.bound < reach);
            closed = pruned.iter().map(|node| node.bound).fold(closed, f64::min);
            open = left;
            if open.is_empty() || looked >= most || !going() {
                break;
            }
            // Stable: equal bounds stay in the order in which they came up.
            open.sort_by(|a, b| a.bound.total_cmp(&b.bound));
            let batch: Vec<Node> = open.drain(..open.len().min(BATCH)).collect();
            let parts = batch.iter().flat_map(|node| self.divide(node).into_iter().map(|part| (part, node.bound)));
            let parts: Vec<(Region, f64)> = parts.collect();
            looked += parts.len();
            let divided = parts.into_par_iter().map(|(region, bound)| {
                // A bound on a region also bounds its parts.
                let node = self.node(goal, region);
                let node = Node { bound: node.bound.max(bound), ..node };
                let rounded = self.rounded(goal, &node);
                (node, rounded)
            });
            for (node, rounded) in divided.collect::<Vec<_>>() {
                let better = |found: &Chosen| best.as_ref().is_none_or(|best| self.order(goal, found, best).is_lt());
                if rounded.as_ref().is_some_and(better) {
                    best = rounded;
                }
                // A region without free candidates is just its rounded set.
                if !node.region.free().is_empty() {
                    open.push(node);
                }
            }
        }
        let proved = open.is_empty();
        let Some(best) = best else { return Err(if proved { self.insufficient(goal) } else { self.not_found(goal) }) };
        let bound = open.iter().map(|node| node.bound).fold(closed.min(self.reach(goal, Some(&best))), f64::min);
        let bound = if goal == Goal::MostInformation { -bound } else { bound };
        let chosen = Chosen { tried: looked, ..self.pruned(goal, best) };
        Ok(Searched { chosen, bound, proved })
    }

    /// The value that a better set must be below.
    fn reach(&self, goal: Goal, best: Option<&Chosen>) -> f64 {
        best.map_or(f64::INFINITY, |best| match goal {
            Goal::LeastPrice { .. } => best.price,
            _ => goal.merit(best.worth),
        })
    }

    fn node(&self, goal: Goal, region: Region) -> Node {
        let relaxation = self.relax(goal, &region);
        Node { region, bound: relaxation.bound, weights: relaxation.weights }
    }

    /// Two regions: with and without the most undecided candidate, as far as the limits allow it.
    fn divide(&self, node: &Node) -> Vec<Region> {
        let undecided = |one: usize| (node.weights[one] - 0.5).abs();
        let free = node.region.free();
        let Some(&one) = free.iter().min_by(|&&a, &&b| undecided(a).total_cmp(&undecided(b))) else {
            return Vec::new();
        };
        let held: Vec<usize> = node.region.held().collect();
        let fits = node.region.limits.fits(self.price(&held), held.len(), self.candidates[one].price);
        let with = [true, false].into_iter().filter(|&with| fits || !with);
        let region = |with| {
            let mut region = node.region.clone();
            region.fixed[one] = Some(with);
            region
        };
        with.map(region).collect()
    }

    /// A set of a region: the required candidates, then the free ones by their weights as long as they fit. `None` where it
    /// does not reach the bound of the goal.
    fn rounded(&self, goal: Goal, node: &Node) -> Option<Chosen> {
        let mut sensors: Vec<usize> = node.region.held().collect();
        let mut free = node.region.free();
        free.sort_by(|&a, &b| node.weights[b].total_cmp(&node.weights[a]).then(a.cmp(&b)));
        let mut memory = self.memory(false);
        let mut worth = self.worth_with(&self.weights_of(&sensors), &mut memory);
        for one in free {
            if goal.is_met(worth) {
                break;
            }
            if node.region.limits.fits(self.price(&sensors), sensors.len(), self.candidates[one].price) {
                sensors.push(one);
                if matches!(goal, Goal::LeastPrice { .. }) {
                    worth = self.worth_with(&self.weights_of(&sensors), &mut memory);
                }
            }
        }
        worth = self.worth_with(&self.weights_of(&sensors), &mut memory);
        let usable = !matches!(goal, Goal::LeastPrice { .. }) || goal.is_met(worth);
        let price = self.price(&sensors);
        sensors.sort_unstable();
        usable.then_some(Chosen { sensors, worth, price, rule: None, tried: 0 })
    }
}
