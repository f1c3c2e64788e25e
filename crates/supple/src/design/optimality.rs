//! Whether a visited design is an optimum, to first order (theory, equation D.3).

use super::Aim;
use super::visit::Visitor;
use super::visited::{TaskVisit, Visit};

/// First-order optimality up to which a design counts as an optimum.
pub(crate) const OPTIMAL: f64 = 1e-4;

/// First-order optimality of a visited design, and the multipliers of the tasks' bounds and, last, of the budget.
///
/// For least information: the largest entry of the projected gradient of the Lagrangian, relative to the gradients of
/// information and weighted price. For least cost: that of the convex combination of the gradients of `J_i / D_i` over the
/// tasks where it is greatest, relative to `J_i / D_i`; there are no multipliers of bounds.
pub(crate) fn optimality(at: &Visit, visitor: &Visitor) -> (f64, Vec<f64>) {
    let Visitor { problem, settings, aim, scaling, .. } = visitor;
    let near = 100.0 * settings.feasibility;
    let scaled = |gradient: &[f64]| scaling.gradient(&at.phi, gradient);
    let violations: Vec<Option<f64>> = at.tasks.iter().map(|task| task.violation()).collect();
    // The budget is one more constraint, after those of the tasks.
    let budget = at.tasks.len();
    let is_tight = at.price.violation().is_some_and(|violation| violation > -near);
    match aim {
        Aim::Information { .. } => {
            let objective = scaled(&at.objective_gradient(problem));
            let of_tasks = at.tasks.iter().map(|task| scaled(&task.excess_gradient(1.0)));
            let mut constraints: Vec<_> = of_tasks.chain([scaled(&at.price.gradient)]).collect();
            let is_active = |task: usize| violations[task].is_some_and(|violation| violation > -near);
            let active = (0..at.tasks.len()).filter(|&task| is_active(task));
            let mut active: Vec<usize> = active.chain(is_tight.then_some(budget)).collect();
            // Constraints on costs without measurements have no reported multipliers.
            let is_near = |task: &&TaskVisit| task.unmeasured_violation().is_some_and(|violation| violation > -near);
            let unmeasured = at.tasks.iter().filter(is_near).filter_map(TaskVisit::unmeasured_gradient);
            constraints.extend(unmeasured.map(|gradient| scaled(&gradient)));
            active.extend(budget + 1..constraints.len());
            let (worst, mut multipliers) = project(&objective, &constraints, &active, &at.scaled);
            multipliers.truncate(budget + 1);
            // If information and price are in balance, the gradient of their sum cannot serve as a scale.
            let parts = scaled(&at.information_gradient(problem)).into_iter().zip(scaled(&at.price.gradient));
            let parts = parts.map(|(information, price)| information.abs() + (at.price.weight * price).abs());
            let size = parts.fold(1e-300, f64::max);
            (worst / size, multipliers)
        }
        Aim::Cost => {
            let most = at.violation();
            let none = || vec![0.0; at.phi.len()];
            let gradients = at.tasks.iter().map(|task| task.violation_gradient().unwrap_or_else(none));
            let gradients = gradients.map(|gradient| scaled(&gradient)).chain([scaled(&at.price.gradient)]);
            let gradients: Vec<_> = gradients.collect();
            let is_worst = |task: &usize| violations[*task] == Some(most);
            let Some(first) = (0..at.tasks.len()).find(is_worst) else {
                return (0.0, vec![0.0; budget + 1]);
            };
            let is_active = |task: &usize| *task != first && violations[*task].is_some_and(|v| v > most - near);
            let active = (0..at.tasks.len()).filter(is_active).chain(is_tight.then_some(budget));
            let active: Vec<usize> = active.collect();
            let (worst, weights) = project(&gradients[first], &gradients, &active, &at.scaled);
            let weight = 1.0 + weights[..budget].iter().sum::<f64>();
            (worst / (weight * (1.0 + most).max(1e-300)), vec![0.0; budget + 1])
        }
    }
}

/// Non-negative least-squares fit of an objective's gradient by those of active constraints, over coordinates inside their
/// bounds: the largest entry of the residual, and the multipliers of all constraints.
fn project(objective: &[f64], constraints: &[Vec<f64>], active: &[usize], coordinates: &[f64]) -> (f64, Vec<f64>) {
    let mut multipliers = vec![0.0; constraints.len()];
    let free = |i: usize, residual: f64| {
        let s = coordinates[i];
        !(s <= 1e-9 && residual >= 0.0 || s >= 1.0 - 1e-9 && residual <= 0.0)
    };
    let residual = |multipliers: &[f64]| -> Vec<f64> {
        let sum = |i: usize| active.iter().map(|&task| multipliers[task] * constraints[task][i]).sum::<f64>();
        (0..objective.len()).map(|i| objective[i] + sum(i)).collect()
    };
    // Coordinate descent is fast enough, as there are few tasks.
    for _ in 0..200 {
        for &task in active {
            let rest = residual(&multipliers);
            let used = |i: &usize| free(*i, rest[*i]);
            let gradient = &constraints[task];
            let square: f64 = (0..rest.len()).filter(used).map(|i| gradient[i].powi(2)).sum();
            let slope: f64 = (0..rest.len()).filter(used).map(|i| gradient[i] * rest[i]).sum();
            if square > 0.0 {
                multipliers[task] = (multipliers[task] - slope / square).max(0.0);
            }
        }
    }
    let rest = residual(&multipliers);
    let worst = (0..rest.len()).filter(|&i| free(i, rest[i])).map(|i| rest[i].abs()).fold(0.0, f64::max);
    (worst, multipliers)
}
