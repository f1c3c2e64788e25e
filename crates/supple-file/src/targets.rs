//! Targets of costs, and limits of tasks, where the robot cannot be: probably numbers in another unit.

use supple::Task;
use supple_model::Limited;
use supple_model::cost::Cost;
use supple_model::followed::Followed;
use supple_model::quantity::{FramePoint, JointPosition};
use supple_text::{degrees, digits};

/// Distance of a target from where a frame starts, m, from which it is probably not in m.
const FAR: f64 = 50.0;
/// How many times further than a range of positions in m a limit is, if it is probably not in m.
const TIMES: f64 = 50.0;
const METRES: &str = "lengths are in m";

/// The range of a state, and what it is.
struct Range {
    name: String,
    is_angle: bool,
    lower: f64,
    upper: f64,
}

impl Range {
    /// The range that a model gives a state.
    fn of(task: &Task, state: usize) -> Option<Self> {
        let limit = task.system.limits().into_iter().find(|limit| limit.of == Limited::State(state))?;
        let is_angle = task.system.channels().states.get(state).is_some_and(|channel| channel.unit == "rad");
        Some(Self { name: limit.name, is_angle, lower: limit.lower, upper: limit.upper })
    }

    fn excludes(&self, at: f64) -> bool {
        let tolerance = 1e-9 * (1.0 + at.abs());
        at < self.lower - tolerance || at > self.upper + tolerance
    }

    /// Whether a limit is so far outside that its unit is probably another one.
    fn is_far_from(&self, limit: f64) -> bool {
        let size = self.lower.abs().max(self.upper.abs());
        let far = if self.is_angle { degrees(limit).is_some() } else { limit.abs() > TIMES * size };
        limit.is_finite() && self.excludes(limit) && far
    }

    /// The end of a message about a number outside the range.
    fn outside(&self, what: &str, at: f64) -> String {
        let Self { name, lower, upper, .. } = self;
        let advice = if self.is_angle { degrees(at) } else { Some(METRES.to_owned()) };
        let advice = advice.map_or_else(String::new, |advice| format!(" ({advice})"));
        format!("{what} of {name}, {}, is outside its range [{lower}, {upper}]{advice}", digits(at))
    }
}

/// What to say of the targets of a task's costs and of its limits, at `phi`.
pub(super) fn out_of_reach(task: &Task, costs: &[Cost], followed: &[Followed], phi: &[f64]) -> Vec<String> {
    let mut messages = Vec::new();
    for (index, cost) in costs.iter().enumerate() {
        if cost.stage.are_zero_at(phi) && cost.last.are_zero_at(phi) {
            continue;
        }
        let mut say = |message: String| {
            let kind = cost.quantity.name();
            messages.push(format!("task `{}`: cost {} ({kind}): {message}", task.name, index + 1));
        };
        let targets: Vec<f64> = cost.targets.iter().map(|target| target.resolve(phi)).collect();
        if let Some(positions) = cost.quantity.as_kind::<JointPosition>() {
            for (&state, &target) in positions.states().iter().zip(&targets) {
                let range = Range::of(task, state).filter(|range| range.excludes(target));
                range.into_iter().for_each(|range| say(range.outside("the target", target)));
            }
        } else if cost.quantity.as_kind::<FramePoint>().is_some() && targets.iter().any(|target| target.abs() > FAR) {
            let (start, starts) = starts(task, index, phi);
            let away = start.iter().zip(&targets).map(|(from, to)| (to - from).powi(2)).sum::<f64>().sqrt();
            if away > FAR {
                let away = digits(away.round());
                say(format!("its target is {away} m from where the frame starts, at {starts} m ({METRES})"));
            }
        }
    }
    let of_task = followed.iter().filter(|limit| !limit.is_of_model);
    let limits = of_task.filter_map(|limit| Some((&limit.quantity, limit.limits.as_ref()?)));
    for (index, (quantity, [lower, upper])) in limits.enumerate() {
        let Some(positions) = quantity.as_kind::<JointPosition>() else { continue };
        for ((&state, lower), upper) in positions.states().iter().zip(lower).zip(upper) {
            let Some(range) = Range::of(task, state) else { continue };
            let ends = [lower, upper].map(|end| end.resolve::<f64>(phi));
            if let Some(&end) = ends.iter().find(|&&end| range.is_far_from(end)) {
                let (task, number, kind) = (&task.name, index + 1, quantity.name());
                messages.push(format!("task `{task}`: limit {number} ({kind}): {}", range.outside("the limit", end)));
            }
        }
    }
    messages
}

/// The numbers of the cost at an index at the start, and as text.
fn starts(task: &Task, cost: usize, phi: &[f64]) -> (Vec<f64>, String) {
    let x: Vec<f64> = task.initial_state.iter().map(|value| value.resolve(phi)).collect();
    let u = vec![0.0; task.system.dimensions().controls];
    let (of, values) = (format!("cost {}", cost + 1), task.system.follow(&x, &u, phi));
    let numbers = task.system.followed(phi).into_iter().zip(values);
    let start: Vec<f64> = numbers.filter(|(number, _)| number.of == of).map(|(_, value)| value).collect();
    let shown: Vec<_> = start.iter().map(|value| digits((value * 1e3).round() * 1e-3)).collect();
    (start, shown.join(", "))
}
