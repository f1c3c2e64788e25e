//! States that cost nothing, now or later, but for the rounding of the numbers given: as where masses and springs float
//! freely, and were discretised in time.

use super::units::scales;
use super::verify::{Matrix, Quotient};
use super::zeros::moduli;
use crate::dense::Dense;

/// The rounding of a number given, relatively: what is tried, one after the other.
const GIVEN: [f64; 3] = [2.0 * f64::EPSILON, 32.0 * f64::EPSILON, 512.0 * f64::EPSILON];

/// Entries below so many times their rounding are 0.
const CANCELS: f64 = 8.0;

/// Modes that die out faster than this per step may stay.
const LASTS: f64 = 1.0 - 1e-3;

/// How far the numbers may be from those of a system whose states cost exactly nothing.
const NEARBY: f64 = 1e-11;

/// Numbers of a row, and how far each is rounded.
#[derive(Clone)]
struct Row {
    entries: Vec<f64>,
    off: Vec<f64>,
}

impl Row {
    /// What cancels is 0.
    fn clean(mut self) -> Self {
        for (entry, off) in self.entries.iter_mut().zip(&mut self.off) {
            if entry.abs() <= CANCELS * *off {
                (*entry, *off) = (0.0, 0.0);
            }
        }
        self
    }

    /// Without the part along a row whose entry there is 1.
    fn minus(&self, place: usize, by: &Self) -> Self {
        let (factor, of_factor) = (self.entries[place], self.off[place]);
        if factor == 0.0 {
            return self.clone();
        }
        let mut out = self.clone();
        for j in 0..out.entries.len() {
            let taken = factor * by.entries[j];
            let size = self.entries[j].abs() + taken.abs();
            out.off[j] += factor.abs() * by.off[j] + of_factor * by.entries[j].abs() + f64::EPSILON * size;
            out.entries[j] -= taken;
        }
        (out.entries[place], out.off[place]) = (0.0, 0.0);
        out.clean()
    }

    /// With the entry at a place 1.
    fn divided(&self, place: usize) -> Self {
        let (pivot, of_pivot) = (self.entries[place], self.off[place] / self.entries[place].abs());
        let entries: Vec<f64> = self.entries.iter().map(|entry| entry / pivot).collect();
        let off = entries
            .iter()
            .zip(&self.off)
            .map(|(entry, off)| off / pivot.abs() + entry.abs() * (of_pivot + f64::EPSILON));
        let mut out = Self { off: off.collect(), entries };
        (out.entries[place], out.off[place]) = (1.0, 0.0);
        out
    }

    fn carried(&self, a: &Dense, given: f64) -> Self {
        let n = self.entries.len();
        let sum = |entry: &dyn Fn(usize) -> f64| (0..n).map(entry).sum::<f64>();
        let entries = (0..n).map(|j| sum(&|i| self.entries[i] * a[(i, j)])).collect();
        let off = (0..n).map(|j| sum(&|i| (self.off[i] + given * self.entries[i].abs()) * a[(i, j)].abs())).collect();
        Self { entries, off }.clean()
    }
}

/// Rows `R` of the states of `x+ = F z + w` that cost something beyond rounding, where the others cost something too, by
/// rounding alone, and do not die out: `R` is the identity in as many states. None where no state is of this kind.
pub(super) fn costly(dynamics: &Dense, cost: &Dense, process: &Dense) -> Option<Dense> {
    GIVEN.into_iter().find_map(|given| costly_within(given, dynamics, cost, process))
}

/// The same where numbers are rounded by so much.
fn costly_within(given: f64, dynamics: &Dense, cost: &Dense, process: &Dense) -> Option<Dense> {
    let n = dynamics.nrows();
    let a = dynamics.columns(0, n).into_owned();
    let units = scales(&a, process);
    let mut waiting: Vec<Row> = (0..cost.nrows())
        .map(|i| {
            let entries: Vec<f64> = (0..n).map(|j| cost[(i, j)]).collect();
            Row { off: entries.iter().map(|entry| given * entry.abs()).collect(), entries }
        })
        .collect();
    let mut reduced: Vec<(usize, Row)> = Vec::new();
    while let Some(mut row) = waiting.pop() {
        for (place, by) in &reduced {
            row = row.minus(*place, by);
        }
        let size = |j: &usize| row.entries[*j].abs() * units[*j];
        let Some(place) = (0..n).max_by(|i, j| size(i).total_cmp(&size(j))).filter(|j| size(j) > 0.0) else { continue };
        let one = row.divided(place);
        for (_, other) in &mut reduced {
            *other = other.minus(place, &one);
        }
        waiting.push(one.carried(&a, given));
        reduced.push((place, one));
    }
    if reduced.len() == n || reduced.is_empty() {
        return None;
    }
    let rows = Dense::from_fn(reduced.len(), n, |i, j| reduced[i].1.entries[j]);
    let (f, l, w) = (matrix(dynamics), matrix(cost), matrix(process));
    let quotient = Quotient::new(&matrix(&rows))?;
    // Where the others lead to among themselves.
    let others: Vec<usize> = (0..n).filter(|j| !quotient.kept().contains(j)).collect();
    let block = (&a * of_matrix(&quotient.beside())).select_rows(&others);
    let lasts = moduli(&block)?.into_iter().any(|modulus| modulus > LASTS);
    if !lasts || quotient.is_exact(&f, &l) {
        return None;
    }
    (quotient.distance(&quotient.of(&f, &l, &w), &f, &l, &w) <= NEARBY).then_some(rows)
}

/// From the form that proofs read.
pub(super) fn of_matrix(a: &Matrix) -> Dense {
    Dense::from_fn(a.rows, a.cols, |i, j| a.at(i, j))
}

/// In the form that proofs read.
pub(super) fn matrix(a: &Dense) -> Matrix {
    Matrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}
