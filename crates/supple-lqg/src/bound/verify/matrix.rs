//! Matrices of intervals, and the operations that proofs need.

use std::iter::repeat_n;

use super::interval::Interval;
use supple_kernels::math;

/// A matrix of numbers, by rows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Matrix {
    pub rows: usize,
    pub cols: usize,
    pub entries: Vec<f64>,
}

/// A matrix of intervals, by rows.
#[derive(Clone, Debug)]
pub(crate) struct Enclosure {
    pub rows: usize,
    pub cols: usize,
    pub entries: Vec<Interval>,
}

/// Entries by rows, each row with the length that `lengths` gives. Called in dozens of places, so it is compiled once
/// for all of them.
pub(super) fn by_rows<T>(lengths: &mut dyn Iterator<Item = usize>, entry: &dyn Fn(usize, usize) -> T) -> Vec<T> {
    let mut entries = Vec::new();
    for (i, length) in lengths.enumerate() {
        entries.extend((0..length).map(|j| entry(i, j)));
    }
    entries
}

impl Matrix {
    pub fn from_fn(rows: usize, cols: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        Self { rows, cols, entries: by_rows(&mut repeat_n(cols, rows), &entry) }
    }

    pub fn identity(n: usize) -> Self {
        Self::from_fn(n, n, |i, j| f64::from(u8::from(i == j)))
    }

    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.entries[i * self.cols + j]
    }

    pub fn set(&mut self, i: usize, j: usize, value: f64) {
        self.entries[i * self.cols + j] = value;
    }

    /// The product, rounded.
    pub fn times(&self, other: &Self) -> Self {
        let mut out = Self::from_fn(self.rows, other.cols, |_, _| 0.0);
        for i in 0..self.rows {
            for k in 0..self.cols {
                let factor = self.at(i, k);
                for j in 0..other.cols {
                    out.entries[i * other.cols + j] += factor * other.at(k, j);
                }
            }
        }
        out
    }

    pub fn transpose(&self) -> Self {
        Self::from_fn(self.cols, self.rows, |i, j| self.at(j, i))
    }

    pub fn abs(&self) -> Self {
        Self::from_fn(self.rows, self.cols, |i, j| self.at(i, j).abs())
    }

    /// The columns of `self` followed by those of `other`.
    pub fn beside(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, self.cols + other.cols, |i, j| {
            if j < self.cols { self.at(i, j) } else { other.at(i, j - self.cols) }
        })
    }

    /// The lower Cholesky factor, rounded; `None` if a pivot is not positive.
    pub fn cholesky(&self) -> Option<Self> {
        let n = self.rows;
        let mut g = Self::from_fn(n, n, |_, _| 0.0);
        for j in 0..n {
            for i in j..n {
                let known: f64 = (0..j).map(|k| g.at(i, k) * g.at(j, k)).sum();
                let left = self.at(i, j) - known;
                if i == j && !(left > 0.0 && left.is_finite()) {
                    return None;
                }
                let entry = if i == j { left.sqrt() } else { left / g.at(j, j) };
                g.set(i, j, entry);
            }
        }
        Some(g)
    }
}

impl Enclosure {
    pub fn from_fn(rows: usize, cols: usize, entry: impl Fn(usize, usize) -> Interval) -> Self {
        Self { rows, cols, entries: by_rows(&mut repeat_n(cols, rows), &entry) }
    }

    pub fn at(&self, i: usize, j: usize) -> Interval {
        self.entries[i * self.cols + j]
    }

    pub fn times(&self, other: &Self) -> Self {
        let mut out = Self::from_fn(self.rows, other.cols, |_, _| Interval::ZERO);
        for i in 0..self.rows {
            for k in 0..self.cols {
                let factor = self.at(i, k);
                if factor == Interval::ZERO {
                    continue;
                }
                for j in 0..other.cols {
                    let sum = &mut out.entries[i * other.cols + j];
                    *sum = *sum + factor * other.entries[k * other.cols + j];
                }
            }
        }
        out
    }

    pub fn transpose(&self) -> Self {
        Self::from_fn(self.cols, self.rows, |i, j| self.at(j, i))
    }

    pub fn plus(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, self.cols, |i, j| self.at(i, j) + other.at(i, j))
    }

    pub fn minus(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, self.cols, |i, j| self.at(i, j) - other.at(i, j))
    }

    pub fn scaled(&self, by: Interval) -> Self {
        Self::from_fn(self.rows, self.cols, |i, j| self.at(i, j) * by)
    }

    /// `self middle self'`.
    pub fn around(&self, middle: &Self) -> Self {
        self.times(middle).times(&self.transpose())
    }

    pub fn block(&self, rows: std::ops::Range<usize>, cols: std::ops::Range<usize>) -> Self {
        let (first_row, first_col) = (rows.start, cols.start);
        Self::from_fn(rows.len(), cols.len(), |i, j| self.at(first_row + i, first_col + j))
    }

    pub fn middle(&self) -> Matrix {
        Matrix::from_fn(self.rows, self.cols, |i, j| self.at(i, j).middle())
    }

    /// `Tr(self other)` of symmetric matrices.
    pub fn dot(&self, other: &Self) -> Interval {
        self.entries.iter().zip(&other.entries).fold(Interval::ZERO, |sum, (a, b)| sum + *a * *b)
    }

    /// Whether every symmetric matrix in it is proved positive semidefinite: scaled to a diagonal of about 1, and less a
    /// rounded `g g'` of its middle, the remainder must be diagonally dominant.
    pub fn is_positive_semidefinite(&self) -> bool {
        let n = self.rows;
        // Powers of 2: nothing rounds.
        let unit: Vec<f64> = (0..n).map(|i| near_root(self.at(i, i).middle())).collect();
        let one = Self::from_fn(n, n, |i, j| self.at(i, j) * Interval::point(unit[i]) * Interval::point(unit[j]));
        let middle = one.middle();
        let size = (0..n).map(|i| middle.at(i, i).abs()).fold(0.0, f64::max);
        [1e-15, 1e-13, 1e-11].into_iter().any(|share| {
            let left = share * size * n as f64;
            let lowered = Matrix::from_fn(n, n, |i, j| {
                0.5 * (middle.at(i, j) + middle.at(j, i)) - if i == j { left } else { 0.0 }
            });
            let Some(g) = lowered.cholesky() else { return false };
            let g = enclosed(&g);
            one.minus(&g.times(&g.transpose())).is_dominated()
        }) || one.is_dominated()
    }

    /// Whether each diagonal entry is at least the sum of absolute values of the others in its row, and in its column.
    fn is_dominated(&self) -> bool {
        (0..self.rows).all(|i| {
            let beside = |entry: &dyn Fn(usize) -> Interval| {
                let others = (0..self.cols).filter(|&j| j != i);
                others.fold(Interval::ZERO, |sum, j| sum + Interval::point(entry(j).magnitude()))
            };
            let sum = beside(&|j| self.at(i, j)).high.max(beside(&|j| self.at(j, i)).high);
            self.at(i, i).low >= sum
        })
    }

    /// The largest sum of absolute values of a row.
    pub fn row_sum(&self) -> f64 {
        let sum = |i: usize| (0..self.cols).fold(Interval::ZERO, |s, j| s + Interval::point(self.at(i, j).magnitude()));
        (0..self.rows).map(|i| sum(i).high).fold(0.0, |a, b| if b.is_nan() || b > a { b } else { a })
    }
}

/// A power of 2 near `1 / sqrt(size)`; 1 if there is none.
fn near_root(size: f64) -> f64 {
    let exponent = -0.5 * math::log2(size);
    if exponent.abs() < 500.0 { 2f64.powi(exponent.round() as i32) } else { 1.0 }
}

/// A matrix of points.
pub(crate) fn enclosed(a: &Matrix) -> Enclosure {
    Enclosure::from_fn(a.rows, a.cols, |i, j| Interval::point(a.at(i, j)))
}
