//! Small dense kernels on padded rows, generic over the lanes. Shapes are run-time numbers; widths are padded strides.
//!
//! Every matrix is row-major with a stride that is a multiple of [`LANES`], and zero padding; kernels read and write whole
//! rows, so padding stays zero.
//!
//! Each kernel takes two types: the lanes, and how long rows are. Of [`Short`] rows kernels are copied into their callers;
//! of [`Long`] ones they are functions of their own, compiled once for each set of lanes, beside which a call is nothing.

mod blocks;
mod cholesky;
mod product;
mod scaled;
mod solve;
mod vector;

use crate::{LANES, padded};

pub use blocks::{mirror, mirror_upper, symmetrise, transpose};
pub(crate) use cholesky::factor_upper;
pub use cholesky::{cholesky, factor, log_determinant};
pub use product::{Left, Lower, Product};
pub use scaled::Scaled;
pub use solve::{Factored, solve_column, solve_lower, solve_lower_beside, solve_upper, solve_upper_beside};
pub use vector::{add_scaled, clear_beyond, combine, dot, fetch, fetch_lower, scale};

/// How long the rows of a computation are.
pub trait Rows: Copy + std::fmt::Debug + 'static {
    /// Whether every row is one set of lanes.
    const SHORT: bool;

    /// The stride of rows of `len` numbers.
    fn stride(len: usize) -> usize;
}

/// Every row is one set of lanes, whether it is used up or not: strides are known to the compiler.
#[derive(Clone, Copy, Debug)]
pub struct Short;

/// Rows of any length.
#[derive(Clone, Copy, Debug)]
pub struct Long;

impl Rows for Short {
    const SHORT: bool = true;

    #[inline(always)]
    fn stride(_: usize) -> usize {
        LANES
    }
}

impl Rows for Long {
    const SHORT: bool = false;

    #[inline(always)]
    fn stride(len: usize) -> usize {
        padded(len)
    }
}

/// Rows of numbers, `stride` apart.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// All rows.
    pub numbers: &'a [f64],
    /// From one row to the next.
    pub stride: usize,
}

impl<'a> View<'a> {
    /// Rows that are `stride` apart.
    #[inline(always)]
    pub fn new(numbers: &'a [f64], stride: usize) -> Self {
        Self { numbers, stride }
    }
}

/// Rows of numbers to write, `stride` apart.
#[derive(Debug)]
pub struct ViewMut<'a> {
    /// All rows.
    pub numbers: &'a mut [f64],
    /// From one row to the next.
    pub stride: usize,
}

impl<'a> ViewMut<'a> {
    /// Rows that are `stride` apart.
    #[inline(always)]
    pub fn new(numbers: &'a mut [f64], stride: usize) -> Self {
        Self { numbers, stride }
    }
}

#[cfg(test)]
mod tests;
