//! Solves with the factors that [`factor`](super::factor) leaves, of which only the upper triangle `U` is read.

use super::product::subtract_product;
use super::{FEW, Rows, View, ViewMut, holds};
use crate::{Job, LANES, Lanes, padded};

/// What [`factor`](super::factor) left of a matrix of order `n`.
///
/// Example: [`factor`](crate::rows::factor).
#[derive(Clone, Copy, Debug)]
pub struct Factored<'a> {
    /// `U`.
    pub upper: View<'a>,
    /// The reciprocals of its diagonal.
    pub reciprocals: &'a [f64],
    /// The order.
    pub n: usize,
}

/// Solves `U' X = B` in place, where `B` is the first `n` rows of `right`, as wide as its stride.
///
/// Example: [`factor`](crate::rows::factor).
#[inline(always)]
pub fn solve_lower<L: Lanes, R: Rows>(factored: Factored, right: ViewMut) {
    apart(factored, right).forward::<L, R>();
}

/// Solves `U X = B` in place, where `B` is the first `n` rows of `right`, as wide as its stride.
///
/// Example: [`factor`](crate::rows::factor).
#[inline(always)]
pub fn solve_upper<L: Lanes, R: Rows>(factored: Factored, right: ViewMut) {
    apart(factored, right).backward::<L, R>();
}

/// As [`solve_lower`], with `U` and `B` in the rows of one matrix: `B` takes `width` numbers from column `from` on.
///
/// Example: [`factor`](crate::rows::factor).
#[inline(always)]
pub fn solve_lower_beside<L: Lanes, R: Rows>(rows: ViewMut, n: usize, beside: (usize, usize), reciprocals: &[f64]) {
    together::<R>(rows, n, beside, reciprocals).forward::<L, R>();
}

/// As [`solve_upper`], with `U` and `B` in the rows of one matrix: `B` takes `width` numbers from column `from` on.
///
/// Example: [`factor`](crate::rows::factor).
#[inline(always)]
pub fn solve_upper_beside<L: Lanes, R: Rows>(rows: ViewMut, n: usize, beside: (usize, usize), reciprocals: &[f64]) {
    together::<R>(rows, n, beside, reciprocals).backward::<L, R>();
}

/// A solve with checked sizes, with `B` stored in the rows of `U`, in `width` columns from a given one on.
#[inline(always)]
fn together<'a, R: Rows>(rows: ViewMut, n: usize, (from, width): (usize, usize), reciprocals: &'a [f64]) -> Solve<'a> {
    assert!(from >= R::stride(n) && from.is_multiple_of(LANES) && width.is_multiple_of(LANES));
    assert!(reciprocals.len() >= R::stride(n) && holds(rows.numbers, rows.stride, (n, from + width)));
    let (u, stride) = (rows.numbers.as_mut_ptr(), rows.stride);
    Solve { u, u_stride: stride, reciprocals, n, right: u.wrapping_add(from), stride, width }
}

/// A solve whose sizes are checked, `U` and `B` being different matrices.
#[inline(always)]
fn apart<'a>(factored: Factored<'a>, right: ViewMut) -> Solve<'a> {
    let (Factored { upper, reciprocals, n }, width) = (factored, right.stride);
    assert!(holds(upper.numbers, upper.stride, (n, padded(n))) && reciprocals.len() >= padded(n));
    assert!(holds(right.numbers, right.stride, (n, width)) && width.is_multiple_of(LANES));
    let (u, right) = (upper.numbers.as_ptr(), right.numbers.as_mut_ptr());
    Solve { u, u_stride: upper.stride, reciprocals, n, right, stride: width, width }
}

/// A solve whose sizes were checked.
struct Solve<'a> {
    u: *const f64,
    u_stride: usize,
    reciprocals: &'a [f64],
    n: usize,
    right: *mut f64,
    stride: usize,
    width: usize,
}

impl Solve<'_> {
    #[inline(always)]
    fn forward<L: Lanes, R: Rows>(self) {
        if R::SHORT || !R::CALLED && self.n <= FEW {
            // SAFETY: the sizes were checked.
            unsafe { self.forward_by_rows::<L>() };
        } else {
            L::apart(Forward(self));
        }
    }

    #[inline(always)]
    fn backward<L: Lanes, R: Rows>(self) {
        if R::SHORT || !R::CALLED && self.n <= FEW {
            // SAFETY: the sizes were checked.
            unsafe { self.backward_by_rows::<L>() };
        } else {
            L::apart(Backward(self));
        }
    }

    /// # Safety
    /// All that is named must exist.
    #[inline(always)]
    unsafe fn forward_by_rows<L: Lanes>(self) {
        for column in (0..self.width).step_by(LANES) {
            for i in 0..self.n {
                // SAFETY: the caller's.
                unsafe { self.row::<L>((i, column), 0..i, |k| k * self.u_stride + i) };
            }
        }
    }

    /// # Safety
    /// All that is named must exist.
    #[inline(always)]
    unsafe fn backward_by_rows<L: Lanes>(self) {
        for column in (0..self.width).step_by(LANES) {
            for i in (0..self.n).rev() {
                // SAFETY: the caller's.
                unsafe { self.row::<L>((i, column), i + 1..self.n, |k| i * self.u_stride + k) };
            }
        }
    }

    /// Row `i` of the solution, the lanes from `column` on, given the other rows, whose factors are at `place`.
    ///
    /// # Safety
    /// All that is named must exist.
    #[inline(always)]
    unsafe fn row<L: Lanes>(
        &self,
        (i, column): (usize, usize),
        others: std::ops::Range<usize>,
        place: impl Fn(usize) -> usize,
    ) {
        // SAFETY: the caller's.
        unsafe {
            let right = self.right.add(column);
            let to = right.add(i * self.stride);
            let mut row = L::load(to);
            for k in others {
                let factor = L::constant(*self.u.add(place(k)));
                row = factor.neg_mul_add(L::load(right.add(k * self.stride)), row);
            }
            (row * self.reciprocals[i]).store(to);
        }
    }

    /// The block of the factor on the diagonal.
    ///
    /// # Safety
    /// It must exist.
    #[inline(always)]
    unsafe fn block(&self, first: usize) -> Block {
        let mut reciprocals = [0.0; LANES];
        reciprocals.copy_from_slice(&self.reciprocals[first..first + LANES]);
        // SAFETY: the caller's.
        let factor = unsafe { self.u.add(first * (self.u_stride + 1)) };
        Block { factor, stride: self.u_stride, size: LANES.min(self.n - first), reciprocals }
    }
}

struct Forward<'a>(Solve<'a>);

impl Job for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self(solve) = self;
        let Solve { u, u_stride, n, right, stride, width, .. } = solve;
        let mut first = 0;
        // SAFETY: the sizes were checked.
        unsafe {
            while first < n {
                let (block, rows) = (solve.block(first), right.add(first * stride));
                if first > 0 {
                    let to = (rows, stride);
                    subtract_product::<L, true>(to, (u.add(first), u_stride), right, (block.size, first, width));
                }
                block.forward::<L>(rows, stride, width);
                first += LANES;
            }
        }
    }
}

struct Backward<'a>(Solve<'a>);

impl Job for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self(solve) = self;
        let Solve { u, u_stride, n, right, stride, width, .. } = solve;
        let mut end = padded(n);
        // SAFETY: the sizes were checked.
        unsafe {
            while end > 0 {
                let first = end - LANES;
                let (block, rows) = (solve.block(first), right.add(first * stride));
                if end < n {
                    let (to, left) = ((rows, stride), (u.add(first * u_stride + end), u_stride));
                    subtract_product::<L, false>(to, left, right.add(end * stride), (LANES, n - end, width));
                }
                block.backward::<L>(rows, stride, width);
                end = first;
            }
        }
    }
}

/// A block of `U` on the diagonal, of eight rows at most.
#[derive(Clone, Copy)]
pub(super) struct Block {
    pub factor: *const f64,
    pub stride: usize,
    pub size: usize,
    /// Of the diagonal.
    pub reciprocals: [f64; LANES],
}

impl Block {
    /// Solves `U' X = B` in place for `width` columns.
    ///
    /// # Safety
    /// The block, and as many rows of `width` numbers, `stride` apart, must exist.
    #[inline(always)]
    pub unsafe fn forward<L: Lanes>(&self, right: *mut f64, stride: usize, width: usize) {
        let mut column = 0;
        // SAFETY: the caller's.
        unsafe {
            while L::WIDE && column + 2 * LANES <= width {
                self.forward_columns::<L, 2>(right.add(column), stride);
                column += 2 * LANES;
            }
            while column < width {
                self.forward_columns::<L, 1>(right.add(column), stride);
                column += LANES;
            }
        }
    }

    /// # Safety
    /// As [`Block::forward`].
    #[inline(always)]
    unsafe fn forward_columns<L: Lanes, const C: usize>(&self, right: *mut f64, stride: usize) {
        let mut x = [[L::zero(); C]; LANES];
        for i in 0..LANES {
            if i == self.size {
                break;
            }
            // SAFETY: the caller's.
            unsafe {
                let mut row = load::<L, C>(right.add(i * stride));
                for (j, x) in x[..i].iter().enumerate() {
                    let factor = L::constant(*self.factor.add(j * self.stride + i));
                    for c in 0..C {
                        row[c] = factor.neg_mul_add(x[c], row[c]);
                    }
                }
                x[i] = self.finish(i, row, right.add(i * stride));
            }
        }
    }

    /// Solves `U X = B` in place for `width` columns.
    ///
    /// # Safety
    /// As [`Block::forward`]; numbers of the block right of its last column must be finite.
    #[inline(always)]
    unsafe fn backward<L: Lanes>(&self, right: *mut f64, stride: usize, width: usize) {
        let mut column = 0;
        // SAFETY: the caller's.
        unsafe {
            while L::WIDE && column + 2 * LANES <= width {
                self.backward_columns::<L, 2>(right.add(column), stride);
                column += 2 * LANES;
            }
            while column < width {
                self.backward_columns::<L, 1>(right.add(column), stride);
                column += LANES;
            }
        }
    }

    /// # Safety
    /// As [`Block::backward`].
    #[inline(always)]
    unsafe fn backward_columns<L: Lanes, const C: usize>(&self, right: *mut f64, stride: usize) {
        let mut x = [[L::zero(); C]; LANES];
        for i in (0..LANES).rev() {
            if i >= self.size {
                continue;
            }
            // SAFETY: the caller's.
            unsafe {
                let mut row = load::<L, C>(right.add(i * stride));
                for j in (i + 1..LANES).rev() {
                    let factor = L::constant(*self.factor.add(i * self.stride + j));
                    for c in 0..C {
                        row[c] = factor.neg_mul_add(x[j][c], row[c]);
                    }
                }
                x[i] = self.finish(i, row, right.add(i * stride));
            }
        }
    }

    /// Computes a row of the solution from its remainder.
    ///
    /// # Safety
    /// `C` lanes must be writable.
    #[inline(always)]
    unsafe fn finish<L: Lanes, const C: usize>(&self, i: usize, mut row: [L; C], to: *mut f64) -> [L; C] {
        let reciprocal = L::constant(self.reciprocals[i]);
        for (c, entry) in row.iter_mut().enumerate() {
            *entry = *entry * reciprocal;
            // SAFETY: the caller's.
            unsafe { entry.store(to.add(c * LANES)) };
        }
        row
    }
}

/// # Safety
/// `C` lanes must be readable.
#[inline(always)]
unsafe fn load<L: Lanes, const C: usize>(from: *const f64) -> [L; C] {
    let mut row = [L::zero(); C];
    for (c, entry) in row.iter_mut().enumerate() {
        // SAFETY: the caller's.
        *entry = unsafe { L::load(from.add(c * LANES)) };
    }
    row
}

/// Solves `G G' x = b` in place for one column, with the lower triangle that [`cholesky`](super::cholesky) left.
///
/// Example: [`cholesky`](crate::rows::cholesky).
pub fn solve_column(factor: &[f64], stride: usize, x: &mut [f64]) {
    let n = x.len();
    for i in 0..n {
        for k in 0..i {
            x[i] -= factor[i * stride + k] * x[k];
        }
        x[i] /= factor[i * stride + i];
    }
    for i in (0..n).rev() {
        for k in i + 1..n {
            x[i] -= factor[k * stride + i] * x[k];
        }
        x[i] /= factor[i * stride + i];
    }
}
