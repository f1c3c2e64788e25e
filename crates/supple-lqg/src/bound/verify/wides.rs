//! Matrices of extended-precision numbers.

use std::iter::repeat_n;

use super::interval::Interval;
use super::matrix::{Enclosure, Matrix, by_rows};
use super::wide::Wide;

/// A matrix of wide numbers, by rows.
#[derive(Clone)]
pub(crate) struct Wides<const K: usize> {
    pub rows: usize,
    pub cols: usize,
    pub entries: Vec<Wide<K>>,
}

impl<const K: usize> Wides<K> {
    pub fn from_fn(rows: usize, cols: usize, entry: impl Fn(usize, usize) -> Wide<K>) -> Self {
        Self { rows, cols, entries: by_rows(&mut repeat_n(cols, rows), &entry) }
    }

    pub fn new(a: &Matrix) -> Self {
        Self::from_fn(a.rows, a.cols, |i, j| Wide::new(a.at(i, j)))
    }

    pub fn scaled(&self, by: Wide<K>) -> Self {
        Self::from_fn(self.rows, self.cols, |i, j| self.at(i, j) * by)
    }

    pub fn identity(n: usize) -> Self {
        Self::from_fn(n, n, |i, j| if i == j { Wide::power_of_two(0) } else { Wide::ZERO })
    }

    pub fn at(&self, i: usize, j: usize) -> Wide<K> {
        self.entries[i * self.cols + j]
    }

    pub fn transpose(&self) -> Self {
        Self::from_fn(self.cols, self.rows, |i, j| self.at(j, i))
    }

    pub fn plus(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, self.cols, |i, j| self.at(i, j) + other.at(i, j))
    }

    pub fn beside(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, self.cols + other.cols, |i, j| {
            if j < self.cols { self.at(i, j) } else { other.at(i, j - self.cols) }
        })
    }

    pub fn columns(&self, first: usize, count: usize) -> Self {
        Self::from_fn(self.rows, count, |i, j| self.at(i, first + j))
    }

    pub fn times(&self, other: &Self) -> Self {
        let mut out = Self::from_fn(self.rows, other.cols, |_, _| Wide::ZERO);
        for i in 0..self.rows {
            for k in 0..self.cols {
                let factor = self.at(i, k);
                if factor.is_zero() {
                    continue;
                }
                for j in 0..other.cols {
                    let entry = &mut out.entries[i * other.cols + j];
                    *entry = *entry + factor * other.at(k, j);
                }
            }
        }
        out
    }

    /// The product, with entries below this share of the terms that they are summed from set to 0.
    pub fn times_without_rounding(&self, other: &Self, share: f64) -> Self {
        let (product, size) = (self.times(other), self.magnitude().times(&other.magnitude()));
        Self::from_fn(product.rows, product.cols, |i, j| {
            let entry = product.at(i, j);
            if entry.magnitude() <= size.at(i, j) * share { Wide::ZERO } else { entry }
        })
    }

    /// The mean of a matrix and its transpose.
    pub fn symmetric(&self) -> Self {
        let half = Wide::power_of_two(-1);
        Self::from_fn(self.rows, self.cols, |i, j| (self.at(i, j) + self.at(j, i)) * half)
    }

    /// `self^-1 b`, by elimination with pivots; `None` if it is singular.
    pub fn solve(&self, b: &Self) -> Option<Self> {
        let (n, width) = (self.rows, self.cols + b.cols);
        let mut work = self.beside(b);
        for k in 0..n {
            let pivot = (k..n).max_by(|&i, &j| {
                let (one, other) = (work.at(i, k), work.at(j, k));
                if one.abs() == other.abs() {
                    std::cmp::Ordering::Equal
                } else if (one.abs() - other.abs()).is_positive() {
                    std::cmp::Ordering::Greater
                } else {
                    std::cmp::Ordering::Less
                }
            })?;
            if work.at(pivot, k).is_zero() {
                return None;
            }
            (0..width).for_each(|j| work.entries.swap(pivot * width + j, k * width + j));
            let by = work.at(k, k).inverse();
            for j in k..width {
                work.entries[k * width + j] = work.at(k, j) * by;
            }
            for i in (0..n).filter(|&i| i != k) {
                let factor = work.at(i, k);
                if factor.is_zero() {
                    continue;
                }
                for j in k..width {
                    work.entries[i * width + j] = work.at(i, j) - factor * work.at(k, j);
                }
            }
        }
        Some(work.columns(n, b.cols))
    }

    /// The matrix as intervals, with these bounds on the error of each entry.
    pub fn enclosed(&self, off: &Matrix) -> Enclosure {
        Enclosure::from_fn(self.rows, self.cols, |i, j| {
            let (entry, off) = (self.at(i, j), off.at(i, j));
            // Exactly 0 where nothing was added.
            if entry.is_zero() && off == 0.0 {
                return Interval::ZERO;
            }
            let (low, high) = entry.around(off);
            Interval { low, high }
        })
    }

    /// The absolute values, rounded up.
    pub fn magnitude(&self) -> Matrix {
        Matrix::from_fn(self.rows, self.cols, |i, j| self.at(i, j).magnitude())
    }
}
