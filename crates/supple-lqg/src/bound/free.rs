//! States that never cost anything, apart from rounding of the given numbers: for example free-floating masses and springs
//! after discretisation in time.

use super::units::scales;
use super::verify::{Matrix, Quotient};
use super::zeros::moduli;
use crate::dense::Dense;

/// Relative rounding of the given numbers: values to try, one after the other.
const GIVEN: [f64; 3] = [2.0 * f64::EPSILON, 32.0 * f64::EPSILON, 512.0 * f64::EPSILON];

/// Entries below this multiple of their rounding error count as 0.
const CANCELS: f64 = 8.0;

/// Modes that decay faster than this per step need not be removed.
const LASTS: f64 = 1.0 - 1e-3;

/// The largest distance to a system whose states cost exactly nothing.
const NEARBY: f64 = 1e-11;

/// The numbers of a row, and the rounding error of each.
#[derive(Clone)]
struct Row {
    entries: Vec<f64>,
    off: Vec<f64>,
}

impl Row {
    /// Sets entries that cancel up to rounding to 0.
    fn clean(mut self) -> Self {
        for (entry, off) in self.entries.iter_mut().zip(&mut self.off) {
            if entry.abs() <= CANCELS * *off {
                (*entry, *off) = (0.0, 0.0);
            }
        }
        self
    }

    /// Eliminates the entry at `place` with a row whose entry there is 1.
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

    /// Divided so that the entry at `place` becomes 1.
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

/// Rows `R`: the states of `x+ = F z + w` that cost something beyond rounding, if the others do not decay and cost something
/// only by rounding. `R` contains an identity in as many states. `None` if there are no such other states.
pub(super) fn costly(dynamics: &Dense, cost: &Dense, process: &Dense) -> Option<Dense> {
    GIVEN.into_iter().find_map(|given| costly_within(given, dynamics, cost, process))
}

/// The same for numbers with the relative rounding `given`.
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
    // The dynamics of the other states among themselves.
    let others: Vec<usize> = (0..n).filter(|j| !quotient.kept().contains(j)).collect();
    let block = (&a * of_matrix(&quotient.beside())).select_rows(&others);
    let lasts = moduli(&block)?.into_iter().any(|modulus| modulus > LASTS);
    if !lasts || quotient.is_exact(&f, &l) {
        return None;
    }
    (quotient.distance(&quotient.of(&f, &l, &w), &f, &l, &w) <= NEARBY).then_some(rows)
}

/// Converts from the matrix type that proofs use.
pub(super) fn of_matrix(a: &Matrix) -> Dense {
    Dense::from_fn(a.rows, a.cols, |i, j| a.at(i, j))
}

/// Converts to the matrix type that proofs use.
pub(super) fn matrix(a: &Dense) -> Matrix {
    Matrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}
