//! Multipliers of active constraints and bounds, by non-negative least squares.

use nalgebra::{DMatrix, DVector};

/// Whether a coordinate is at a bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Held {
    Free,
    /// At its lower bound, where its slope may be positive.
    Below,
    /// At its upper bound, where its slope may be negative.
    Above,
}

/// Non-negative least-squares fit of an objective's gradient by those of active constraints and of the bounds that hold
/// coordinates: the largest entry of the residual, and the multipliers of all constraints. Multipliers that the fit has above
/// the `most` that one may be are that.
pub(super) fn project(
    objective: &[f64],
    constraints: &[Vec<f64>],
    most: &[f64],
    active: &[usize],
    held: &[Held],
) -> (f64, Vec<f64>) {
    let known = active.iter().map(|&index| &*constraints[index]).chain([objective]).flatten();
    if known.into_iter().any(|slope| !slope.is_finite()) {
        return (f64::INFINITY, vec![0.0; constraints.len()]);
    }
    let bounds = held.iter().enumerate().filter_map(|(entry, held)| match held {
        Held::Free => None,
        Held::Below => Some(Column::Bound { entry, sign: -1.0 }),
        Held::Above => Some(Column::Bound { entry, sign: 1.0 }),
    });
    let columns: Vec<Column> =
        active.iter().map(|&index| Column::Constraint(&constraints[index])).chain(bounds).collect();
    let mut fit = nonnegative_fit(&columns, objective);
    active.iter().zip(&mut fit).for_each(|(&index, multiplier)| *multiplier = multiplier.min(most[index]));
    let mut rest = objective.to_vec();
    columns.iter().zip(&fit).for_each(|(column, factor)| column.add_to(&mut rest, *factor));
    let mut multipliers = vec![0.0; constraints.len()];
    active.iter().zip(&fit).for_each(|(&index, &multiplier)| multipliers[index] = multiplier);
    (rest.iter().map(|rest| rest.abs()).fold(0.0, f64::max), multipliers)
}

/// A gradient that multipliers weigh.
#[derive(Clone, Copy, Debug)]
enum Column<'a> {
    /// Of an active constraint.
    Constraint(&'a [f64]),
    /// Of a bound that holds a coordinate: a unit vector or its negative.
    Bound { entry: usize, sign: f64 },
}

impl Column<'_> {
    /// Its product with a vector.
    fn dot(self, vector: &[f64]) -> f64 {
        match self {
            Self::Constraint(slopes) => slopes.iter().zip(vector).map(|(slope, entry)| slope * entry).sum(),
            Self::Bound { entry, sign } => sign * vector[entry],
        }
    }

    fn length(self) -> f64 {
        match self {
            Self::Constraint(slopes) => length(slopes),
            Self::Bound { .. } => 1.0,
        }
    }

    /// Adds a multiple of it to a vector.
    fn add_to(self, vector: &mut [f64], factor: f64) {
        match self {
            Self::Constraint(slopes) => {
                vector.iter_mut().zip(slopes).for_each(|(entry, slope)| *entry += factor * slope);
            }
            Self::Bound { entry, sign } => vector[entry] += factor * sign,
        }
    }
}

/// The factors of at least 0 with which columns come closest to the negative of a target, by active sets (Lawson and Hanson,
/// Solving Least Squares Problems, 1974).
fn nonnegative_fit(columns: &[Column], target: &[f64]) -> Vec<f64> {
    let mut fit = vec![0.0; columns.len()];
    let mut passive: Vec<usize> = Vec::new();
    for _ in 0..3 * columns.len() {
        let mut rest: Vec<f64> = target.iter().map(|entry| -entry).collect();
        columns.iter().zip(&fit).for_each(|(column, factor)| column.add_to(&mut rest, -factor));
        let gain = |index: usize| columns[index].dot(&rest) / columns[index].length();
        let others = (0..columns.len()).filter(|&index| !passive.contains(&index) && columns[index].length() > 0.0);
        let best = others.max_by(|&a, &b| gain(a).total_cmp(&gain(b)));
        let Some(best) = best.filter(|&best| gain(best) > 1e-14 * length(target)) else { break };
        passive.push(best);
        loop {
            let some: Vec<Column> = passive.iter().map(|&index| columns[index]).collect();
            let wanted = fit_of(&some, target);
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

/// The factors with which columns come closest to the negative of a target. Bounds meet their entries exactly: constraints
/// are fitted to the rest.
fn fit_of(columns: &[Column], target: &[f64]) -> Vec<f64> {
    let is_met =
        |row: &usize| columns.iter().any(|column| matches!(column, Column::Bound { entry, .. } if entry == row));
    let rows: Vec<usize> = (0..target.len()).filter(|row| !is_met(row)).collect();
    let fitted: Vec<(usize, &[f64])> = columns
        .iter()
        .enumerate()
        .filter_map(|(place, column)| match *column {
            Column::Constraint(slopes) => Some((place, slopes)),
            Column::Bound { .. } => None,
        })
        .collect();
    let mut factors = vec![0.0; columns.len()];
    if !rows.is_empty() && !fitted.is_empty() {
        let entry = |row: usize, column: usize| fitted[column].1[rows[row]] / length(fitted[column].1);
        let matrix = DMatrix::from_fn(rows.len(), fitted.len(), entry);
        let negative = DVector::from_iterator(rows.len(), rows.iter().map(|&row| -target[row]));
        if let Ok(solved) = matrix.svd(true, true).solve(&negative, 1e-12) {
            for ((place, slopes), factor) in fitted.iter().zip(&solved) {
                factors[*place] = factor / length(slopes);
            }
        }
    }
    let mut rest: Vec<f64> = target.iter().map(|entry| -entry).collect();
    fitted.iter().for_each(|&(place, slopes)| Column::Constraint(slopes).add_to(&mut rest, -factors[place]));
    for (factor, column) in factors.iter_mut().zip(columns) {
        if let Column::Bound { .. } = column {
            *factor = column.dot(&rest);
        }
    }
    factors
}

fn length(vector: &[f64]) -> f64 {
    vector.iter().map(|entry| entry * entry).sum::<f64>().sqrt()
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
        let (worst, found) = project(&objective, &constraints, &[f64::INFINITY; 2], &[0, 1], &[Held::Free; 3]);
        assert!(
            worst < 1e-12 && (found[0] - first).abs() < 1e-9 && (found[1] - second).abs() < 1e-9,
            "{worst} {found:?}"
        );
        // A constraint whose slope points the wrong way has no part, nor has a slope that a bound holds.
        let opposite = [vec![1.0, 0.0], vec![-1.0, 0.0]];
        let (worst, found) = project(&[-1.0, 5.0], &opposite, &[f64::INFINITY; 2], &[0, 1], &[Held::Free, Held::Below]);
        assert!(worst < 1e-12 && found == [1.0, 0.0], "{worst} {found:?}");
        let (worst, _) = project(&[-1.0, 5.0], &opposite, &[f64::INFINITY; 2], &[0], &[Held::Free, Held::Above]);
        assert_eq!(worst, 5.0);
        // One that would have to be greater than it may be leaves the rest.
        let (worst, found) = project(&[-1.0, 0.0], &opposite, &[0.25, 1.0], &[0, 1], &[Held::Free; 2]);
        assert!((worst - 0.75).abs() < 1e-12 && found == [0.25, 0.0], "{worst} {found:?}");
    }
}
