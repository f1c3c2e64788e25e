//! Small dense kernels on padded rows, generic over the lanes. Shapes are run-time numbers; widths are padded strides.
//!
//! `out`, `right` and every square matrix are row-major with the given stride, a multiple of [`LANES`], and zero
//! padding; kernels read and write whole rows, so padding stays zero.

mod lower;

use crate::{LANES, Lanes};
pub use lower::{
    cholesky, cholesky_solve, cholesky_solve_from, log_determinant, mirror, multiply_lower, solve_lower, solve_upper,
};

/// The left factor of a product: entry `(i, k)` is `data[i * row + k * inner]`, which covers a matrix
/// (`row = stride, inner = 1`) and its transpose (`row = 1, inner = stride`).
#[derive(Clone, Copy, Debug)]
pub struct Left<'a> {
    data: &'a [f64],
    row: usize,
    inner: usize,
}

impl<'a> Left<'a> {
    /// The matrix itself.
    #[inline(always)]
    pub fn plain(data: &'a [f64], stride: usize) -> Self {
        Self { data, row: stride, inner: 1 }
    }

    /// Its transpose.
    #[inline(always)]
    pub fn transposed(data: &'a [f64], stride: usize) -> Self {
        Self { data, row: 1, inner: stride }
    }
}

/// What a product does with what `out` held.
#[derive(Clone, Copy, Debug)]
pub enum Into<'a> {
    /// `out = left right`
    Set,
    /// `out += left right`
    Add,
    /// `out -= left right`
    Subtract,
    /// `out = base + left right`; `base` has the stride of `out`.
    AddTo(&'a [f64]),
    /// `out = base - left right`; `base` has the stride of `out`.
    SubtractFrom(&'a [f64]),
}

/// `out (rows x stride) = left (rows x inner) * right (inner x stride)`, or added to or taken from `out`.
#[inline(always)]
pub fn multiply<L: Lanes>(
    out: &mut [f64],
    left: Left,
    right: &[f64],
    stride: usize,
    sizes: (usize, usize),
    into: Into,
) {
    product::<L>((out, stride), left, (right, stride), stride, sizes, into);
}

/// `out (rows x stride) = left (rows x inner) * right`, the rows of `right` being the first `stride` numbers of rows
/// that are `right_stride` apart.
#[inline(always)]
pub fn multiply_strided<L: Lanes>(
    out: &mut [f64],
    left: Left,
    right: (&[f64], usize),
    stride: usize,
    sizes: (usize, usize),
) {
    product::<L>((out, stride), left, right, stride, sizes, Into::Set);
}

/// `out = factor * left (rows x inner) * right (inner x stride)`, into the first `stride` numbers of rows that are
/// `out_stride` apart.
#[inline(always)]
pub fn multiply_into_strided<L: Lanes>(
    (out, out_stride): (&mut [f64], usize),
    left: Left,
    right: &[f64],
    stride: usize,
    sizes: (usize, usize),
    factor: f64,
) {
    product::<L>((out, out_stride), left, (right, stride), stride, sizes, Into::Set);
    for row in out.chunks_mut(out_stride).take(sizes.0) {
        scale::<L>(&mut row[..stride], factor);
    }
}

/// A product of `width` columns, with the given row strides of `out` and `right`.
#[inline(always)]
fn product<L: Lanes>(
    (out, out_stride): (&mut [f64], usize),
    left: Left,
    (right, right_stride): (&[f64], usize),
    width: usize,
    (rows, inner): (usize, usize),
    into: Into,
) {
    if rows == 0 || width == 0 {
        return;
    }
    assert!(width.is_multiple_of(LANES) && width <= out_stride && width <= right_stride);
    assert!(out.len() >= rows * out_stride && right.len() >= inner * right_stride);
    if let Into::AddTo(base) | Into::SubtractFrom(base) = into {
        assert!(base.len() >= rows * out_stride);
    }
    assert!(inner == 0 || left.data.len() > (rows - 1) * left.row + (inner - 1) * left.inner);
    let (out, right) = (out.as_mut_ptr(), right.as_ptr());
    let strides = (out_stride, right_stride);
    let mut column = 0;
    // SAFETY: the assertions above cover every row, column and inner index used below.
    unsafe {
        while L::WIDE && column + 2 * LANES <= width {
            columns::<L, 2>(out, left, right, strides, (0, rows, inner), into, column);
            column += 2 * LANES;
        }
        while column < width {
            columns::<L, 1>(out, left, right, strides, (0, rows, inner), into, column);
            column += LANES;
        }
    }
}

/// `C` lanes of columns of rows `row..rows` of a product, from `column` on; strides are those of `out` and `right`.
///
/// # Safety
/// As [`multiply`] asserts.
#[inline(always)]
unsafe fn columns<L: Lanes, const C: usize>(
    out: *mut f64,
    left: Left,
    right: *const f64,
    strides: (usize, usize),
    (mut row, rows, inner): (usize, usize, usize),
    into: Into,
    column: usize,
) {
    // SAFETY: the caller's.
    unsafe {
        while row + 4 <= rows {
            let to = out.add(row * strides.0 + column);
            block::<L, 4, C>(to, left, row, right.add(column), strides, inner, into, column);
            row += 4;
        }
        let (out, right) = (out.add(row * strides.0 + column), right.add(column));
        match rows - row {
            3 => block::<L, 3, C>(out, left, row, right, strides, inner, into, column),
            2 => block::<L, 2, C>(out, left, row, right, strides, inner, into, column),
            1 => block::<L, 1, C>(out, left, row, right, strides, inner, into, column),
            _ => {}
        }
    }
}

/// `R` rows and `C` lanes of columns of a product, from `column` on.
///
/// # Safety
/// Rows `row..row + R` of `left`, `out` and the base, and `inner` rows of `right`, must exist.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
unsafe fn block<L: Lanes, const R: usize, const C: usize>(
    out: *mut f64,
    left: Left,
    row: usize,
    right: *const f64,
    (out_stride, right_stride): (usize, usize),
    inner: usize,
    into: Into,
    column: usize,
) {
    // SAFETY: the caller's.
    unsafe {
        let mut sums = [[L::zero(); C]; R];
        let left_row = left.data.as_ptr().add(row * left.row);
        for k in 0..inner {
            let mut lines = [L::zero(); C];
            for (c, line) in lines.iter_mut().enumerate() {
                *line = L::load(right.add(k * right_stride + c * LANES));
            }
            for (r, sums) in sums.iter_mut().enumerate() {
                let factor = L::constant(*left_row.add(r * left.row + k * left.inner));
                for (sum, line) in sums.iter_mut().zip(lines) {
                    *sum = factor.mul_add(line, *sum);
                }
            }
        }
        for (r, sums) in sums.into_iter().enumerate() {
            for (c, sum) in sums.into_iter().enumerate() {
                let to = out.add(r * out_stride + c * LANES);
                let place = (row + r) * out_stride + column + c * LANES;
                match into {
                    Into::Set => sum.store(to),
                    Into::Add => (L::load(to) + sum).store(to),
                    Into::Subtract => (L::load(to) - sum).store(to),
                    Into::AddTo(base) => (L::load(base.as_ptr().add(place)) + sum).store(to),
                    Into::SubtractFrom(base) => (L::load(base.as_ptr().add(place)) - sum).store(to),
                }
            }
        }
    }
}

/// `out += factor * row`, over whole padded rows.
#[inline(always)]
pub fn add_scaled<L: Lanes>(out: &mut [f64], factor: f64, row: &[f64]) {
    let len = out.len().min(row.len());
    let by = L::constant(factor);
    let (to, from) = (out.as_mut_ptr(), row.as_ptr());
    for i in (0..len - len % LANES).step_by(LANES) {
        // SAFETY: `i + LANES <= len`, the length of both.
        unsafe { by.mul_add(L::load(from.add(i)), L::load(to.add(i))).store(to.add(i)) };
    }
    for i in len - len % LANES..len {
        out[i] += factor * row[i];
    }
}

/// `out (cols x rows) = a'` for `a` of `rows x cols`.
#[inline(always)]
pub fn transpose<L: Lanes>(out: &mut [f64], out_stride: usize, a: &[f64], stride: usize, (rows, cols): (usize, usize)) {
    if rows == 0 || cols == 0 {
        return;
    }
    assert!(out.len() > (cols - 1) * out_stride + rows - 1 && a.len() > (rows - 1) * stride + cols - 1);
    if L::WIDE && rows.is_multiple_of(LANES) && cols.is_multiple_of(LANES) {
        for i in (0..rows).step_by(LANES) {
            for j in (0..cols).step_by(LANES) {
                // SAFETY: whole blocks of eight by eight lie inside both.
                unsafe {
                    let block = load_block::<L>(a.as_ptr().add(i * stride + j), stride);
                    store_block(L::transposed(block), out.as_mut_ptr().add(j * out_stride + i), out_stride);
                }
            }
        }
        return;
    }
    for i in 0..rows {
        for j in 0..cols {
            // SAFETY: the assertion covers the last entry of both.
            unsafe { *out.get_unchecked_mut(j * out_stride + i) = *a.get_unchecked(i * stride + j) };
        }
    }
}

/// How many of some numbers fill whole lanes, where lanes pay.
#[inline(always)]
fn whole<L: Lanes>(len: usize) -> usize {
    if L::WIDE { len - len % LANES } else { 0 }
}

/// Asks for the first `width` numbers of rows, so that they are in the nearest memory once a loop has run.
#[inline(always)]
fn fetch_rows(rows: &[f64], (stride, width): (usize, usize)) {
    rows.chunks(stride).for_each(|row| ask::<NEAREST>(&row[..row.len().min(width)]));
}

/// Asks for numbers that are used soon, so that they are near when they are.
#[inline(always)]
pub fn fetch(numbers: &[f64]) {
    ask::<NEAR>(numbers);
}

/// As [`fetch`], of the lower triangle of a matrix with this stride.
#[inline(always)]
pub fn fetch_lower(a: &[f64], stride: usize) {
    for (i, row) in a.chunks(stride).enumerate() {
        fetch(&row[..row.len().min(i + 1)]);
    }
}

/// Hints of processors: the first of their own memories, and the second.
const NEAREST: i32 = 3;
const NEAR: i32 = 2;

#[inline(always)]
fn ask<const HINT: i32>(numbers: &[f64]) {
    #[cfg(target_arch = "x86_64")]
    for line in numbers.chunks(LANES) {
        // SAFETY: a hint, which reads and writes nothing.
        unsafe { std::arch::x86_64::_mm_prefetch::<HINT>(line.as_ptr().cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = numbers;
}

/// Adds `a'` (rows x cols, `a` being cols x rows) to the lower triangle of `out`. Numbers right of the diagonal, up to
/// the next multiple of [`LANES`], are changed too.
#[inline(always)]
pub fn add_transposed_lower<L: Lanes>(
    (out, out_stride): (&mut [f64], usize),
    (a, stride): (&[f64], usize),
    (rows, cols): (usize, usize),
) {
    if rows == 0 || cols == 0 {
        return;
    }
    assert!(out.len() > (rows - 1) * out_stride + cols - 1 && a.len() > (cols - 1) * stride + rows - 1);
    let [whole_rows, whole_cols] = [rows, cols].map(whole::<L>);
    for i in (0..whole_rows).step_by(LANES) {
        for j in (0..whole_cols.min(i + LANES)).step_by(LANES) {
            // SAFETY: whole blocks of eight by eight lie inside both.
            unsafe {
                let block = L::transposed(load_block::<L>(a.as_ptr().add(j * stride + i), stride));
                let to = out.as_mut_ptr().add(i * out_stride + j);
                for (row, moved) in block.into_iter().enumerate() {
                    let to = to.add(row * out_stride);
                    (L::load(to) + moved).store(to);
                }
            }
        }
    }
    for i in 0..rows {
        let first = if i < whole_rows { whole_cols } else { 0 };
        for j in first..cols.min(i + 1) {
            out[i * out_stride + j] += a[j * stride + i];
        }
    }
}

/// Eight rows of eight numbers, `stride` apart.
///
/// # Safety
/// They must be readable.
#[inline(always)]
unsafe fn load_block<L: Lanes>(from: *const f64, stride: usize) -> [L; LANES] {
    let mut block = [L::zero(); LANES];
    for (i, row) in block.iter_mut().enumerate() {
        // SAFETY: the caller's.
        *row = unsafe { L::load(from.add(i * stride)) };
    }
    block
}

/// Writes what [`load_block`] reads.
///
/// # Safety
/// The rows must be writable.
#[inline(always)]
unsafe fn store_block<L: Lanes>(block: [L; LANES], to: *mut f64, stride: usize) {
    for (i, row) in block.into_iter().enumerate() {
        // SAFETY: the caller's.
        unsafe { row.store(to.add(i * stride)) };
    }
}

/// `a = (a + a') / 2` for a square matrix of order `n`.
#[inline(always)]
pub fn symmetrise<L: Lanes>(a: &mut [f64], n: usize, stride: usize) {
    if n == 0 {
        return;
    }
    assert!(a.len() > (n - 1) * stride + n - 1);
    if L::WIDE && n.is_multiple_of(LANES) {
        for i in (0..n).step_by(LANES) {
            for j in (0..=i).step_by(LANES) {
                // SAFETY: whole blocks of eight by eight lie inside.
                unsafe { symmetrise_blocks::<L>(a.as_mut_ptr(), (i, j), stride) };
            }
        }
        return;
    }
    for i in 1..n {
        for j in 0..i {
            // SAFETY: the assertion covers the last entry.
            unsafe {
                let mean = 0.5 * (a.get_unchecked(i * stride + j) + a.get_unchecked(j * stride + i));
                *a.get_unchecked_mut(i * stride + j) = mean;
                *a.get_unchecked_mut(j * stride + i) = mean;
            }
        }
    }
}

/// The mean of a block and its mirror, in both places.
///
/// # Safety
/// Blocks of eight by eight from rows and columns `i` and `j` must lie inside.
#[inline(always)]
unsafe fn symmetrise_blocks<L: Lanes>(a: *mut f64, (i, j): (usize, usize), stride: usize) {
    // SAFETY: the caller's.
    unsafe {
        let (here, there) = (a.add(i * stride + j), a.add(j * stride + i));
        let mut mean = load_block::<L>(here, stride);
        let mirror = L::transposed(load_block::<L>(there, stride));
        for (mean, mirror) in mean.iter_mut().zip(mirror) {
            *mean = (*mean + mirror) * L::constant(0.5);
        }
        store_block(mean, here, stride);
        if i != j {
            store_block(L::transposed(mean), there, stride);
        }
    }
}

/// A block and its transpose in the mirrored place.
///
/// # Safety
/// Blocks of eight by eight from rows and columns `i` and `j` must lie inside.
#[inline(always)]
unsafe fn mirror_block<L: Lanes>(a: *mut f64, (i, j): (usize, usize), stride: usize) {
    // SAFETY: the caller's.
    unsafe {
        let (here, there) = (a.add(i * stride + j), a.add(j * stride + i));
        let transposed = L::transposed(load_block::<L>(here, stride));
        if i != j {
            return store_block(transposed, there, stride);
        }
        // What lies above the diagonal of a block on it is not read.
        let mut block = [[0.0; LANES]; LANES];
        for (r, row) in block.iter_mut().enumerate() {
            L::load(here.add(r * stride)).store(row.as_mut_ptr());
        }
        for (c, row) in block.iter().enumerate() {
            for (r, entry) in row[..c].iter().enumerate() {
                *here.add(r * stride + c) = *entry;
            }
        }
    }
}

/// The dot product of two vectors of equal length.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// `row *= factor`, over whole padded rows.
#[inline(always)]
pub fn scale<L: Lanes>(row: &mut [f64], factor: f64) {
    let (len, by) = (row.len(), L::constant(factor));
    let to = row.as_mut_ptr();
    for i in (0..len - len % LANES).step_by(LANES) {
        // SAFETY: `i + LANES <= len`.
        unsafe { (L::load(to.add(i)) * by).store(to.add(i)) };
    }
    for value in &mut row[len - len % LANES..] {
        *value *= factor;
    }
}

#[cfg(test)]
mod tests;
