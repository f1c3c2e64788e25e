use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use supple_kernels::Matrices;

use crate::Error;
use crate::continuation::{Scaling, between, continue_plan};
use crate::gradient::Functional;
use crate::pipeline::TaskState;
use crate::problem::{Problem, Task};

/// Where a change of a task's measured information comes from, between two designs: parts that add up to it, bits (theory,
/// equation G.10).
///
/// ```
/// use supple::design::Change;
/// use supple::pipeline::TaskState;
/// # let task = r#"
/// #     model = { kind = "linear", A = [[1.0, 0.1], [0.1, 1.0]], B = [[0.0], [0.1]], C = [[1.0, 0.0]] }
/// #     parameters.variance = { initial = 1e-4, bounds = [1e-6, 1e-2], scale = "log", unit = "m^2" }
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
/// // The task of the front page.
/// let problem = supple_file::parse(task, "balance.toml")?;
/// let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
/// let mut state = TaskState::new(task);
/// state.evaluate(task, &phi, &problem.planning, None)?;
/// let nats = [state.information.total];
///
/// // To a sensor with ten times the variance.
/// state.evaluate(task, &[1e-3], &problem.planning, None)?;
/// let controls = [state.plan.trajectory.controls.clone()];
/// let change = Change { from: &phi, from_nats: &nats, to: &[1e-3], to_controls: &controls };
/// let parts = problem.split(change)?;
/// let split = &parts[0];
/// let sum = split.sensors_bits + split.uncertainty_bits + split.plan_bits + split.jumps_bits;
/// assert!(split.total_bits < 0.0 && (sum - split.total_bits).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Split {
    /// The task.
    pub task: String,
    /// The whole change.
    pub total_bits: f64,
    /// From the sensors: `C` and `V` along a trajectory held fixed.
    pub sensors_bits: f64,
    /// From the propagation of uncertainty: `A`, `W` and `X_0` along a trajectory held fixed.
    pub uncertainty_bits: f64,
    /// From changes of the plan.
    pub plan_bits: f64,
    /// From jumps between local minima: of plans along the path, and from the second design's plan, continued to the first
    /// design, to the plan of that design; plus the integration error.
    #[serde(alias = "leaps_bits")]
    pub jumps_bits: f64,
    /// Designs evaluated on the way.
    pub evaluations: usize,
}

/// Largest share of the change that the parts may leave unexplained without halving intervals: below display precision.
const LEFT: f64 = 1e-5;
/// Maximum number of intervals.
const MOST_INTERVALS: usize = 64;
/// Intervals up to this length are not halved: what remains unexplained in such a short one is a jump.
const SHORTEST: f64 = 1e-3;
/// Smallest change to which the tolerance is relative, nats.
const NOTHING: f64 = 1e-3;
/// Gauss and Legendre's nodes and weights on 0 to 1.
const NODES: [(f64, f64); 5] = [
    (0.046_910_077_030_668_0, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_6, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// From one design to another.
///
/// Example: [`Split`].
#[derive(Clone, Copy, Debug)]
pub struct Change<'a> {
    /// Parameters of the first design.
    pub from: &'a [f64],
    /// The first design's measured information, nats, for each task.
    pub from_nats: &'a [f64],
    /// Parameters of the second design.
    pub to: &'a [f64],
    /// The controls of the second design's plans, for each task; plans are continued from them along the path.
    pub to_controls: &'a [Matrices],
}

impl Problem {
    /// Splits the change of each task's measured information between two designs, along the straight path between them in
    /// the coordinates of the search.
    ///
    /// # Errors
    /// If a plan on the path cannot be computed, or has no total gradient.
    pub fn split(&self, change: Change) -> Result<Vec<Split>, Error> {
        self.split_watched(change, &|_, _| {})
    }

    /// The same, and reports progress: the index of a task, and the share of its path that is done.
    ///
    /// # Errors
    /// As [`split`](Self::split).
    pub fn split_watched(
        &self,
        Change { from, from_nats, to, to_controls }: Change,
        tell: &(dyn Fn(usize, f64) + Sync),
    ) -> Result<Vec<Split>, Error> {
        self.check_design(from)?;
        self.check_design(to)?;
        let tasks = self.tasks.par_iter().enumerate().zip(from_nats.par_iter().zip(to_controls));
        tasks
            .map(|((index, task), (&nats, controls))| {
                Path::new(self, task, from, to).split(nats, controls, &|done| tell(index, done))
            })
            .collect()
    }
}

struct Path<'a> {
    problem: &'a Problem,
    task: &'a Task,
    scaling: Scaling,
    /// Scaled coordinates of both ends, and the parameters of the first.
    ends: [Vec<f64>; 2],
    from: &'a [f64],
    to: &'a [f64],
    state: TaskState,
    /// Position of the state's plan on the path, from 0 to 1.
    place: f64,
    evaluations: usize,
}

impl<'a> Path<'a> {
    fn new(problem: &'a Problem, task: &'a Task, from: &'a [f64], to: &'a [f64]) -> Self {
        let scaling = Scaling::of(&problem.parameters);
        let ends = [scaling.scaled(from), scaling.scaled(to)];
        Self { problem, task, scaling, ends, from, to, state: TaskState::new(task), place: 1.0, evaluations: 0 }
    }

    /// Parameters at a place of the path.
    fn at(&self, place: f64) -> Vec<f64> {
        match place {
            0.0 => self.from.to_vec(),
            1.0 => self.to.to_vec(),
            _ => self.scaling.unscaled(self.from, &between(&self.ends[0], &self.ends[1], place)),
        }
    }

    /// Continues the plan to a position on the path; returns the information there, nats.
    fn go(&mut self, place: f64) -> Result<f64, Error> {
        let (here, there) = (self.at(self.place), self.at(place));
        let controls = self.state.plan.trajectory.controls.clone();
        continue_plan((self.problem, self.task), &self.scaling, (&here, &there), (&controls, 1), &mut self.state)
            .map_err(|failed| failed.explain(self.task, &self.state))?;
        self.place = place;
        self.evaluations += 1;
        Ok(self.state.information.total)
    }

    /// Slopes of the parts along the path at the current position: sensors, uncertainty, plan.
    fn slopes(&mut self) -> Result<[f64; 3], Error> {
        let phi = self.at(self.place);
        let mut total = Vec::new();
        self.state.total_gradient(self.task, &phi, Functional::INFORMATION, &mut total)?;
        let [sensors, uncertainty] = self.state.information_at_rest(self.task, &phi);
        let ends = (&self.ends[0][..], &self.ends[1][..]);
        let [total, sensors, uncertainty] =
            [&total, &sensors, &uncertainty].map(|gradient| self.scaling.slope_along(ends, &phi, gradient));
        Ok([sensors, uncertainty, total - sensors - uncertainty])
    }

    /// `first` is the information of the plan at the first design, nats, and `controls` are those of the plan at the second.
    fn split(mut self, first: f64, controls: &Matrices, tell: &dyn Fn(f64)) -> Result<Split, Error> {
        self.state.evaluate(self.task, self.to, &self.problem.planning, Some(controls))?;
        let end = self.state.information.total;
        let total = end - first;
        let (mut parts, mut left) = ([0.0; 3], end);
        // From the end to the start, in intervals, each halved until its parts add up.
        let mut intervals = vec![(0.0, 1.0)];
        let mut count = 0;
        while let Some((start, stop)) = intervals.pop() {
            let kept = (self.state.plan.trajectory.controls.clone(), self.place);
            let mut found = [0.0; 3];
            for (node, weight) in NODES.iter().rev() {
                self.go(start + node * (stop - start))?;
                let slopes = self.slopes()?;
                found.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += weight * (stop - start) * slope);
            }
            let information = self.go(start)?;
            let missed = (left - information - found.iter().sum::<f64>()).abs();
            count += 1;
            let much = missed > LEFT * (stop - start) * total.abs().max(NOTHING);
            if much && stop - start > SHORTEST && count + intervals.len() < MOST_INTERVALS {
                let middle = 0.5 * (start + stop);
                intervals.extend([(start, middle), (middle, stop)]);
                let (controls, place) = kept;
                self.state.plan_only(self.task, &self.at(place), &self.problem.planning, Some(&controls))?;
                self.place = place;
                continue;
            }
            parts.iter_mut().zip(found).for_each(|(sum, part)| *sum += part);
            left = information;
            tell(1.0 - start);
        }
        let bits = |nats: f64| nats / std::f64::consts::LN_2;
        Ok(Split {
            task: self.task.name.clone(),
            total_bits: bits(total),
            sensors_bits: bits(parts[0]),
            uncertainty_bits: bits(parts[1]),
            plan_bits: bits(parts[2]),
            jumps_bits: bits(total - parts.iter().sum::<f64>()),
            evaluations: self.evaluations,
        })
    }
}
