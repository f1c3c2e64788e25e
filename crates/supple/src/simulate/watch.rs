//! Limits along roll-outs.

use serde::{Deserialize, Serialize};
use supple_kernels::{Matrices, Scratch};
use supple_model::limits::LIMIT_TOLERANCE;
use supple_model::system::Points;
use supple_model::{Trajectory, or_nan};

use super::truth::Truth;
use crate::limited::{LimitedNumber, Of};
use crate::problem::TaskAt;

/// A limit along roll-outs. Plans keep their limits without noise; a robot, and roll-outs, leave them by chance.
///
/// On the task's own steps it is looked at where these begin and end, on finer steps at each of these.
///
/// Example: [`MonteCarlo`](super::MonteCarlo).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct LimitShare {
    /// What is limited.
    pub name: String,
    /// Its unit; empty where there is none.
    #[serde(default)]
    pub unit: String,
    /// The limit.
    pub limit: f64,
    /// Whether it is an upper limit; otherwise it is a lower one.
    pub upper: bool,
    /// Its least and greatest value along the plan.
    pub planned: [f64; 2],
    /// Half of the roll-outs go at least as far as this towards the limit, or beyond.
    #[serde(deserialize_with = "or_nan")]
    pub median: f64,
    /// How far the worst roll-out goes.
    #[serde(deserialize_with = "or_nan")]
    pub worst: f64,
    /// Share of the roll-outs that are ever beyond it.
    pub share: f64,
    /// Share of the time that roll-outs are beyond it, on average.
    pub share_of_time: f64,
}

impl LimitShare {
    /// How far a value is beyond the limit, in the size of the limit or of the plan's values; negative within.
    #[must_use]
    pub fn beyond(&self, value: f64) -> f64 {
        let excess = if self.upper { value - self.limit } else { self.limit - value };
        let size = self.planned.iter().fold(self.limit.abs(), |size, value| size.max(value.abs()));
        excess / size
    }

    /// Of several limits that the plan keeps, the one that half of the roll-outs are furthest beyond, by more than a tenth of
    /// its [size](Self::beyond); `None` if there is none.
    pub fn furthest<'a>(limits: impl Iterator<Item = &'a Self>) -> Option<&'a Self> {
        let left = limits.filter(|limit| limit.is_kept_by_plan() && limit.beyond(limit.median) > TOLERATED);
        left.max_by(|one, other| one.beyond(one.median).total_cmp(&other.beyond(other.median)))
    }

    /// Whether the plan keeps it.
    #[must_use]
    pub fn is_kept_by_plan(&self) -> bool {
        let excess = if self.upper { self.planned[1] - self.limit } else { self.limit - self.planned[0] };
        excess <= tolerance(self.limit)
    }
}

/// How far roll-outs may be beyond a limit without a word, relative to its size.
const TOLERATED: f64 = 0.1;

/// How far outside a limit a number may be, for rounding.
fn tolerance(limit: f64) -> f64 {
    LIMIT_TOLERANCE * (1.0 + limit.abs())
}

/// How far a roll-out goes beyond one side of a limit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// The greatest excess; negative within the limit.
    pub most: f64,
    /// How often it was beyond, of the times it was looked at.
    pub beyond: u32,
}

/// What roll-outs are looked at for.
#[derive(Debug)]
pub(crate) struct Watch {
    numbers: Vec<LimitedNumber>,
    /// Sides of their limits: the number, the limit, whether it is the upper one.
    sides: Vec<(usize, f64, bool)>,
    /// How many of the numbers are quantities.
    quantities: usize,
}

impl Watch {
    /// All limits of a task, along its plan.
    pub fn of(task: TaskAt, plan: &Trajectory) -> Self {
        let numbers = LimitedNumber::all(task, plan);
        let of_number = |(index, number): (usize, &LimitedNumber)| {
            let [lower, upper] = number.limits;
            [(index, upper, true), (index, lower, false)].into_iter().filter(|(_, limit, _)| limit.is_finite())
        };
        let sides = numbers.iter().enumerate().flat_map(of_number).collect();
        let quantities = task.task.system.followed(task.phi).iter().filter(|number| number.is_limited()).count();
        Self { numbers, sides, quantities }
    }

    /// The same where the plan is that of another system, which is watched by `own`.
    pub fn planned_by(mut self, own: &Self) -> Self {
        for number in &mut self.numbers {
            if let Some(own) = own.numbers.iter().find(|own| own.channel.name == number.channel.name) {
                number.planned.clone_from(&own.planned);
            }
        }
        self
    }

    /// What every roll-out starts from.
    pub fn start(&self) -> Vec<Reach> {
        vec![Reach { most: f64::NEG_INFINITY, beyond: 0 }; self.sides.len()]
    }

    /// Looks at all samples at their states under their controls, which are none at the end; each step is taken in
    /// `parts`.
    pub fn look<'r>(
        &self,
        Truth { system, phi, .. }: Truth,
        parts: usize,
        at: Points,
        is_end: bool,
        reached: impl Iterator<Item = &'r mut [Reach]>,
        scratch: &mut Scratch,
    ) {
        let Points { states, controls, stages, .. } = at;
        let mut quantities = Matrices::vectors(stages, self.quantities);
        if self.numbers.iter().any(|number| matches!(number.of, Of::Quantity { .. })) {
            system.follow_limited(parts, at, phi, &mut quantities, scratch);
        }
        for (sample, reached) in reached.enumerate() {
            for (&(number, limit, upper), reach) in self.sides.iter().zip(reached) {
                let value = match self.numbers[number].of {
                    Of::State(index) => states.vector(sample)[index],
                    Of::Control(_) | Of::Quantity { depends_on_control: true, .. } if is_end => continue,
                    Of::Control(index) => controls.vector(sample)[index],
                    Of::Quantity { place, .. } => quantities.vector(sample)[place],
                };
                let excess = if upper { value - limit } else { limit - value };
                reach.most = reach.most.max(excess);
                reach.beyond += u32::from(excess > tolerance(limit));
            }
        }
    }

    /// Statistics of roll-outs that were looked at `looks` times each.
    pub fn shares(&self, reached: &[&[Reach]], looks: usize) -> Vec<LimitShare> {
        let count = reached.len() as f64;
        let of_side = |(side, &(number, limit, upper)): (usize, &(usize, f64, bool))| {
            let LimitedNumber { channel, planned, .. } = &self.numbers[number];
            let reaches = || reached.iter().map(|reached| reached[side]);
            let mut most: Vec<f64> = reaches().map(|reach| reach.most).collect();
            most.sort_by(f64::total_cmp);
            let value = |excess: f64| if upper { limit + excess } else { limit - excess };
            let least = planned.iter().copied().fold(f64::INFINITY, f64::min);
            let greatest = planned.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            LimitShare {
                name: channel.name.clone(),
                unit: channel.unit.clone(),
                limit,
                upper,
                planned: [least, greatest],
                median: value(most[(most.len() - 1) / 2]),
                worst: value(most[most.len() - 1]),
                share: reaches().filter(|reach| reach.beyond > 0).count() as f64 / count,
                share_of_time: reaches().map(|reach| f64::from(reach.beyond)).sum::<f64>() / (count * looks as f64),
            }
        };
        self.sides.iter().enumerate().map(of_side).collect()
    }
}
