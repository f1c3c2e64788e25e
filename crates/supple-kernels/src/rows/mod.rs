//! Small dense kernels on padded rows, generic over the lanes. Shapes are run-time numbers; widths are padded strides.
//!
//! Every matrix is row-major with a stride that is a multiple of [`LANES`], and zero padding; kernels read and write whole
//! rows, so padding stays zero.
//!
//! Each kernel has two type parameters: the lanes, and the row length. For [`Short`] rows kernels are inlined into callers;
//! for [`Long`] ones they are functions that are compiled once for each set of lanes, at the cost of a call. For [`Medium`]
//! rows, where a call is a large part of a product, products are inlined, and factors and solves are called.

mod blocks;
mod cholesky;
mod fetch;
mod product;
mod scaled;
mod solve;
mod vector;

use crate::{LANES, padded};

pub use blocks::{mirror, mirror_single, mirror_upper, symmetrise, transpose};
pub(crate) use cholesky::factor_upper;
pub use cholesky::{cholesky, factor, log_determinant};
pub use fetch::{fetch, fetch_lower};
pub use product::{Left, Lower, Product};
pub use scaled::Scaled;
pub use solve::{Factored, solve_column, solve_lower, solve_lower_beside, solve_upper, solve_upper_beside};
pub use vector::{add_scaled, clear_beyond, combine, dot, scale};

/// How long the rows of a computation are.
///
/// Example: [`Product`].
pub trait Rows: Copy + std::fmt::Debug + 'static {
    /// Whether every row is one set of lanes.
    const SHORT: bool;
    /// Whether products are separate functions rather than inlined.
    const CALLED: bool;

    /// The stride of rows of `len` numbers.
    fn stride(len: usize) -> usize;
}

/// Every row is one set of lanes, even if not full: strides are known to the compiler.
///
/// Example: [`Product`].
#[derive(Clone, Copy, Debug)]
pub struct Short;

/// Rows of a few sets of lanes.
///
/// Example: [`Product`].
#[derive(Clone, Copy, Debug)]
pub struct Medium;

/// Rows of any length.
///
/// Example: [`Product`].
#[derive(Clone, Copy, Debug)]
pub struct Long;

impl Rows for Short {
    const SHORT: bool = true;
    const CALLED: bool = false;

    #[inline(always)]
    fn stride(_: usize) -> usize {
        LANES
    }
}

impl Rows for Medium {
    const SHORT: bool = false;
    const CALLED: bool = false;

    #[inline(always)]
    fn stride(len: usize) -> usize {
        padded(len)
    }
}

impl Rows for Long {
    const SHORT: bool = false;
    const CALLED: bool = true;

    #[inline(always)]
    fn stride(len: usize) -> usize {
        padded(len)
    }
}

/// Rows of numbers, `stride` apart.
///
/// Example: [`Product`].
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
    #[must_use]
    pub fn new(numbers: &'a [f64], stride: usize) -> Self {
        Self { numbers, stride }
    }
}

/// Rows of numbers to write, `stride` apart.
///
/// Example: [`Product`].
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

/// Whether `numbers` holds this many rows of this width.
#[inline(always)]
fn holds(numbers: &[f64], stride: usize, (rows, width): (usize, usize)) -> bool {
    rows == 0 || numbers.len() >= (rows - 1) * stride + width
}

/// Largest order up to which medium matrices are factored and solved inline.
const FEW: usize = 4;

#[cfg(test)]
mod tests;
