//! What a design search minimises and limits, as a list of functions of a visited design (theory, equation D.2). Another
//! constraint is another entry of [`constraints`].

use super::Aim;
use super::visited::{TaskVisit, Visit};
use crate::aims::Unmeasured;
use crate::problem::Problem;
use crate::settings::DesignSettings;
use crate::violation;

/// Units of an [`OuterProblem`](super::OuterProblem).
///
/// Example: [`Optimiser`](crate::design::Optimiser).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Units {
    /// Variables from 0 to 1, linearly or in the logarithm, as each parameter has it; objective and constraints
    /// relative to their size at the first point.
    Scaled,
    /// Parameters in their units, the objective in nats, constraints in units of cost and price.
    Natural,
}

impl Units {
    /// The scale by which numbers of this size are divided.
    pub(super) fn scale(self, size: f64) -> f64 {
        match self {
            Self::Scaled => size.abs().max(1e-12),
            Self::Natural => 1.0,
        }
    }
}

/// A number at a visited design, and its gradient with respect to all parameters.
type Valued = (f64, Vec<f64>);

type Function = dyn Fn(&Problem, &Visit) -> Valued;

/// What a constraint limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Limited {
    /// The cost of a task, by index.
    Cost(usize),
    /// The sum of prices.
    Price,
    /// The cost of a task without measurements.
    Unmeasured(usize),
}

impl Limited {
    /// How far it is above its limit, relative to the limit; infinitely below where there is no limit.
    pub fn violation(self, visit: &Visit) -> f64 {
        let found = match self {
            Self::Cost(task) => visit.tasks[task].violation(),
            Self::Price => visit.price.violation(),
            Self::Unmeasured(task) => visit.tasks[task].unmeasured_violation(),
        };
        found.unwrap_or(f64::NEG_INFINITY)
    }

    /// The greatest multiplier at an optimum, nats per unit: beyond the price of needed information, needing some would be
    /// better.
    pub fn greatest_multiplier(self, problem: &Problem, visit: &Visit) -> f64 {
        match self {
            Self::Unmeasured(task) => problem.tasks[task].information_weight * visit.tasks[task].first_price,
            Self::Cost(_) | Self::Price => f64::INFINITY,
        }
    }

    /// The task whose cost it limits, that cost and its gradient.
    fn cost(self, visit: &Visit) -> Option<(&TaskVisit, f64, &[f64])> {
        match self {
            Self::Cost(task) => Some(&visit.tasks[task]).map(|at| (at, at.cost, &*at.cost_gradient)),
            Self::Unmeasured(task) => {
                let at = &visit.tasks[task];
                at.unmeasured.as_ref().map(|Unmeasured { cost, gradient }| (at, *cost, &**gradient))
            }
            Self::Price => None,
        }
    }
}

/// A function of visited designs.
pub(super) struct Entry {
    of: Box<Function>,
    /// The scale by which it is divided for optimisers.
    pub scale: f64,
    /// What one unit of the auxiliary variable adds to it, after the division.
    pub auxiliary: f64,
}

impl Entry {
    fn new(scale: f64, of: impl Fn(&Problem, &Visit) -> Valued + 'static) -> Self {
        Self { of: Box::new(of), scale, auxiliary: 0.0 }
    }

    /// The number and its gradient, not yet divided by the scale.
    pub fn at(&self, problem: &Problem, visit: &Visit) -> Valued {
        (self.of)(problem, visit)
    }
}

/// Whether a search has an auxiliary variable: the least cost is the least number that is at least every `J_i / D_i`.
pub(super) fn has_auxiliary(aim: Aim) -> bool {
    matches!(aim, Aim::Cost | Aim::UnmeasuredCost)
}

/// What is minimised.
pub(super) fn objective(problem: &Problem, aim: Aim, units: Units, first: &Visit) -> Entry {
    if has_auxiliary(aim) {
        return Entry { auxiliary: 1.0, ..Entry::new(1.0, |_, visit| (0.0, vec![0.0; visit.phi.len()])) };
    }
    let scale = units.scale(first.objective(problem));
    Entry::new(scale, |problem, visit| (visit.objective(problem), visit.objective_gradient(problem)))
}

/// What must be at most 0, and what it limits: the cost of each task with a bound less that bound, or its ratio to the
/// bound less the auxiliary variable; the sum of prices less the budget; and the same for the cost without measurements,
/// of tasks that must keep the bound without them.
pub(super) fn constraints(settings: &DesignSettings, aim: Aim, units: Units, first: &Visit) -> Vec<(Limited, Entry)> {
    let bounded = || first.tasks.iter().enumerate().filter_map(|(task, at)| Some((task, at.bound?)));
    let unmeasured = bounded().filter(|&(task, _)| first.tasks[task].unmeasured.is_some());
    let ratio = |limited: Limited| {
        let of = move |_: &Problem, visit: &Visit| {
            let known = limited.cost(visit);
            let found = known.and_then(|(at, cost, gradient)| {
                Some((1.0 + violation(cost, at.bound?), at.ratio_gradient(cost, gradient)?))
            });
            found.unwrap_or_else(|| (0.0, vec![0.0; visit.phi.len()]))
        };
        Entry { auxiliary: -1.0, ..Entry::new(units.scale(1.0 + aim.violation(first)), of) }
    };
    let excess = |limited: Limited, bound: f64| {
        Entry::new(units.scale(bound), move |_, visit| {
            let found = limited
                .cost(visit)
                .map(|(at, cost, gradient)| (cost - at.bound.unwrap_or(f64::INFINITY), at.less_bound(gradient, 1.0)));
            found.unwrap_or_else(|| (f64::NEG_INFINITY, vec![0.0; visit.phi.len()]))
        })
    };
    let entry = |limited: Limited, bound: f64| {
        (limited, if has_auxiliary(aim) { ratio(limited) } else { excess(limited, bound) })
    };
    let measured = bounded().filter(|_| aim != Aim::UnmeasuredCost);
    let budget = settings.budget.map(|budget| {
        let of = move |_: &Problem, visit: &Visit| (visit.price.total - budget, visit.price.gradient.clone());
        (Limited::Price, Entry::new(units.scale(budget), of))
    });
    let costs = measured.map(|(task, bound)| entry(Limited::Cost(task), bound));
    let blind = unmeasured.map(|(task, bound)| entry(Limited::Unmeasured(task), bound));
    costs.chain(budget).chain(blind).collect()
}
