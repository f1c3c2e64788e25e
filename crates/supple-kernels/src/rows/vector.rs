//! Kernels on single rows.

use super::{Rows, View, holds};
use crate::{Job, LANES, Lanes};

/// `out += factor * row`, over whole padded rows.
///
/// Example: [`transpose`](crate::rows::transpose).
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

/// `row *= factor`, over whole padded rows.
///
/// Example: [`transpose`](crate::rows::transpose).
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

/// Sets all but the first `count` numbers of a padded row to 0.
///
/// Example: [`transpose`](crate::rows::transpose).
#[inline(always)]
pub fn clear_beyond<L: Lanes>(row: &mut [f64], count: usize) {
    let first = count - count % LANES;
    assert!(row.len().is_multiple_of(LANES));
    for i in (first..row.len()).step_by(LANES) {
        // SAFETY: `i + LANES` is at most the length.
        unsafe { L::load(row.as_ptr().add(i)).first(count.saturating_sub(i)).store(row.as_mut_ptr().add(i)) };
    }
}

/// The dot product of two vectors of equal length, in eight running sums, the same at every level.
///
/// ```
/// assert_eq!(supple_kernels::rows::dot(&[1.0, 2.0], &[3.0, 4.0]), 11.0);
/// ```
#[inline(always)]
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, rest), (b, other)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let last: f64 = rest.iter().zip(other).map(|(x, y)| x * y).sum();
    if a.is_empty() {
        return last;
    }
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for i in 0..LANES {
            sums[i] += a[i] * b[i];
        }
    }
    let [s, t, u, v, w, x, y, z] = sums;
    ((s + w) + (u + y)) + ((t + x) + (v + z)) + last
}

/// `out = base + factor sum_k weights_k a_k`, over whole padded rows `a_k`.
///
/// Example: [`transpose`](crate::rows::transpose).
#[inline(always)]
pub fn combine<L: Lanes, R: Rows>(out: &mut [f64], base: Option<&[f64]>, factor: f64, weights: &[f64], a: View) {
    let width = out.len();
    assert!(width.is_multiple_of(LANES) && holds(a.numbers, a.stride, (weights.len(), width)));
    assert!(base.is_none_or(|base| base.len() >= width));
    let job = Combine {
        to: out.as_mut_ptr(),
        width,
        base: base.map_or(std::ptr::null(), <[f64]>::as_ptr),
        factor,
        weights,
        a,
    };
    if R::CALLED {
        L::apart(job);
        return;
    }
    let mut column = 0;
    while column < width {
        // SAFETY: the assertions above.
        unsafe { job.columns::<L, 1>(column) };
        column += LANES;
        if R::SHORT {
            break;
        }
    }
}

struct Combine<'a> {
    to: *mut f64,
    width: usize,
    base: *const f64,
    factor: f64,
    weights: &'a [f64],
    a: View<'a>,
}

impl Job for Combine<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut column = 0;
        // SAFETY: `combine` checked the sizes.
        unsafe {
            while L::WIDE && column + 4 * LANES <= self.width {
                self.columns::<L, 4>(column);
                column += 4 * LANES;
            }
            while column < self.width {
                self.columns::<L, 1>(column);
                column += LANES;
            }
        }
    }
}

impl Combine<'_> {
    /// `C` lanes of columns from `column` on, in two running sums.
    ///
    /// # Safety
    /// As [`combine`] checks.
    #[inline(always)]
    unsafe fn columns<L: Lanes, const C: usize>(&self, column: usize) {
        let (mut even, mut odd) = ([L::zero(); C], [L::zero(); C]);
        let (pairs, last) = self.weights.as_chunks::<2>();
        // SAFETY: the caller's.
        let row = |k: usize| unsafe { self.a.numbers.as_ptr().add(k * self.a.stride + column) };
        for (k, &[one, other]) in pairs.iter().enumerate() {
            // SAFETY: the caller's.
            unsafe {
                add_row(&mut even, one, row(2 * k));
                add_row(&mut odd, other, row(2 * k + 1));
            }
        }
        if let [weight] = *last {
            // SAFETY: the caller's.
            unsafe { add_row(&mut even, weight, row(2 * pairs.len())) };
        }
        let factor = L::constant(self.factor);
        for (c, (even, odd)) in even.into_iter().zip(odd).enumerate() {
            // SAFETY: the caller's.
            unsafe {
                let at = column + c * LANES;
                let base = if self.base.is_null() { L::zero() } else { L::load(self.base.add(at)) };
                factor.mul_add(even + odd, base).store(self.to.add(at));
            }
        }
    }
}

/// `sums += weight row`
///
/// # Safety
/// The row must hold `C` lanes.
#[inline(always)]
unsafe fn add_row<L: Lanes, const C: usize>(sums: &mut [L; C], weight: f64, row: *const f64) {
    let weight = L::constant(weight);
    for (c, sum) in sums.iter_mut().enumerate() {
        // SAFETY: the caller's.
        *sum = weight.mul_add(unsafe { L::load(row.add(c * LANES)) }, *sum);
    }
}
