//! Prefetch hints for numbers that are used soon.

use crate::LANES;

/// Prefetches numbers that are used soon.
///
/// ```
/// // Nothing but the time of a later read depends on it.
/// supple_kernels::rows::fetch(&[1.0; 64]);
/// ```
#[inline(always)]
pub fn fetch(numbers: &[f64]) {
    ask::<NEAR>(numbers.as_ptr(), numbers.len());
}

/// Like [`fetch`], for the lower triangle of a matrix with this stride.
///
/// ```
/// // Nothing but the time of a later read depends on it.
/// supple_kernels::rows::fetch_lower(&[1.0; 64], 8);
/// ```
#[inline(always)]
pub fn fetch_lower(a: &[f64], stride: usize) {
    for (i, row) in a.chunks(stride).enumerate() {
        fetch(&row[..row.len().min(i + 1)]);
    }
}

/// Prefetches numbers into the nearest cache, for use after a loop.
#[inline(always)]
pub(super) fn ask_nearest(from: *const f64, len: usize) {
    ask::<NEAREST>(from, len);
}

/// Prefetch hints: the first-level cache, and the second-level cache.
const NEAREST: i32 = 3;

const NEAR: i32 = 2;

#[inline(always)]
fn ask<const HINT: i32>(from: *const f64, len: usize) {
    #[cfg(target_arch = "x86_64")]
    for at in (0..len).step_by(LANES) {
        // SAFETY: a hint, which reads and writes nothing.
        unsafe { std::arch::x86_64::_mm_prefetch::<HINT>(from.wrapping_add(at).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (from, len);
}
