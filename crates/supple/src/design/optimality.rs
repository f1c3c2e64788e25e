//! Whether a visited design is an optimum, to first order (theory, equation D.3).

use nalgebra::{DMatrix, DVector};
use supple_model::parameters::Parameter;

use super::Aim;
use super::entries::{Entry, Limited, Units, constraints, objective};
use super::visit::Visitor;
use super::visited::Visit;

/// First-order optimality up to which a design counts as an optimum.
pub(crate) const OPTIMAL: f64 = 1e-4;

/// Information, nats, below which slopes are not relative to it: so little is as good as none.
const LITTLE: f64 = 1e-2;

/// First-order optimality of a visited design, and the multipliers of the tasks' bounds and, last, of the budget.
///
/// For least information: the largest entry of the projected gradient of the Lagrangian, relative to information and
/// weighted price or their gradients, whichever is larger. For least cost: that of the convex combination of the gradients of `J_i / D_i` over the
/// tasks where it is greatest, relative to `J_i / D_i`; there are no multipliers of bounds.
pub(crate) fn optimality(at: &Visit, visitor: &Visitor) -> (f64, Vec<f64>) {
    let Visitor { problem, settings, aim, scaling, .. } = visitor;
    let near = 100.0 * settings.feasibility;
    let scaled = |gradient: &[f64]| scaling.gradient(&at.phi, gradient);
    let slope = |entry: &Entry| scaled(&entry.at(problem, at).1);
    let entries = constraints((settings, *aim, Units::Natural), at);
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
            let of = slope(&objective((problem, *aim, Units::Natural), at));
            let (worst, multipliers) = project(&of, &gradients, &active, &held);
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
        Aim::Cost => {
            let most = at.violation();
            let is_cost = |one: &usize| matches!(entries[*one].0, Limited::Cost(_));
            let Some(first) = (0..entries.len()).find(|one| is_cost(one) && violations[*one] == most) else {
                return (0.0, reported);
            };
            let is_active = |one: &usize| match entries[*one].0 {
                Limited::Cost(_) => *one != first && violations[*one] > most - near,
                Limited::Price => violations[*one] > -near,
                Limited::Unmeasured(_) => false,
            };
            let active: Vec<usize> = (0..entries.len()).filter(is_active).collect();
            let (worst, weights) = project(&gradients[first], &gradients, &active, &held);
            let weight = 1.0 + (0..entries.len()).filter(is_cost).map(|one| weights[one]).sum::<f64>();
            (worst / (weight * (1.0 + most).max(1e-300)), reported)
        }
    }
}

/// Whether a coordinate is at a bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Held {
    Free,
    /// At its lower bound, where its slope may be positive.
    Below,
    /// At its upper bound, where its slope may be negative.
    Above,
}

/// Non-negative least-squares fit of an objective's gradient by those of active constraints and of the bounds that hold
/// coordinates: the largest entry of the residual, and the multipliers of all constraints.
fn project(objective: &[f64], constraints: &[Vec<f64>], active: &[usize], held: &[Held]) -> (f64, Vec<f64>) {
    let unit = |(index, held): (usize, &Held)| {
        let slope = match held {
            Held::Free => return None,
            Held::Below => -1.0,
            Held::Above => 1.0,
        };
        let mut column = vec![0.0; objective.len()];
        column[index] = slope;
        Some(column)
    };
    let known = active.iter().map(|&index| &*constraints[index]).chain([objective]).flatten();
    if known.into_iter().any(|slope| !slope.is_finite()) {
        return (f64::INFINITY, vec![0.0; constraints.len()]);
    }
    let bounds: Vec<Vec<f64>> = held.iter().enumerate().filter_map(unit).collect();
    let columns: Vec<&[f64]> =
        active.iter().map(|&index| &*constraints[index]).chain(bounds.iter().map(|column| &**column)).collect();
    let fit = nonnegative_fit((&columns, active.len()), objective);
    let mut rest = objective.to_vec();
    for (column, factor) in columns.iter().zip(&fit) {
        rest.iter_mut().zip(*column).for_each(|(rest, entry)| *rest += factor * entry);
    }
    let mut multipliers = vec![0.0; constraints.len()];
    active.iter().zip(&fit).for_each(|(&index, &multiplier)| multipliers[index] = multiplier);
    (rest.iter().map(|rest| rest.abs()).fold(0.0, f64::max), multipliers)
}

/// The factors of at least 0 with which columns come closest to the negative of a target, by active sets (Lawson and Hanson,
/// Solving Least Squares Problems, 1974). Columns from `dense` on are unit vectors or their negatives, each of another entry.
fn nonnegative_fit((columns, dense): (&[&[f64]], usize), target: &[f64]) -> Vec<f64> {
    let lengths: Vec<f64> = columns.iter().map(|column| dot(column, column).sqrt()).collect();
    let mut fit = vec![0.0; columns.len()];
    let mut passive: Vec<usize> = Vec::new();
    for _ in 0..3 * columns.len() {
        let mut rest: Vec<f64> = target.iter().map(|entry| -entry).collect();
        for (column, factor) in columns.iter().zip(&fit) {
            rest.iter_mut().zip(*column).for_each(|(rest, entry)| *rest -= factor * entry);
        }
        let gain = |index: &usize| dot(columns[*index], &rest) / lengths[*index];
        let others = (0..columns.len()).filter(|index| !passive.contains(index) && lengths[*index] > 0.0);
        let best = others.max_by(|a, b| gain(a).total_cmp(&gain(b)));
        let Some(best) = best.filter(|best| gain(best) > 1e-14 * dot(target, target).sqrt()) else { break };
        passive.push(best);
        loop {
            let wanted = fit_of((columns, dense), &passive, target);
            // As far as all stay above 0; those that reach it leave.
            let reach = |(&index, &wanted): (&usize, &f64)| {
                if wanted <= 0.0 { fit[index] / (fit[index] - wanted) } else { 1.0 }
            };
            let reaches: Vec<f64> = passive.iter().zip(&wanted).map(reach).collect();
            let share = reaches.iter().copied().fold(1.0, f64::min);
            for (&index, wanted) in passive.iter().zip(&wanted) {
                fit[index] += share * (wanted - fit[index]);
            }
            let is_left = |(place, _): &(usize, &usize)| wanted[*place] <= 0.0 && reaches[*place] <= share;
            let left: Vec<usize> = passive.iter().enumerate().filter(is_left).map(|(_, &index)| index).collect();
            if left.is_empty() {
                break;
            }
            left.iter().for_each(|&index| fit[index] = 0.0);
            passive.retain(|index| !left.contains(index));
        }
    }
    fit
}

/// The factors of some columns that come closest to the negative of a target. Unit vectors meet their entries exactly: the
/// others are fitted to the rest.
fn fit_of((columns, dense): (&[&[f64]], usize), some: &[usize], target: &[f64]) -> Vec<f64> {
    let entry = |unit: usize| columns[unit].iter().position(|entry| *entry != 0.0).unwrap_or(0);
    let met: Vec<usize> = some.iter().filter(|&&index| index >= dense).map(|&unit| entry(unit)).collect();
    let rows: Vec<usize> = (0..target.len()).filter(|row| !met.contains(row)).collect();
    let fitted: Vec<usize> = some.iter().copied().filter(|&index| index < dense).collect();
    let lengths: Vec<f64> = fitted.iter().map(|&index| dot(columns[index], columns[index]).sqrt()).collect();
    let mut factors = vec![0.0; fitted.len()];
    if !rows.is_empty() && !fitted.is_empty() {
        let column = |row: usize, column: usize| columns[fitted[column]][rows[row]] / lengths[column];
        let matrix = DMatrix::from_fn(rows.len(), fitted.len(), column);
        let negative = DVector::from_iterator(rows.len(), rows.iter().map(|&row| -target[row]));
        if let Ok(solved) = matrix.svd(true, true).solve(&negative, 1e-12) {
            factors = solved.iter().zip(&lengths).map(|(factor, length)| factor / length).collect();
        }
    }
    let rest = |row: usize| {
        -target[row] - fitted.iter().zip(&factors).map(|(&index, factor)| factor * columns[index][row]).sum::<f64>()
    };
    let factor = |&index: &usize| match fitted.iter().position(|&other| other == index) {
        Some(place) => factors[place],
        None => rest(entry(index)) * columns[index][entry(index)],
    };
    some.iter().map(factor).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coordinate descent ended far from the multipliers where the slopes of two costs are nearly opposite.
    #[test]
    fn multipliers_of_opposing_limits_are_exact() {
        let constraints = [vec![1.0, 0.001, 0.3], vec![-1.0, 0.001, -0.3]];
        let [first, second] = [3.1, 3.2];
        let objective: Vec<f64> = (0..3).map(|i| -first * constraints[0][i] - second * constraints[1][i]).collect();
        let (worst, found) = project(&objective, &constraints, &[0, 1], &[Held::Free; 3]);
        assert!(
            worst < 1e-12 && (found[0] - first).abs() < 1e-9 && (found[1] - second).abs() < 1e-9,
            "{worst} {found:?}"
        );
        // A constraint whose slope points the wrong way has no part, nor has a slope that a bound holds.
        let (worst, found) =
            project(&[-1.0, 5.0], &[vec![1.0, 0.0], vec![-1.0, 0.0]], &[0, 1], &[Held::Free, Held::Below]);
        assert!(worst < 1e-12 && found == [1.0, 0.0], "{worst} {found:?}");
        let (worst, _) = project(&[-1.0, 5.0], &[vec![1.0, 0.0]], &[0], &[Held::Free, Held::Above]);
        assert_eq!(worst, 5.0);
    }
}
