use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use supple::Matrices;
use supple::lqg::Noise;
use supple::simulate::{Rollouts, World, Worlds, sampled_costs};

use super::plan::{Planned, plan_anew};
use super::report::{PlannedFor, RobustCell, RobustnessOptions, STOPPED};
use super::statistics::{half_width, mean_and_deviation, quantile};
use crate::journal::Parts;
use crate::{LoadedTask, StudyError, Watch};

/// A cell of the study, with the cost of every roll-out where comparisons need them.
///
/// Example: the [module](crate::robustness).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Costs {
    pub(super) cell: RobustCell,
    pub(super) costs: Vec<f64>,
}

/// Which quantiles are kept.
const QUANTILES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// How many times the expected cost a roll-out may cost before it counts as diverged.
const RUNAWAY: f64 = 1e6;

/// By how much, at least 1, the largest variances of one noise exceed those of another.
fn growth(nominal: &Noise, truth: &Noise) -> f64 {
    let largest = |of: &Matrices| of.as_slice().iter().fold(0.0, |most: f64, entry| most.max(entry.abs()));
    let pairs = [
        (&nominal.initial, &truth.initial),
        (&nominal.process, &truth.process),
        (&nominal.measurement, &truth.measurement),
    ];
    let ratios = pairs.map(|(from, to)| if largest(from) > 0.0 { largest(to) / largest(from) } else { 1.0 });
    ratios.into_iter().fold(1.0, f64::max)
}

/// Rolls out every design in every task, planning and level, in this order of nesting; and how many of them were computed
/// before it was told to stop.
///
/// # Errors
/// Where the journal cannot be written, or what it holds cannot be read.
pub(super) fn sample_all(
    task: &LoadedTask,
    planned: &[Planned],
    options: &RobustnessOptions,
    varied: usize,
    parts: &Parts,
    watch: Watch,
) -> Result<(Vec<Costs>, usize), StudyError> {
    let done = AtomicUsize::new(0);
    let sample = |number: usize| {
        let at = Place::of(number, task, options);
        let costs = || Ok(at.costs(task, &planned[at.design], options, varied));
        match parts.part(&format!("cost {number}"), watch, costs) {
            Err(StudyError::Stopped) => Ok(at.stopped()),
            other => {
                let costs = other?;
                watch.progress.advance(1);
                done.fetch_add(1, Ordering::Relaxed);
                Ok(costs)
            }
        }
    };
    let costs = (0..cells(task, options)).into_par_iter().map(sample).collect::<Result<_, StudyError>>()?;
    Ok((costs, done.into_inner()))
}

/// How many cells there are.
pub(super) fn cells(task: &LoadedTask, options: &RobustnessOptions) -> usize {
    options.designs.len() * task.problem.tasks.len() * 2 * options.vary.values.len()
}

/// Indices of the least and the greatest of some values.
pub(super) fn extremes(values: &[f64]) -> [usize; 2] {
    let by_value = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
    [(0..values.len()).min_by(by_value).unwrap_or(0), (0..values.len()).max_by(by_value).unwrap_or(0)]
}

/// Where a cell is.
pub(super) struct Place {
    pub design: usize,
    task: usize,
    planned_for: PlannedFor,
    level: usize,
    /// The value of the varied parameter.
    value: f64,
}

impl Place {
    /// The place of the cell with this number.
    pub fn of(number: usize, task: &LoadedTask, options: &RobustnessOptions) -> Self {
        let levels = options.vary.values.len();
        let tasks = task.problem.tasks.len();
        let level = number % levels;
        Self {
            design: number / levels / 2 / tasks,
            task: number / levels / 2 % tasks,
            planned_for: [PlannedFor::Nominal, PlannedFor::Truth][number / levels % 2],
            level,
            value: options.vary.values[level],
        }
    }

    /// The cell, with the cost of every roll-out where comparisons need them: at the least and the greatest level.
    pub fn costs(&self, task: &LoadedTask, design: &Planned, options: &RobustnessOptions, varied: usize) -> Costs {
        let sampled = self.sample(task, design, options, varied);
        let mut costs = self.summarise(sampled.map_err(|error| error.to_string()));
        if !extremes(&options.vary.values).contains(&self.level) {
            costs.costs = Vec::new();
        }
        costs
    }

    /// The cost of every roll-out, and the expected cost where the controller is planned for the truth.
    fn sample(
        &self,
        loaded: &LoadedTask,
        design: &Planned,
        options: &RobustnessOptions,
        varied: usize,
    ) -> Result<(Vec<f64>, Option<f64>), supple::Error> {
        let problem = &loaded.problem;
        let task = &problem.tasks[self.task];
        // What costs a million times as much as expected has diverged, and is finite only because the task ends.
        let diverged = |costs: &mut [f64], expected: f64| {
            let most = RUNAWAY * expected.abs();
            costs.iter_mut().filter(|cost| most > 0.0 && cost.abs() > most).for_each(|cost| *cost = f64::INFINITY);
        };
        let nominal = &design.states[self.task];
        let mut phi = design.phi.clone();
        phi[varied] = self.value;
        let rollouts = Rollouts { count: options.rollouts, seed: options.seed };
        match self.planned_for {
            PlannedFor::Nominal => {
                let mut noise: Noise = nominal.noise.clone();
                task.noise.resolve(&phi, &mut noise)?;
                let believed = World { phi: &design.phi, noise: &nominal.noise };
                let truth = World { phi: &phi, noise: &noise };
                let mut costs = sampled_costs(task, &nominal.plan, Worlds { believed, truth }, rollouts)?;
                diverged(&mut costs, nominal.cost.expected() * growth(&nominal.noise, &noise));
                Ok((costs, None))
            }
            PlannedFor::Truth => {
                let state = plan_anew(problem, design, self.task, &phi, varied)?;
                let world = World { phi: &phi, noise: &state.noise };
                let mut costs = sampled_costs(task, &state.plan, Worlds::same(world), rollouts)?;
                diverged(&mut costs, state.cost.expected());
                Ok((costs, Some(state.cost.expected())))
            }
        }
    }

    /// The cell of a study that was stopped before it.
    fn stopped(&self) -> Costs {
        self.summarise(Err(STOPPED.to_owned()))
    }

    fn summarise(&self, sampled: Result<(Vec<f64>, Option<f64>), String>) -> Costs {
        let (costs, expected, error) = match sampled {
            Ok((costs, expected)) => (costs, expected, None),
            Err(error) => (Vec::new(), None, Some(error)),
        };
        let (mean, deviation) = mean_and_deviation(&costs);
        let mut sorted = costs.clone();
        sorted.sort_by(f64::total_cmp);
        let cell = RobustCell {
            design: self.design,
            task: self.task,
            planned_for: self.planned_for,
            level: self.level,
            mean,
            deviation,
            half_width_95: half_width(deviation, costs.len()),
            quantiles: QUANTILES.map(|share| quantile(&sorted, share)),
            diverged: costs.iter().filter(|cost| !cost.is_finite()).count(),
            expected,
            error,
        };
        Costs { cell, costs }
    }
}
