use supple_kernels::padded;

use crate::knots::Dimensions;

/// The sizes that sweeps work with, and their padded strides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    /// Length of the state.
    pub n: usize,
    /// Length of the control.
    pub m: usize,
    /// Length of the measurement.
    pub p: usize,
}

impl Shape {
    #[inline(always)]
    pub fn of(dimensions: Dimensions) -> Self {
        Self { n: dimensions.states, m: dimensions.controls, p: dimensions.measurements }
    }

    /// Length of `z = (x, u)`.
    #[inline(always)]
    pub fn joint(self) -> usize {
        self.n + self.m
    }

    /// Stride of rows of length n.
    #[inline(always)]
    pub fn narrow(self) -> usize {
        padded(self.n)
    }

    /// Stride of rows of length n + m.
    #[inline(always)]
    pub fn wide(self) -> usize {
        padded(self.n + self.m)
    }

    /// Stride of rows of length n + m + 1.
    #[inline(always)]
    pub fn full(self) -> usize {
        padded(self.n + self.m + 1)
    }

    /// Stride of rows of length p.
    #[inline(always)]
    pub fn small(self) -> usize {
        padded(self.p)
    }
}
