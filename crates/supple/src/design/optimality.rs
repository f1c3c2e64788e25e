//! Whether a visited design is an optimum, to first order (theory, equation D.3).

use supple_model::parameters::Parameter;

use super::Aim;
use super::entries::{Entry, Limited, Units, constraints, objective};
use super::multipliers::{Held, project};
use super::visit::Visitor;
use super::visited::Visit;

/// First-order optimality up to which a design counts as an optimum.
pub(crate) const OPTIMAL: f64 = 1e-4;

/// Information, nats, below which slopes are not relative to it: so little is as good as none.
const LITTLE: f64 = 1e-2;

/// First-order optimality of a visited design, and the multipliers of the tasks' bounds and, last, of the budget.
///
/// For least information: the largest entry of the projected gradient of the Lagrangian, relative to information and
/// weighted price or their gradients, whichever is larger. For least cost: that of the convex combination of the gradients
/// of `J_i / D_i` over the tasks where it is greatest, relative to `J_i / D_i`; there are no multipliers of bounds.
pub(crate) fn optimality(at: &Visit, visitor: &Visitor) -> (f64, Vec<f64>) {
    let Visitor { problem, settings, aim, scaling, .. } = visitor;
    let near = 100.0 * settings.feasibility;
    let scaled = |gradient: &[f64]| scaling.gradient(&at.phi, gradient);
    let slope = |entry: &Entry| scaled(&entry.at(problem, at).1);
    let entries = constraints(settings, *aim, Units::Natural, at);
    let violations: Vec<f64> = entries.iter().map(|(limited, _)| limited.violation(at)).collect();
    let gradients: Vec<Vec<f64>> = entries.iter().map(|(_, entry)| slope(entry)).collect();
    let mut reported = vec![0.0; at.tasks.len() + 1];
    let held: Vec<Held> = scaling
        .indices
        .iter()
        .zip(&at.scaled)
        .map(|(&index, &s)| {
            let Parameter { initial, bounds: [lower, upper], .. } = *problem.parameters.get(index);
            // On a wide range, a value that is far from its bound has a share of almost 0.
            let is_at = |end: f64| (at.phi[index] - end).abs() <= 1e-6 * (initial - end).abs() || initial == end;
            match s {
                s if s <= 1e-9 && is_at(lower) => Held::Below,
                s if s >= 1.0 - 1e-9 && is_at(upper) => Held::Above,
                _ => Held::Free,
            }
        })
        .collect();
    match aim {
        Aim::Information { .. } => {
            let active: Vec<usize> = (0..entries.len()).filter(|&one| violations[one] > -near).collect();
            let of = slope(&objective(problem, *aim, Units::Natural, at));
            let most: Vec<f64> = entries.iter().map(|(limited, _)| limited.greatest_multiplier(problem, at)).collect();
            let (worst, multipliers) = project(&of, &gradients, &most, &active, &held);
            for ((limited, _), multiplier) in entries.iter().zip(multipliers) {
                match *limited {
                    Limited::Cost(task) => reported[task] = multiplier,
                    Limited::Price => reported[at.tasks.len()] = multiplier,
                    // Constraints on costs without measurements have no reported multipliers.
                    Limited::Unmeasured(_) => {}
                }
            }
            // Needed information depends on the limit itself.
            for (reported, (task, visit)) in reported.iter_mut().zip(problem.tasks.iter().zip(&at.tasks)) {
                *reported -= task.information_weight * visit.information_by_limit;
            }
            // If information and price are in balance, the gradient of their sum cannot serve as a scale; nor can any
            // gradient at an optimum that no limit holds.
            let size = |information: f64, price: f64| information.abs() + (at.price.weight * price).abs();
            let slopes = scaled(&at.information_gradient(problem)).into_iter().zip(scaled(&at.price.gradient));
            let slopes = slopes.map(|(information, price)| size(information, price));
            let scale = slopes.fold(size(at.information(problem), at.price.total).max(LITTLE), f64::max);
            (worst / scale, reported)
        }
        Aim::Cost | Aim::UnmeasuredCost => {
            let most = aim.violation(at);
            let is_cost = |one: &usize| matches!(entries[*one].0, Limited::Cost(_) | Limited::Unmeasured(_));
            let Some(first) = (0..entries.len()).find(|one| is_cost(one) && violations[*one] == most) else {
                return (0.0, reported);
            };
            let is_active = |one: &usize| match entries[*one].0 {
                Limited::Cost(_) | Limited::Unmeasured(_) => *one != first && violations[*one] > most - near,
                Limited::Price => violations[*one] > -near,
            };
            let active: Vec<usize> = (0..entries.len()).filter(is_active).collect();
            let unlimited = vec![f64::INFINITY; entries.len()];
            let (worst, weights) = project(&gradients[first], &gradients, &unlimited, &active, &held);
            let weight = 1.0 + (0..entries.len()).filter(is_cost).map(|one| weights[one]).sum::<f64>();
            (worst / (weight * (1.0 + most).max(1e-300)), reported)
        }
    }
}
