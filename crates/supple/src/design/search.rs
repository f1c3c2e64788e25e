use std::sync::atomic::{AtomicBool, Ordering};

use super::visit::{Scaling, Visit, Visitor};
use super::{DesignSettings, Method, barrier, sqp};
use crate::Error;
use crate::problem::Problem;

/// What happens during a long computation.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A start began; there are `of` of them.
    StartBegan {
        /// Its number, from 0.
        start: usize,
        /// How many there are.
        of: usize,
    },
    /// A design was evaluated.
    Evaluated {
        /// The start's number.
        start: usize,
        /// All its parameters.
        design: &'a [f64],
        /// The objective, nats.
        information: f64,
        /// Expected cost of each task.
        costs: &'a [f64],
        /// How far the worst task is above its bound, relative to it.
        violation: f64,
    },
    /// Other local minima of the plans are being searched for.
    SearchingBranches {
        /// The start's number.
        start: usize,
    },
    /// A start ended.
    StartEnded {
        /// Its number.
        start: usize,
    },
}

/// Sees what happens during a long computation; called from several threads.
pub trait Observer: Send + Sync {
    /// Something happened.
    fn observe(&self, event: Event);
}

/// Looks away.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoObserver;

impl Observer for NoObserver {
    fn observe(&self, _: Event) {}
}

/// How a long computation is watched and stopped.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Sees what happens.
    pub observer: &'a dyn Observer,
    /// Set to stop soon, keeping what was found.
    pub stop: &'a AtomicBool,
}

impl Control<'_> {
    /// Whether to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// How an optimiser ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    /// At a point that it takes for the optimum.
    Converged,
    /// It used up its evaluations.
    MaxEvaluations,
    /// It found no further progress.
    Stalled,
    /// It was told to stop.
    Stopped,
}

/// One optimiser's run from one start on one branch.
pub(crate) struct Search<'a, 'b> {
    pub visitor: &'b mut Visitor<'a>,
    pub control: Control<'a>,
    /// The start's number, for the observer.
    pub start: usize,
    /// Evaluations made.
    pub evaluations: usize,
    /// Why a design on the way could not be evaluated, where that ended the run.
    pub error: Option<Error>,
}

impl<'a> Search<'a, '_> {
    /// Runs the optimiser of the settings from the visitor's last design.
    pub fn run(&mut self) -> Result<Ending, Error> {
        match self.settings().method {
            Method::Sqp => sqp::minimise(self),
            Method::Barrier => barrier::descend(self),
        }
    }

    pub fn problem(&self) -> &'a Problem {
        self.visitor.problem
    }

    pub fn settings(&self) -> &'a DesignSettings {
        self.visitor.settings
    }

    /// First-order optimality of a visit, and its multipliers.
    pub fn optimality(&self, at: &Visit) -> (f64, Vec<f64>) {
        optimality(at, self.problem(), &self.visitor.scaling, self.settings().feasibility)
    }

    /// Visits scaled coordinates and tells the observer.
    pub fn visit(&mut self, scaled: &[f64]) -> Result<Visit, Error> {
        let known = self.visitor.visits.len();
        let visit = self.visitor.visit(scaled)?.clone();
        if self.visitor.visits.len() > known {
            self.evaluations += 1;
            let costs: Vec<f64> = visit.tasks.iter().map(|task| task.cost).collect();
            self.control.observer.observe(Event::Evaluated {
                start: self.start,
                design: &visit.phi,
                information: visit.information(self.visitor.problem),
                costs: &costs,
                violation: visit.violation(),
            });
        }
        Ok(visit)
    }
}

/// First-order optimality up to which a design counts as an optimum.
pub(crate) const OPTIMAL: f64 = 1e-4;

/// First-order optimality of a visited design and its multipliers (theory, equation D.3): non-negative least squares
/// of the objective's gradient on those of the active constraints, over coordinates off their bounds.
pub(crate) fn optimality(at: &Visit, problem: &Problem, scaling: &Scaling, feasibility: f64) -> (f64, Vec<f64>) {
    let objective = scaling.gradient(&at.phi, &at.information_gradient(problem));
    let gradients: Vec<Vec<f64>> = at.tasks.iter().map(|task| scaling.gradient(&at.phi, &task.cost_gradient)).collect();
    let near = 100.0 * feasibility;
    let is_active = |task: usize| at.tasks[task].violation().is_some_and(|violation| violation > -near);
    let mut multipliers = vec![0.0; at.tasks.len()];
    let free = |i: usize, residual: f64| {
        let s = at.scaled[i];
        !(s <= 1e-9 && residual >= 0.0 || s >= 1.0 - 1e-9 && residual <= 0.0)
    };
    let residual = |multipliers: &[f64]| -> Vec<f64> {
        (0..objective.len())
            .map(|i| objective[i] + multipliers.iter().zip(&gradients).map(|(l, g)| l * g[i]).sum::<f64>())
            .collect()
    };
    // Coordinate descent: tasks are few.
    for _ in 0..200 {
        for task in (0..at.tasks.len()).filter(|&task| is_active(task)) {
            let rest = residual(&multipliers);
            let used = |i: &usize| free(*i, rest[*i]);
            let square: f64 = (0..rest.len()).filter(used).map(|i| gradients[task][i].powi(2)).sum();
            let slope: f64 = (0..rest.len()).filter(used).map(|i| gradients[task][i] * rest[i]).sum();
            if square > 0.0 {
                multipliers[task] = (multipliers[task] - slope / square).max(0.0);
            }
        }
    }
    let rest = residual(&multipliers);
    let size = objective.iter().fold(1e-300, |size: f64, g| size.max(g.abs()));
    let worst = (0..rest.len()).filter(|&i| free(i, rest[i])).map(|i| rest[i].abs()).fold(0.0, f64::max);
    (worst / size, multipliers)
}
