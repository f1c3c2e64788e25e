//! Numbers that a robot or a task limits, along plans.

use supple_kernels::{Matrices, Scratch};
use supple_model::limits::{LimitViolation, violations};
use supple_model::system::{Points, Times};
use supple_model::{Channel, Limited, Trajectory};

use crate::problem::TaskAt;

/// A number with limits.
#[derive(Clone, Debug)]
pub(crate) struct LimitedNumber {
    /// Its name in messages, and its unit.
    pub channel: Channel,
    /// Its lower and upper limit; infinite on a side without a limit.
    pub limits: [f64; 2],
    pub of: Of,
    /// Its values along the plan: one per state, or one per step where it depends on the control.
    pub planned: Vec<f64>,
    /// Whether the task sets the limits, and not the robot's file.
    pub is_of_task: bool,
}

/// What a number is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Of {
    State(usize),
    Control(usize),
    /// A quantity, by its place among those that are limited.
    Quantity {
        place: usize,
        depends_on_control: bool,
    },
}

impl LimitedNumber {
    /// Those of a task along a plan: states and controls that the robot limits, then quantities that robot and task do. A limit
    /// that is given twice counts once.
    pub fn all(TaskAt { task, phi }: TaskAt, plan: &Trajectory) -> Vec<Self> {
        let system = &*task.system;
        let channels = system.channels();
        let along = |values: &Matrices, index: usize| {
            (0..values.count()).map(|step| values.vector(step)[index]).collect::<Vec<f64>>()
        };
        let of_robot = system.limits().into_iter().map(|limit| {
            let (of, channel, planned) = match limit.of {
                Limited::State(i) => (Of::State(i), channels.states.get(i), along(&plan.states, i)),
                Limited::Control(i) => (Of::Control(i), channels.controls.get(i), along(&plan.controls, i)),
            };
            let channel = Channel::new(limit.name, channel.map_or("", |channel| &channel.unit));
            Self { channel, limits: [limit.lower, limit.upper], of, planned, is_of_task: false }
        });
        let mut all: Vec<Self> = of_robot.collect();
        let numbers: Vec<_> = system.followed(phi).into_iter().filter(|number| number.is_limited()).collect();
        if numbers.is_empty() {
            return all;
        }
        let mut values = Matrices::vectors(plan.states.count(), numbers.len());
        let controls = with_last(&plan.controls);
        let stages = plan.states.count();
        let at = Points { states: &plan.states, controls: &controls, stages, has_end: false, times: Times::From(0) };
        system.follow_limited(1, at, phi, &mut values, &mut Scratch::new());
        for (place, number) in numbers.into_iter().enumerate() {
            let depends_on_control = number.depends_on_control;
            let mut planned = along(&values, place);
            planned.truncate(if depends_on_control { plan.steps() } else { stages });
            let is_known = |known: &Self| known.limits == number.limits && known.planned == planned;
            if !all.iter().any(is_known) {
                let of = Of::Quantity { place, depends_on_control };
                let is_of_task = !number.is_of_model();
                all.push(Self { channel: number.channel, limits: number.limits, of, planned, is_of_task });
            }
        }
        all
    }

    /// Where it leaves its limits along the plan.
    pub fn violations(&self) -> Vec<LimitViolation> {
        let found = violations(&self.channel, self.limits, &self.planned).into_iter();
        found.map(|violation| LimitViolation { is_of_task: self.is_of_task, ..violation }).collect()
    }
}

/// Controls with one more of zeros, for the final state.
fn with_last(controls: &Matrices) -> Matrices {
    let mut all = Matrices::vectors(controls.count() + 1, controls.cols());
    (0..controls.count()).for_each(|step| all.vector_mut(step).copy_from_slice(controls.vector(step)));
    all
}
