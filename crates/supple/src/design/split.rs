use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use supple_kernels::Matrices;

use crate::Error;
use crate::continuation::{Continuation, Neighbour, Scaling, between};
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

/// Largest share of the change that the parts may leave unexplained: below display precision.
const LEFT: f64 = 1e-5;
/// The numbers of subdivisions of an interval that are tried one after the other: each has all nodes of the one before.
const SUBDIVISIONS: [usize; 5] = [4, 8, 16, 32, MOST];
const MOST: usize = 64;
/// An interval is halved if a subdivision leaves more than this share of what the one before left unexplained.
const FEWER: f64 = 0.8;
/// Each part may differ by this many tolerances from that of half as many nodes, whose error is far greater.
const SETTLED: f64 = 100.0;
/// Maximum number of designs evaluated before intervals are no longer subdivided.
const MOST_EVALUATIONS: usize = 400;
/// Intervals up to this length are not halved: what remains unexplained in such a short one is a jump.
const SHORTEST: f64 = 1e-3;
/// Smallest change to which the tolerance is relative, nats.
const NOTHING: f64 = 1e-3;

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

/// Place of a node between 0 and 1, the extrema of a Chebyshev polynomial: for a subdivision into n intervals, those
/// whose numbers are multiples of [`MOST`] / n.
fn node(number: usize) -> f64 {
    0.5 * (1.0 - (std::f64::consts::PI * number as f64 / MOST as f64).cos())
}

/// Clenshaw and Curtis' weights of the n + 1 nodes of a subdivision into n intervals, on 0 to 1; n is even.
fn weights(n: usize) -> Vec<f64> {
    let weight = |j: usize| {
        let term = |k: usize| {
            let cosine = (2.0 * std::f64::consts::PI * (k * j) as f64 / n as f64).cos();
            let twice = if 2 * k == n { 1.0 } else { 2.0 };
            twice * cosine / (4 * k * k - 1) as f64
        };
        let own = if j == 0 || j == n { 0.5 } else { 1.0 };
        own / n as f64 * (1.0 - (1..=n / 2).map(term).sum::<f64>())
    };
    (0..=n).map(weight).collect()
}

/// What is known at a place of the path.
#[derive(Clone)]
struct Known {
    place: f64,
    /// nats
    information: f64,
    /// Slopes of the parts along the path: sensors, uncertainty, plan.
    slopes: [f64; 3],
    plan: Neighbour,
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
    evaluations: usize,
}

impl<'a> Path<'a> {
    fn new(problem: &'a Problem, task: &'a Task, from: &'a [f64], to: &'a [f64]) -> Self {
        let scaling = Scaling::of(&problem.parameters);
        let ends = [scaling.scaled(from), scaling.scaled(to)];
        Self { problem, task, scaling, ends, from, to, state: TaskState::new(task), evaluations: 0 }
    }

    /// Parameters at a place of the path.
    fn at(&self, place: f64) -> Vec<f64> {
        match place {
            0.0 => self.from.to_vec(),
            1.0 => self.to.to_vec(),
            _ => self.scaling.unscaled(self.from, &between(&self.ends[0], &self.ends[1], place)),
        }
    }

    /// What is known at a place, which is that of the state's plan.
    fn look(&mut self, place: f64) -> Result<Known, Error> {
        let phi = self.at(place);
        let mut total = Vec::new();
        self.state.total_gradient(self.task, &phi, Functional::INFORMATION, &mut total)?;
        let [sensors, uncertainty] = self.state.information_at_rest(self.task, &phi);
        let [start, end] = &self.ends;
        let [total, sensors, uncertainty] =
            [&total, &sensors, &uncertainty].map(|gradient| self.scaling.slope_along(start, end, &phi, gradient));
        let slopes = [sensors, uncertainty, total - sensors - uncertainty];
        self.evaluations += 1;
        let plan = Neighbour::of(&self.state.plan);
        Ok(Known { place, information: self.state.information.total, slopes, plan })
    }

    /// The same at another place, to which the plan is continued.
    fn go(&mut self, from: &Known, place: f64) -> Result<Known, Error> {
        let (here, there) = (self.at(from.place), self.at(place));
        let Self { problem, task, scaling, state, .. } = self;
        let line = Continuation { settings: &problem.planning, task, scaling, from: &here, to: &there, finer: 1 };
        line.plan(&from.plan, state).map_err(|failed| failed.explain(task, state))?;
        self.look(place)
    }

    /// The parts over the interval from `start` to where `last` is, and what is known at its start; `None` if the interval
    /// has to be halved, as more nodes do not help. Calls `tell` with the share of the interval that is done.
    fn integrate(
        &mut self,
        start: f64,
        last: &Known,
        tolerance: f64,
        tell: &dyn Fn(f64),
    ) -> Result<Option<([f64; 3], Known)>, Error> {
        let length = last.place - start;
        let mut known: Vec<Option<Known>> = vec![None; MOST + 1];
        known[MOST] = Some(last.clone());
        let (mut before, mut earlier) = (f64::INFINITY, [f64::INFINITY; 3]);
        for subdivision in SUBDIVISIONS {
            let stride = MOST / subdivision;
            let mut parts = [0.0; 3];
            for (j, weight) in weights(subdivision).into_iter().enumerate().rev() {
                let number = j * stride;
                if known[number].is_none() {
                    let place = if j == 0 { start } else { start + length * node(number) };
                    let above = known[number + stride].as_ref().unwrap_or(last);
                    known[number] = Some(self.go(above, place)?);
                }
                let slopes = known[number].as_ref().map_or([f64::NAN; 3], |here| here.slopes);
                parts.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += weight * length * slope);
            }
            tell(subdivision as f64 / (2 * MOST) as f64);
            let Some(first) = &known[0] else { break };
            let missed = (last.information - first.information - parts.iter().sum::<f64>()).abs();
            let moved = parts.iter().zip(earlier).map(|(part, before)| (part - before).abs()).fold(0.0, f64::max);
            let add_up = missed <= tolerance * length && moved <= SETTLED * tolerance * length;
            if add_up || length <= SHORTEST || self.evaluations >= MOST_EVALUATIONS {
                return Ok(Some((parts, first.clone())));
            }
            if missed > FEWER * before {
                break;
            }
            (before, earlier) = (missed, parts);
        }
        Ok(None)
    }

    /// `first` is the information of the plan at the first design, nats, and `controls` are those of the plan at the second.
    fn split(mut self, first: f64, controls: &Matrices, tell: &dyn Fn(f64)) -> Result<Split, Error> {
        self.state.evaluate(self.task, self.to, &self.problem.planning, Some(controls))?;
        let mut last = self.look(1.0)?;
        let total = last.information - first;
        let tolerance = LEFT * total.abs().max(NOTHING);
        let mut parts = [0.0; 3];
        // From the second design to the first, in intervals, each halved until its parts add up.
        let mut starts = vec![0.0];
        while let Some(&start) = starts.last() {
            let (length, done) = (last.place - start, 1.0 - last.place);
            let tell_share = |share: f64| tell(done + share * length);
            match self.integrate(start, &last, tolerance, &tell_share)? {
                Some((found, at_start)) => {
                    parts.iter_mut().zip(found).for_each(|(sum, part)| *sum += part);
                    last = at_start;
                    starts.pop();
                    tell(1.0 - start);
                }
                None => starts.push(start + 0.5 * length),
            }
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

#[cfg(test)]
mod tests {
    use super::{MOST, SUBDIVISIONS, node, weights};

    #[test]
    fn subdivisions_integrate_polynomials() {
        for n in SUBDIVISIONS {
            // The integral of x^k from 0 to 1.
            for power in [0, 1, 3, 5] {
                let nodes = (0..=n).map(|j| node(j * MOST / n).powi(power));
                let sum: f64 = weights(n).into_iter().zip(nodes).map(|(weight, value)| weight * value).sum();
                assert!((sum - 1.0 / f64::from(power + 1)).abs() < 1e-14, "{n} {power}: {sum}");
            }
        }
    }
}
