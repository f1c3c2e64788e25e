use supple_kernels::{Job, LANES, Lanes, padded};

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
    /// The stride of all rows, where it is known to the compiler.
    row: Option<usize>,
}

/// Calls `$run` with a [`Shape`] of given sizes: with strides known to the compiler where every row is as short as rows
/// can be, which unrolls the loops over rows of small systems, and with run-time strides otherwise. The code is the
/// same.
macro_rules! with_shape {
    ($shape:expr, |$name:ident| $run:expr) => {{
        let shape: $crate::shape::Shape = $shape;
        if shape.is_small() {
            let $name = shape.small_rows();
            $run
        } else {
            let $name = shape;
            $run
        }
    }};
}
pub(crate) use with_shape;

impl Shape {
    #[inline(always)]
    pub fn of(dimensions: Dimensions) -> Self {
        Self::new(dimensions.states, dimensions.controls, dimensions.measurements)
    }

    #[inline(always)]
    pub fn new(n: usize, m: usize, p: usize) -> Self {
        Self { n, m, p, row: None }
    }

    /// Whether no row is longer than the shortest stride.
    pub fn is_small(self) -> bool {
        self.n + self.m < LANES && self.p <= LANES
    }

    /// The same of a small system, its strides known.
    #[inline(always)]
    pub fn small_rows(self) -> Self {
        Self { row: Some(LANES), ..self }
    }

    /// Runs part of a sweep: inlined for small systems, otherwise in a separate function, for which a call
    /// is nothing. Sweeps that hold all their parts take compilers minutes.
    #[inline(always)]
    pub fn part<L: Lanes, J: Job>(self, job: J) -> J::Output {
        if self.row.is_some() { job.run::<L>() } else { L::apart(job) }
    }

    #[inline(always)]
    fn stride(self, len: usize) -> usize {
        self.row.unwrap_or_else(|| padded(len))
    }

    /// Length of `z = (x, u)`.
    #[inline(always)]
    pub fn joint(self) -> usize {
        self.n + self.m
    }

    /// Stride of rows of length n.
    #[inline(always)]
    pub fn narrow(self) -> usize {
        self.stride(self.n)
    }

    /// Stride of rows of length n + m.
    #[inline(always)]
    pub fn wide(self) -> usize {
        self.stride(self.n + self.m)
    }

    /// Stride of rows of length n + m + 1.
    #[inline(always)]
    pub fn full(self) -> usize {
        self.stride(self.n + self.m + 1)
    }

    /// Stride of rows of length m.
    #[inline(always)]
    pub fn of_controls(self) -> usize {
        self.stride(self.m)
    }

    /// Stride of rows of length p.
    #[inline(always)]
    pub fn small(self) -> usize {
        self.stride(self.p)
    }
}
