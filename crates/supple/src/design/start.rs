use std::time::Instant;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use supple_kernels::Matrices;

use super::branches::uniform;
use super::search::{OPTIMAL, optimality};
use super::visit::{Scaling, Visit, Visitor, controls_of};
use super::{Control, DesignSettings, Ending, Event, GradientKind, Method, Search, best_of_guesses, search_branches};
use crate::Error;
use crate::pipeline::TaskState;
use crate::plan::PlanMode;
use crate::problem::Problem;

/// How a design search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DesignStatus {
    /// At a local optimum that meets every bound.
    Converged,
    /// At rest at a point that meets every bound but, by the total gradient, is no optimum.
    NotOptimal,
    /// At the best point found when the evaluations were used up or no progress was made; it meets every bound.
    NotConverged,
    /// No design that meets every bound was found.
    BoundViolated,
    /// It was told to stop; the best point until then.
    Stopped,
}

impl std::fmt::Display for DesignStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Self::Converged => "converged",
            Self::NotOptimal => "not_optimal",
            Self::NotConverged => "not_converged",
            Self::BoundViolated => "bound_violated",
            Self::Stopped => "stopped",
        })
    }
}

/// How the search from one start went.
#[derive(Clone, Debug)]
pub struct StartSummary {
    /// All parameters where it started.
    pub from: Vec<f64>,
    /// All parameters where it ended.
    pub to: Vec<f64>,
    /// How it ended.
    pub status: DesignStatus,
    /// The objective there, nats.
    pub information: f64,
    /// Expected cost of each task there.
    pub costs: Vec<f64>,
    /// How far the worst task is above its bound, relative to it; negative below.
    pub violation: f64,
    /// First-order optimality: the largest entry of the projected Lagrangian gradient in scaled coordinates, relative
    /// to the objective's gradient.
    pub optimality: f64,
    /// Price of each task's bound: what a unit more of bound would save in nats (its Lagrange multiplier); 0 where some
    /// bound is not met.
    pub multipliers: Vec<f64>,
    /// Different local minima of the plans seen at the end, over all tasks.
    pub branches: usize,
    /// Designs evaluated.
    pub evaluations: usize,
    /// Controls of each task's plan at the end.
    pub controls: Vec<Matrices>,
    /// Why a design could not be evaluated, where that ended the search; what was found until then stands.
    pub error: Option<Error>,
}

/// The result of a design search.
#[derive(Clone, Debug)]
pub struct Design {
    /// How it ended, at its best start.
    pub status: DesignStatus,
    /// The index of the best start.
    pub best: usize,
    /// Every start that was made, in order.
    pub starts: Vec<StartSummary>,
    /// Designs evaluated, over all starts.
    pub evaluations: usize,
    /// Wall time, s.
    pub seconds: f64,
}

/// Searches for the design with the least information that meets every bound, from `phi` and from seeded random
/// starts, in parallel; the result does not depend on the number of threads.
///
/// # Errors
/// Where not even the first start can be evaluated, or total gradients are asked for along sampled plans.
pub fn design(problem: &Problem, phi: &[f64], settings: &DesignSettings, control: Control) -> Result<Design, Error> {
    if problem.planning.mode == PlanMode::Sampled && settings.gradient == GradientKind::Total {
        return Err(Error::GradientNeedsNominalPlans);
    }
    let clock = Instant::now();
    let scaling = Scaling::of(&problem.parameters);
    let run = |start: usize| {
        // The first start is always made: it is what there is to show.
        if start > 0 && control.is_stopped() {
            return None;
        }
        let from = if start == 0 { phi.to_vec() } else { random_start(&scaling, phi, settings.seed, start) };
        control.observer.observe(Event::StartBegan { start, of: settings.starts });
        let summary = run_start(problem, from, settings, (control, start));
        control.observer.observe(Event::StartEnded { start });
        Some(summary)
    };
    let starts: Vec<StartSummary> = (0..settings.starts).into_par_iter().filter_map(run).collect();
    let worse = |summary: &StartSummary| {
        let feasible = summary.violation <= settings.feasibility;
        (!feasible, if feasible { summary.information } else { summary.violation })
    };
    let best = (0..starts.len())
        .min_by(|&a, &b| worse(&starts[a]).partial_cmp(&worse(&starts[b])).unwrap_or(std::cmp::Ordering::Equal))
        .unwrap_or(0);
    if let Some(error) = starts[best].error.clone().filter(|_| starts[best].controls.is_empty()) {
        return Err(error);
    }
    let stopped = control.is_stopped();
    Ok(Design {
        status: if stopped { DesignStatus::Stopped } else { starts[best].status },
        best,
        evaluations: starts.iter().map(|summary| summary.evaluations).sum(),
        starts,
        seconds: clock.elapsed().as_secs_f64(),
    })
}

/// A random point of the box, in scaled coordinates; the stream belongs to the start.
fn random_start(scaling: &Scaling, phi: &[f64], seed: u64, start: usize) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream((1 << 32) + start as u64);
    let scaled: Vec<f64> = scaling.indices.iter().map(|_| uniform(&mut random)).collect();
    scaling.unscaled(phi, &scaled)
}

fn run_start(
    problem: &Problem,
    from: Vec<f64>,
    settings: &DesignSettings,
    (control, start): (Control, usize),
) -> StartSummary {
    let mut visitor = Visitor::new(problem, settings);
    let mut summary = StartSummary {
        to: from.clone(),
        from,
        status: DesignStatus::BoundViolated,
        information: f64::NAN,
        costs: Vec::new(),
        violation: f64::INFINITY,
        optimality: f64::NAN,
        multipliers: Vec::new(),
        branches: 0,
        evaluations: 0,
        controls: Vec::new(),
        error: None,
    };
    let mut rounds = Rounds { problem, settings, control, start, summary: &mut summary };
    if let Err(error) = rounds.run(&mut visitor) {
        summary.error = Some(error);
    }
    summary
}

/// Rounds of optimiser and branch search from one start.
struct Rounds<'a, 's> {
    problem: &'a Problem,
    settings: &'a DesignSettings,
    control: Control<'a>,
    start: usize,
    summary: &'s mut StartSummary,
}

impl<'a> Rounds<'a, '_> {
    fn run(&mut self, visitor: &mut Visitor<'a>) -> Result<(), Error> {
        let mut controls = self.first_plans()?;
        let mut phi = self.summary.from.clone();
        for round in 0..self.settings.rounds {
            visitor.restart(&phi, &controls)?;
            let control = self.control;
            let mut search = Search { visitor, control, start: self.start, evaluations: 1, error: None };
            let ending = search.run();
            self.summary.evaluations += search.evaluations;
            self.summary.error = search.error.take();
            let Some(last) = visitor.visits.last().cloned() else { break };
            let ending = ending?;
            let assessed = visitor.with_total_gradient(&last)?;
            self.record(&assessed, visitor, ending);
            if ending == Ending::Stopped || control.is_stopped() || self.settings.method == Method::Barrier {
                break;
            }
            let Some(better) = self.better_branches(&last, round) else { break };
            (phi, controls) = (last.phi, better);
        }
        Ok(())
    }

    /// The plans at the start, each the best of the task's first guesses.
    fn first_plans(&self) -> Result<Vec<Matrices>, Error> {
        let plan = |task| {
            let mut state = TaskState::new(task);
            best_of_guesses(self.problem, task, &self.summary.from, &mut state)?;
            Ok(state.plan.trajectory.controls)
        };
        self.problem.tasks.iter().map(plan).collect()
    }

    /// Searches for cheaper branches at a design; the plans to go on from, where there are any.
    fn better_branches(&mut self, at: &Visit, round: usize) -> Option<Vec<Matrices>> {
        self.summary.branches = at.tasks.len();
        if self.settings.branch_attempts == 0 {
            return None;
        }
        self.control.observer.observe(Event::SearchingBranches { start: self.start });
        let mut better = false;
        let mut count = 0;
        let tasks = self.problem.tasks.iter().zip(&at.tasks).enumerate();
        let controls = tasks.map(|(index, (task, visit))| {
            let stream = (self.start * 1000 + round * 100 + index) as u64;
            let seed = self.settings.seed ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let given = (&visit.controls, visit.cost);
            let found = search_branches((self.problem, task), &at.phi, given, (seed, self.settings.branch_attempts));
            better |= found.cost < visit.cost;
            count += found.count;
            found.controls
        });
        let controls = controls.collect();
        self.summary.branches = count;
        better.then_some(controls)
    }

    fn record(&mut self, at: &Visit, visitor: &Visitor, ending: Ending) {
        let feasible = at.is_feasible(self.settings.feasibility);
        let (optimality, multipliers) = optimality(at, self.problem, &visitor.scaling, self.settings.feasibility);
        let summary = &mut *self.summary;
        summary.status = match (feasible, ending) {
            (false, _) => DesignStatus::BoundViolated,
            (true, Ending::Stopped) => DesignStatus::Stopped,
            (true, _) if optimality <= OPTIMAL => DesignStatus::Converged,
            (true, Ending::Converged) => DesignStatus::NotOptimal,
            (true, _) => DesignStatus::NotConverged,
        };
        summary.to = at.phi.clone();
        summary.information = at.information(self.problem);
        summary.costs = at.tasks.iter().map(|task| task.cost).collect();
        summary.violation = at.violation();
        summary.optimality = optimality;
        summary.multipliers = if feasible { multipliers } else { vec![0.0; at.tasks.len()] };
        summary.controls = controls_of(at);
    }
}
