//! Kernels for symmetric matrices, of which only the lower triangle is computed, and for triangular factors.

use super::{Into, Left, add_scaled, columns, fetch_rows, multiply, scale, whole};
use crate::math;
use crate::{LANES, Lanes, padded};

/// Terms of a sum from which what it is added to is fetched meanwhile.
const LONG: usize = 16;
/// Rows that are computed together.
const ROWS: usize = 4;
/// Below this order plain loops are as fast as lanes.
const SMALL: usize = 8;

/// The lower triangle of `out (rows x rows) = left (rows x inner) * right (inner x rows)`, or added to or taken from
/// `out`, where the product is symmetric. Rows of `out` and its base are `out_stride` apart, those of `right` are
/// `right_stride`. Numbers right of the diagonal, up to the next multiple of [`LANES`], are those of the product too; what is
/// further right stays as it was.
#[inline(always)]
pub fn multiply_lower<L: Lanes>(
    (out, out_stride): (&mut [f64], usize),
    left: Left,
    (right, right_stride): (&[f64], usize),
    (rows, inner): (usize, usize),
    into: Into,
) {
    if rows == 0 {
        return;
    }
    let width = padded(rows);
    assert!(out_stride >= width && right_stride >= width && out_stride.is_multiple_of(LANES));
    assert!(
        right_stride.is_multiple_of(LANES) && out.len() >= rows * out_stride && right.len() >= inner * right_stride
    );
    if let Into::AddTo(base) | Into::SubtractFrom(base) = into {
        assert!(base.len() >= rows * out_stride);
    }
    assert!(inner == 0 || left.data.len() > (rows - 1) * left.row + (inner - 1) * left.inner);
    let (out, right) = (out.as_mut_ptr(), right.as_ptr());
    let strides = (out_stride, right_stride);
    // SAFETY: the assertions above cover every row, column and inner index used below; a group of rows begins at a multiple
    // of its size, so that its last row is below the next multiple of the lanes.
    unsafe {
        for first in (0..rows).step_by(LANES) {
            let end = (first + LANES).min(rows);
            if let (true, Into::AddTo(base) | Into::SubtractFrom(base)) = (inner >= LONG, into) {
                fetch_rows(&base[first * out_stride..end * out_stride], (out_stride, padded(end)));
            }
            let mut column = 0;
            while L::WIDE && column + 2 * LANES <= padded(end) {
                columns::<L, 2>(out, left, right, strides, (first, end, inner), into, column);
                column += 2 * LANES;
            }
            while column < padded(end) {
                columns::<L, 1>(out, left, right, strides, (first, end, inner), into, column);
                column += LANES;
            }
        }
    }
}

/// Copies the lower triangle of a square matrix of order `n` to its upper one.
#[inline(always)]
pub fn mirror<L: Lanes>(a: &mut [f64], n: usize, stride: usize) {
    if n == 0 {
        return;
    }
    assert!(a.len() > (n - 1) * stride + n - 1);
    let whole = whole::<L>(n);
    for i in (0..whole).step_by(LANES) {
        for j in (0..=i).step_by(LANES) {
            // SAFETY: whole blocks of eight by eight lie inside.
            unsafe { super::mirror_block::<L>(a.as_mut_ptr(), (i, j), stride) };
        }
    }
    for i in whole.max(1)..n {
        for j in 0..i {
            // SAFETY: the assertion covers the last entry.
            unsafe { *a.get_unchecked_mut(j * stride + i) = *a.get_unchecked(i * stride + j) };
        }
    }
}

/// Factors a symmetric positive definite matrix in place: `a = G G'`, `G` lower triangular. Only the lower triangle is
/// read; the upper one may be overwritten. `Err(i)` where the leading minor of order `i + 1` is not positive.
#[inline(always)]
pub fn cholesky(a: &mut [f64], n: usize, stride: usize) -> Result<(), usize> {
    if n < SMALL { cholesky_by_entries(a, n, stride) } else { cholesky_by_rows(a, n, stride) }
}

#[inline(always)]
fn cholesky_by_entries(a: &mut [f64], n: usize, stride: usize) -> Result<(), usize> {
    for j in 0..n {
        let mut pivot = a[j * stride + j];
        for k in 0..j {
            pivot -= a[j * stride + k] * a[j * stride + k];
        }
        let root = root_of(pivot).ok_or(j)?;
        a[j * stride + j] = root;
        let reciprocal = 1.0 / root;
        for i in j + 1..n {
            let mut sum = a[i * stride + j];
            for k in 0..j {
                sum -= a[i * stride + k] * a[j * stride + k];
            }
            a[i * stride + j] = sum * reciprocal;
        }
    }
    Ok(())
}

/// As rows of `G'` in the upper triangle, each taken from those below it, which compilers turn into lanes.
#[inline(always)]
fn cholesky_by_rows(a: &mut [f64], n: usize, stride: usize) -> Result<(), usize> {
    for i in 1..n {
        for j in 0..i {
            a[j * stride + i] = a[i * stride + j];
        }
    }
    for j in 0..n {
        let (head, below) = a.split_at_mut((j + 1) * stride);
        let row = &mut head[j * stride..j * stride + n];
        let root = root_of(row[j]).ok_or(j)?;
        let reciprocal = 1.0 / root;
        row[j] = root;
        row[j + 1..].iter_mut().for_each(|entry| *entry *= reciprocal);
        for i in j + 1..n {
            let (factor, from) = (row[i], (i - j - 1) * stride);
            for (to, entry) in below[from + i..from + n].iter_mut().zip(&row[i..]) {
                *to -= factor * entry;
            }
        }
    }
    for i in 1..n {
        for j in 0..i {
            a[i * stride + j] = a[j * stride + i];
        }
    }
    Ok(())
}

#[inline(always)]
fn root_of(pivot: f64) -> Option<f64> {
    (pivot > 0.0 && pivot.is_finite()).then(|| pivot.sqrt())
}

/// `log |a|` from the factor that [`cholesky`] left.
#[inline(always)]
pub fn log_determinant(factor: &[f64], n: usize, stride: usize) -> f64 {
    2.0 * (0..n).map(|i| math::ln(factor[i * stride + i])).sum::<f64>()
}

/// Solves `G G' X = B` in place, the `n` rows of `right` being those of `B`, with the factor that [`cholesky`] left.
#[inline(always)]
pub fn cholesky_solve<L: Lanes>(
    factor: &[f64],
    factor_stride: usize,
    right: &mut [f64],
    right_stride: usize,
    n: usize,
) {
    solve_lower::<L>(factor, factor_stride, right, right_stride, n);
    solve_upper::<L>(factor, factor_stride, right, right_stride, n);
}

/// Solves `G X = B` in place, the `n` rows of `right` being those of `B`.
#[inline(always)]
pub fn solve_lower<L: Lanes>(factor: &[f64], factor_stride: usize, right: &mut [f64], right_stride: usize, n: usize) {
    for first in (0..n).step_by(ROWS) {
        let (done, rest) = right.split_at_mut(first * right_stride);
        let rows = ROWS.min(n - first);
        if first > 0 && right_stride.is_multiple_of(LANES) {
            let left = Left::plain(&factor[first * factor_stride..], factor_stride);
            multiply::<L>(rest, left, done, right_stride, (rows, first), Into::Subtract);
        } else {
            for (i, row) in (first..).zip(rest.chunks_mut(right_stride).take(rows)) {
                for k in 0..first {
                    let from = &done[k * right_stride..(k + 1) * right_stride];
                    add_scaled::<L>(row, -factor[i * factor_stride + k], from);
                }
            }
        }
        for i in first..first + rows {
            let (above, row) = rest.split_at_mut((i - first) * right_stride);
            let row = &mut row[..right_stride];
            for (k, above) in (first..i).zip(above.chunks(right_stride)) {
                add_scaled::<L>(row, -factor[i * factor_stride + k], above);
            }
            scale::<L>(row, 1.0 / factor[i * factor_stride + i]);
        }
    }
}

/// Solves `G' X = B` in place, the `n` rows of `right` being those of `B`.
#[inline(always)]
pub fn solve_upper<L: Lanes>(factor: &[f64], factor_stride: usize, right: &mut [f64], right_stride: usize, n: usize) {
    for first in (0..n).step_by(ROWS).rev() {
        let end = n.min(first + ROWS);
        let (head, below) = right.split_at_mut(end * right_stride);
        let rest = &mut head[first * right_stride..];
        if end < n && right_stride.is_multiple_of(LANES) {
            let left = Left::transposed(&factor[end * factor_stride + first..], factor_stride);
            multiply::<L>(rest, left, below, right_stride, (end - first, n - end), Into::Subtract);
        } else {
            for (i, row) in (first..).zip(rest.chunks_mut(right_stride)) {
                for k in end..n {
                    let from = (k - end) * right_stride;
                    add_scaled::<L>(row, -factor[k * factor_stride + i], &below[from..from + right_stride]);
                }
            }
        }
        for i in (first..end).rev() {
            let (row, after) = rest[(i - first) * right_stride..].split_at_mut(right_stride);
            for (k, after) in (i + 1..end).zip(after.chunks(right_stride)) {
                add_scaled::<L>(row, -factor[k * factor_stride + i], after);
            }
            scale::<L>(row, 1.0 / factor[i * factor_stride + i]);
        }
    }
}

/// As [`cholesky_solve`], with the rows of `B` in `right` and the solution in `out`.
#[inline(always)]
pub fn cholesky_solve_from<L: Lanes>(
    factor: &[f64],
    factor_stride: usize,
    right: &[f64],
    out: &mut [f64],
    stride: usize,
    n: usize,
) {
    assert!(out.len() >= n * stride && right.len() >= n * stride);
    for i in 0..n {
        for column in (0..stride).step_by(LANES) {
            // SAFETY: row i and this column are inside both.
            unsafe {
                let at = i * stride + column;
                L::load(right.as_ptr().add(at)).store(out.as_mut_ptr().add(at));
            }
        }
    }
    cholesky_solve::<L>(factor, factor_stride, out, stride, n);
}
