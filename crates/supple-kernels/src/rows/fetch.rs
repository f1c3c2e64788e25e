//! Hints to the processor about numbers that are used soon.

use crate::LANES;

/// Asks for numbers that are used soon, so that they are near when they are.
#[inline(always)]
pub fn fetch(numbers: &[f64]) {
    ask::<NEAR>(numbers.as_ptr(), numbers.len());
}

/// As [`fetch`], of the lower triangle of a matrix with this stride.
#[inline(always)]
pub fn fetch_lower(a: &[f64], stride: usize) {
    for (i, row) in a.chunks(stride).enumerate() {
        fetch(&row[..row.len().min(i + 1)]);
    }
}

/// Asks for numbers, so that they are in the nearest memory once a loop has run.
#[inline(always)]
pub(super) fn ask_nearest(from: *const f64, len: usize) {
    ask::<NEAREST>(from, len);
}

/// Hints of processors: the first of their own memories, and the second.
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
