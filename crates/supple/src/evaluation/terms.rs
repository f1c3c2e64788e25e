use serde::{Deserialize, Serialize};
use supple_model::Trajectory;
use supple_model::cost::Target;

use super::curves::CostCurve;
use crate::problem::TaskAt;

/// Share of the nominal cost from which a term's targets of 0 count as missed: those of smaller ones only keep numbers small.
const LARGE: f64 = 0.1;
/// Share of the way to its target that a number has to cover, or it misses it.
const COVERED: f64 = 0.5;
/// Numbers that start closer to their target than this share of it are to stay there.
const NEAR: f64 = 0.05;
/// Up to this count, all numbers of a term are shown.
const FEW: usize = 3;

/// A term of the cost along a plan: what it costs, and what became of the numbers that it weighs.
///
/// ```
/// use supple::EvaluateOptions;
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/wiping_arm.toml");
/// let problem = supple_file::load(file)?;
/// let found = problem.evaluate(&problem.parameters.initial(), &EvaluateOptions::default())?;
/// let cost = &found.tasks[0].cost;
/// let sum: f64 = cost.terms.iter().map(|term| term.stages + term.last).sum();
/// assert!((sum - cost.parts.nominal).abs() < 1e-9 * sum, "the terms add up to the nominal cost");
/// assert_eq!(cost.missed_targets().count(), 0, "the pad wipes along its way and presses");
///
/// let force = cost.terms.iter().flat_map(|term| &term.targets).find(|number| number.unit == "N");
/// let force = force.ok_or("a cost wants a force")?;
/// assert_eq!((force.target, force.in_final_cost), (5.0, true));
/// assert!((force.mean - 5.0).abs() < 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CostTerm {
    /// Its place among the task's costs, from 1, and its kind: `2 contact_force`.
    pub name: String,
    /// Its nominal cost in stages 0 to N - 1.
    pub stages: f64,
    /// Its nominal cost at the end.
    pub last: f64,
    /// The numbers that it weighs; empty if they are not known.
    #[serde(default)]
    pub targets: Vec<TargetReport>,
}

/// A number that a cost weighs, along the plan without noise.
///
/// Example: [`CostTerm`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TargetReport {
    /// Its name.
    pub name: String,
    /// Its unit; empty where there is none.
    #[serde(default)]
    pub unit: String,
    /// What it should be.
    pub target: f64,
    /// At step 0.
    pub start: f64,
    /// Mean over all steps.
    pub mean: f64,
    /// At the end: at step N, or N - 1 if it depends on the control.
    pub end: f64,
    /// Whether the final cost weighs it.
    pub in_final_cost: bool,
}

impl TargetReport {
    /// How far it is from its target at the end.
    #[must_use]
    pub fn off(&self) -> f64 {
        (self.end - self.target).abs()
    }

    /// The share of the way from its start to its target that it covers; negative if it moves away, `None` if it starts there.
    #[must_use]
    pub fn covered(&self) -> Option<f64> {
        let way = (self.start - self.target).abs();
        (way > 0.0).then(|| 1.0 - self.off() / way)
    }
}

impl CostTerm {
    /// Its cost in stages and at the end.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.stages + self.last
    }

    /// The numbers worth a row each: all if these are few, or else the one that ends farthest from its target.
    #[must_use]
    pub fn shown(&self) -> Vec<&TargetReport> {
        if self.targets.len() <= FEW {
            return self.targets.iter().collect();
        }
        self.targets.iter().max_by(|one, other| one.off().total_cmp(&other.off())).into_iter().collect()
    }

    /// The numbers that end less than half of the way to their targets, though the final cost weighs them.
    pub(super) fn missed(&self, nominal: f64) -> impl Iterator<Item = &TargetReport> {
        let is_large = self.share(nominal).is_some_and(|share| share > LARGE);
        let counts = move |number: &&TargetReport| number.in_final_cost && (number.target != 0.0 || is_large);
        let is_away = |number: &&TargetReport| (number.start - number.target).abs() > NEAR * number.target.abs();
        let is_missed = |number: &&TargetReport| number.covered().is_some_and(|covered| covered < COVERED);
        self.targets.iter().filter(counts).filter(is_away).filter(is_missed)
    }

    /// Its share of a nominal cost; `None` if that is 0, where nothing moves.
    #[must_use]
    pub fn share(&self, nominal: f64) -> Option<f64> {
        (nominal != 0.0).then(|| self.total() / nominal)
    }
}

/// The terms of a task's cost along its plan, with their costs over time; empty if the system does not tell its terms.
pub(super) fn cost_terms(TaskAt { task, phi }: TaskAt, plan: &Trajectory, curves: &[CostCurve]) -> Vec<CostTerm> {
    let targets = if curves.is_empty() { Vec::new() } else { task.system.targets(phi) };
    let numbers: Vec<(usize, TargetReport)> = if targets.is_empty() {
        Vec::new()
    } else {
        let idle = vec![0.0; task.system.dimensions().controls];
        let control = |step: usize| if step < plan.steps() { plan.controls.vector(step) } else { &idle };
        let along = (0..=plan.steps()).map(|step| task.system.weighed(plan.states.vector(step), control(step), phi));
        let along: Vec<Vec<f64>> = along.collect();
        targets.into_iter().enumerate().map(|(place, target)| (target.cost, report(target, place, &along))).collect()
    };
    let term = |(index, curve): (usize, &CostCurve)| {
        let (last, stages) = curve.per_step.split_last().map_or((0.0, &[][..]), |(last, stages)| (*last, stages));
        let of_term = numbers.iter().filter(|(cost, _)| *cost == index).map(|(_, number)| number.clone());
        CostTerm { name: curve.name.clone(), stages: stages.iter().sum(), last, targets: of_term.collect() }
    };
    curves.iter().enumerate().map(term).collect()
}

fn report(target: Target, place: usize, along: &[Vec<f64>]) -> TargetReport {
    let steps = if target.depends_on_control { along.len() - 1 } else { along.len() };
    let values = || along[..steps].iter().map(|now| now[place]);
    TargetReport {
        name: target.channel.name,
        unit: target.channel.unit,
        target: target.value,
        start: along[0][place],
        mean: values().sum::<f64>() / steps as f64,
        end: values().next_back().unwrap_or(f64::NAN),
        in_final_cost: target.in_final_cost && !target.depends_on_control,
    }
}
