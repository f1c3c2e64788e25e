use supple_kernels::{Pattern, Scalar};

use crate::cost::{Cost, Residual};
use crate::{Model, Point, Value};

/// Which derivatives of a system can be non-zero, found once by running its functions over [`Pattern`]s.
///
/// Variables are numbered `z = (x, u)`, then the parameters.
#[derive(Clone, Debug, Default)]
pub(super) struct Structure {
    /// Variables of `z` that each entry of `f` depends on.
    pub dynamics: Vec<Vec<usize>>,
    /// Variables of `z` that any entry of `f` depends on.
    pub dynamics_variables: Vec<usize>,
    /// Variables of `z` in which `f` is curved, parameters held fixed.
    pub dynamics_curved: Vec<usize>,
    /// Variables of `x` that each entry of `g` depends on.
    pub measurement: Vec<Vec<usize>>,
    /// Variables of `x` that any entry of `g` depends on.
    pub measurement_variables: Vec<usize>,
    /// Variables, parameters included, in which `f` or `g` is curved.
    pub joint_curved: Vec<usize>,
    /// Variables of `z` that each entry of each term's residual depends on, all terms in one row.
    pub residuals: Vec<Vec<usize>>,
    /// Variables of `z` that any residual depends on.
    pub residual_variables: Vec<usize>,
    /// Variables of `z` in which any residual is curved, parameters held fixed.
    pub residual_curved: Vec<usize>,
    /// Variables, parameters included, with third derivatives of the stage and of the final cost.
    pub cost_third: [Vec<usize>; 2],
    /// Parameters that `f` or a cost depend on.
    pub gradient_parameters: Vec<usize>,
    /// Parameters that anything depends on.
    pub parameters: Vec<usize>,
}

/// The functions of a system over patterns.
struct Traced {
    step: Vec<Pattern>,
    observe: Vec<Pattern>,
    residuals: Vec<Vec<Pattern>>,
    costs: [Pattern; 2],
}

fn trace<M: Model>(model: &M, costs: &[Cost], time_step: Value, z: &[Pattern], phi: &[Pattern]) -> Traced {
    let size = model.dimensions();
    let (x, u) = z.split_at(size.states);
    let at = Point { x, u, phi, time_step: time_step.resolve(phi) };
    let mut step = vec![Pattern::zero(); size.states];
    model.step(&at, &mut step);
    let mut observe = vec![Pattern::zero(); size.measurements];
    model.observe(&at, &mut observe);
    let mut signals = vec![Pattern::zero(); model.signals().len()];
    model.signal(&at, &mut signals);
    let residuals: Vec<Vec<Pattern>> = costs
        .iter()
        .map(|cost| {
            let mut r = vec![Pattern::zero(); cost.kind.len()];
            cost.kind.evaluate(&at, &signals, &mut r);
            r
        })
        .collect();
    let total = |last| {
        let terms = costs.iter().zip(&residuals).filter(|(cost, _)| !cost.weights(last).are_zero());
        terms.fold(Pattern::zero(), |sum, (cost, r)| sum + cost.of_residual(r, phi, last))
    };
    let costs = [total(false), total(true)];
    Traced { step, observe, residuals, costs }
}

/// The variables in a set, below `end`.
fn members(set: u128, end: usize) -> Vec<usize> {
    (0..end).filter(|&i| set & Pattern::bit(i) != 0).collect()
}

impl Structure {
    pub fn of<M: Model>(model: &M, costs: &[Cost], time_step: Value, parameters: usize) -> Self {
        let size = model.dimensions();
        let (joint, all) = (size.joint(), size.joint() + parameters);
        let z: Vec<_> = (0..joint).map(Pattern::variable).collect();
        let fixed = vec![Pattern::zero(); parameters];
        let moving: Vec<_> = (joint..all).map(Pattern::variable).collect();
        let plain = trace(model, costs, time_step, &z, &fixed);
        let full = trace(model, costs, time_step, &z, &moving);

        let first = |patterns: &[Pattern]| patterns.iter().fold(0, |set, p| set | p.first);
        let second = |patterns: &[Pattern]| patterns.iter().fold(0, |set, p| set | p.second);
        let each =
            |patterns: &[Pattern], end: usize| patterns.iter().map(|p| members(p.first, end)).collect::<Vec<_>>();
        let residuals = plain.residuals.concat();
        let only_parameters = |set: u128| {
            let list = members(set, all).into_iter().filter_map(|i| i.checked_sub(joint));
            list.collect::<Vec<_>>()
        };
        let gradient = first(&full.step) | full.costs[0].first | full.costs[1].first;
        Self {
            dynamics: each(&plain.step, joint),
            dynamics_variables: members(first(&plain.step), joint),
            dynamics_curved: members(second(&plain.step), joint),
            measurement: each(&plain.observe, size.states),
            measurement_variables: members(first(&plain.observe), size.states),
            joint_curved: members(second(&full.step) | second(&full.observe), all),
            residuals: each(&residuals, joint),
            residual_variables: members(first(&residuals), joint),
            residual_curved: members(second(&residuals), joint),
            cost_third: [members(full.costs[0].third, all), members(full.costs[1].third, all)],
            gradient_parameters: only_parameters(gradient),
            parameters: only_parameters(gradient | first(&full.observe)),
        }
    }
}
