use std::cell::RefCell;

use slsqp::{Func, StopTols};
use supple_kernels::halt;

use super::{Candidate, Goal, Limits, Selection, Weights};
use crate::Error;

/// A lower bound on the best set of sensors, from a relaxed problem in which sensors may be present in part.
///
/// Example: [`Searched`](crate::sensors::Searched).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Relaxation {
    /// No set within the limits does better than this: expected cost, information in nats, or price, by the goal.
    pub bound: f64,
    /// Weights of the candidates, 0 to 1, where the bound was found.
    pub weights: Vec<f64>,
}

/// Evaluations of one relaxed problem at most.
const EVALUATIONS: usize = 100;

/// Margin for rounding in a lower bound, relative to the numbers from which it is computed.
const ROUNDING: f64 = 1e-10;

/// Candidates that a set must and must not contain, and the limits on the set.
#[derive(Clone, Debug)]
pub(super) struct Region {
    pub fixed: Vec<Option<bool>>,
    pub limits: Limits,
}

impl Region {
    /// All sets within the limits; candidates that do not even fit alone are in none of them.
    pub fn whole(candidates: &[Candidate], limits: Limits) -> Self {
        let fits = |one: &Candidate| limits.fits(0.0, 0, one.price);
        Self { fixed: candidates.iter().map(|one| if fits(one) { None } else { Some(false) }).collect(), limits }
    }

    /// The candidates that it must have.
    pub fn held(&self) -> impl Iterator<Item = usize> {
        (0..self.fixed.len()).filter(|&one| self.fixed[one] == Some(true))
    }

    /// The candidates that may be there or not.
    pub fn free(&self) -> Vec<usize> {
        (0..self.fixed.len()).filter(|&one| self.fixed[one].is_none()).collect()
    }

    /// The budget and count left for the free ones.
    fn room(&self, prices: &[f64]) -> (Option<f64>, Option<usize>) {
        let held: f64 = self.held().map(|one| prices[one]).sum();
        let count = self.held().count();
        (self.limits.budget.map(|budget| budget - held), self.limits.count.map(|most| most.saturating_sub(count)))
    }

    /// Weights inside the region: 1 for required candidates, and an equal share for each free one.
    fn start(&self, prices: &[f64], all: bool) -> Vec<f64> {
        let free = self.free();
        let (budget, count) = self.room(prices);
        let total: f64 = free.iter().map(|&one| prices[one]).sum();
        let of_budget = budget.filter(|_| total > 0.0).map_or(1.0, |budget| budget / total);
        let of_count = count.filter(|_| !free.is_empty()).map_or(1.0, |count| count as f64 / free.len() as f64);
        let share = if all { 1.0 } else { of_budget.min(of_count).clamp(0.0, 1.0) };
        self.fixed.iter().map(|fixed| fixed.map_or(share, |fixed| f64::from(u8::from(fixed)))).collect()
    }

    /// `min g'z` over the relaxed region, from below: the greatest dual value found (theory, equation N.7).
    fn least(&self, g: &[f64], prices: &[f64]) -> f64 {
        let held: f64 = self.held().map(|one| g[one]).sum();
        let free = self.free();
        let (budget, count) = self.room(prices);
        let dual = |lambda: f64| {
            let mut terms: Vec<f64> = free.iter().map(|&one| (g[one] + lambda * prices[one]).min(0.0)).collect();
            terms.sort_by(f64::total_cmp);
            let taken: f64 = terms.iter().take(count.unwrap_or(usize::MAX)).sum();
            taken - budget.map_or(0.0, |budget| lambda * budget)
        };
        let mut best = dual(0.0);
        if budget.is_some() {
            let breaks = free.iter().filter(|&&one| prices[one] > 0.0).map(|&one| -g[one] / prices[one]);
            let breaks: Vec<f64> = breaks.filter(|lambda| *lambda > 0.0 && lambda.is_finite()).collect();
            best = breaks.iter().map(|&lambda| dual(lambda)).fold(best, f64::max);
            // With a limit on the count there are more kinks; any multiplier is valid.
            let (mut low, mut high) = (0.0, breaks.iter().copied().fold(0.0, f64::max));
            for _ in 0..if count.is_some() { 80 } else { 0 } {
                let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                let (at_a, at_b) = (dual(a), dual(b));
                best = best.max(at_a).max(at_b);
                if at_a < at_b { low = a } else { high = b }
            }
        }
        held + best
    }

    /// `min p'z` over the region where `offset + g'z <= 0`, from below; infinite if there is no such point.
    fn least_price(&self, offset: f64, g: &[f64], prices: &[f64]) -> f64 {
        let held: f64 = self.held().map(|one| prices[one]).sum();
        let offset = offset + self.held().map(|one| g[one]).sum::<f64>();
        let free = self.free();
        if offset + free.iter().map(|&one| g[one].min(0.0)).sum::<f64>() > 0.0 {
            return f64::INFINITY;
        }
        let dual = |lambda: f64| {
            let terms = free.iter().map(|&one| (prices[one] + lambda * g[one]).min(0.0));
            lambda * offset + terms.sum::<f64>()
        };
        let breaks = free.iter().filter(|&&one| g[one] < 0.0).map(|&one| -prices[one] / g[one]);
        held + breaks.map(dual).fold(0.0, f64::max)
    }
}

/// One relaxed problem on the way to its solution.
struct Relaxing<'a> {
    selection: &'a Selection,
    goal: Goal,
    region: &'a Region,
    prices: Vec<f64>,
    free: Vec<usize>,
    memory: Vec<super::Memory>,
    /// The last point with its merit and gradient.
    last: (Vec<f64>, f64, Vec<f64>),
    best: Relaxation,
}

impl Relaxing<'_> {
    /// Evaluates at weights of the free candidates, and keeps the resulting bound if it is better.
    fn visit(&mut self, free: &[f64]) {
        let mut z = self.region.start(&self.prices, false);
        for (&one, &weight) in self.free.iter().zip(free) {
            z[one] = weight.clamp(0.0, 1.0);
        }
        if z == self.last.0 {
            return;
        }
        let of = match self.goal {
            Goal::LeastCost | Goal::LeastPrice { .. } => Weights { cost: 1.0, information: 0.0 },
            Goal::MostInformation => Weights { cost: 0.0, information: -1.0 },
        };
        let mut gradient = vec![0.0; z.len()];
        let worth = self.selection.gradient(&z, of, &mut self.memory, &mut gradient);
        let merit = self.goal.merit(worth);
        let along: f64 = gradient.iter().zip(&z).map(|(g, z)| g * z).sum();
        let used = gradient.iter().zip(&self.region.fixed).filter(|(_, fixed)| **fixed != Some(false));
        let size: f64 = merit.abs() + used.map(|(g, _)| g.abs()).sum::<f64>();
        if !merit.is_finite() {
            // The filter fails here, which says nothing of other points.
            self.last = (z, merit, gradient);
            return;
        }
        let rounding = if self.goal == Goal::MostInformation { self.selection.rounding() } else { 0.0 };
        let margin = ROUNDING * size + rounding;
        let bound = match self.goal {
            Goal::LeastPrice { cost } => {
                self.region.least_price(merit - along - cost - margin, &gradient, &self.prices)
            }
            _ => merit - along + self.region.least(&gradient, &self.prices) - margin,
        };
        if bound > self.best.bound {
            self.best = Relaxation { bound, weights: z.clone() };
        }
        self.last = (z, merit, gradient);
    }

    /// Merit and its gradient by the free weights.
    fn merit(&mut self, free: &[f64], gradient: Option<&mut [f64]>, scale: f64) -> f64 {
        // Once a stop is requested, the bound stays what it is: SLSQP ends as nothing changes.
        if !halt::is_requested() {
            self.visit(free);
        }
        if let Some(out) = gradient {
            for (out, &one) in out.iter_mut().zip(&self.free) {
                *out = self.last.2[one] / scale;
            }
        }
        self.last.1 / scale
    }
}

impl Selection {
    /// The best that any set within the limits could be, certified: the merit is convex in the weights of the candidates,
    /// so that every linearisation of it lies below it, and the least of a linearisation over all weights within the
    /// limits lies below all sets (theory, equation N.6). The linearisations are those that SLSQP makes on its way to the
    /// least merit.
    ///
    /// # Errors
    /// If the budget is not a number of at least 0.
    pub fn bound(&self, goal: Goal, limits: Limits) -> Result<Relaxation, Error> {
        goal.check(limits)?;
        let found = self.relax(goal, &Region::whole(&self.candidates, limits));
        Ok(match goal {
            Goal::MostInformation => Relaxation { bound: self.most_added(limits).min(-found.bound), ..found },
            _ => found,
        })
    }

    /// The most information that a set within the limits can have, from above: that of the greedy choice after some of its
    /// sensors, plus at most what each other sensor adds to it (theory, equation N.8).
    fn most_added(&self, limits: Limits) -> f64 {
        let prices: Vec<f64> = self.candidates.iter().map(|candidate| candidate.price).collect();
        let region = Region::whole(&self.candidates, limits);
        let order = self.greedily(Goal::MostInformation, limits).map_or_else(Vec::new, |chosen| chosen.sensors);
        let mut memory = self.memory(false);
        let mut after = |held: &[usize]| {
            let mut z = self.weights_of(held);
            let here = self.worth_with(&z, &mut memory).information;
            let mut losses = vec![0.0; prices.len()];
            for one in (0..prices.len()).filter(|one| !held.contains(one)) {
                z[one] = 1.0;
                let with = self.worth_with(&z, &mut memory).information;
                z[one] = 0.0;
                // What cannot be computed might be anything.
                if with == f64::NEG_INFINITY {
                    return f64::INFINITY;
                }
                losses[one] = here - with;
            }
            here - region.least(&losses, &prices)
        };
        let least = (0..=order.len()).map(|count| after(&order[..count])).fold(f64::INFINITY, f64::min);
        least + ROUNDING * least.abs() + self.rounding()
    }

    /// The same of a region, as merit: of the information with its sign changed.
    pub(super) fn relax(&self, goal: Goal, region: &Region) -> Relaxation {
        let prices: Vec<f64> = self.candidates.iter().map(|candidate| candidate.price).collect();
        let by_price = matches!(goal, Goal::LeastPrice { .. });
        let start = region.start(&prices, by_price);
        let free = region.free();
        let first: Vec<f64> = free.iter().map(|&one| start[one]).collect();
        let mut relaxing = Relaxing {
            selection: self,
            goal,
            region,
            memory: self.memory(true),
            last: (Vec::new(), 0.0, Vec::new()),
            best: Relaxation { bound: f64::NEG_INFINITY, weights: start },
            prices,
            free,
        };
        relaxing.visit(&first);
        if !relaxing.free.is_empty() && relaxing.best.bound < f64::INFINITY {
            let mut from = first;
            for _ in 0..RUNS {
                let before = relaxing.best.bound;
                minimise(&mut relaxing, &from, by_price);
                if relaxing.best.bound - before <= 1e-6 * relaxing.best.bound.abs() {
                    break;
                }
                from = relaxing.free.iter().map(|&one| relaxing.best.weights[one]).collect();
            }
        }
        relaxing.best
    }
}

/// Maximum number of SLSQP runs, each from where the best bound so far was found.
const RUNS: usize = 5;

/// SLSQP from the first point; how it ends does not matter to the bound.
fn minimise(relaxing: &mut Relaxing, first: &[f64], by_price: bool) {
    let (free, prices) = (relaxing.free.clone(), relaxing.prices.clone());
    let (budget, count) = relaxing.region.room(&prices);
    let slope = relaxing.free.iter().map(|&one| relaxing.last.2[one].abs()).fold(0.0, f64::max);
    let scale = slope.max(1e-300);
    let total = free.iter().map(|&one| prices[one]).sum::<f64>().max(1e-300);
    let of_price = |z: &[f64], gradient: Option<&mut [f64]>| {
        if let Some(out) = gradient {
            out.iter_mut().zip(&free).for_each(|(out, &one)| *out = prices[one] / total);
        }
        z.iter().zip(&free).map(|(z, &one)| z * prices[one]).sum::<f64>() / total
    };
    let bound = match relaxing.goal {
        Goal::LeastPrice { cost } => cost,
        _ => 0.0,
    };
    let shared = RefCell::new(relaxing);
    let merit = |z: &[f64], gradient: Option<&mut [f64]>, _: &mut ()| shared.borrow_mut().merit(z, gradient, scale);
    let within_price = |z: &[f64], gradient: Option<&mut [f64]>, _: &mut ()| {
        of_price(z, gradient) - budget.map_or(f64::MAX, |budget| budget / total)
    };
    let within_count = |z: &[f64], gradient: Option<&mut [f64]>, _: &mut ()| {
        let of = 1.0 / z.len() as f64;
        if let Some(out) = gradient {
            out.fill(of);
        }
        z.iter().sum::<f64>() * of - count.map_or(f64::MAX, |count| count as f64 * of)
    };
    let within_cost = |z: &[f64], gradient: Option<&mut [f64]>, unit: &mut ()| merit(z, gradient, unit) - bound / scale;
    let price = |z: &[f64], gradient: Option<&mut [f64]>, _: &mut ()| of_price(z, gradient);
    let mut constraints: Vec<&dyn Func<()>> = Vec::new();
    if by_price {
        constraints.push(&within_cost);
    }
    if budget.is_some() {
        constraints.push(&within_price);
    }
    if count.is_some() {
        constraints.push(&within_count);
    }
    let tolerances = StopTols { ftol_rel: 1e-10, xtol_abs: vec![1e-9; first.len()], ..StopTols::default() };
    let box_of = vec![(0.0, 1.0); first.len()];
    let objective: &dyn Func<()> = if by_price { &price } else { &merit };
    let objective = |z: &[f64], gradient: Option<&mut [f64]>, unit: &mut ()| objective(z, gradient, unit);
    let _ = slsqp::minimize(objective, first, &box_of, &constraints, (), EVALUATIONS, Some(tolerances));
}
