use std::marker::PhantomData;

use supple_kernels::rows::Rows;
use supple_kernels::{Job, LANES, Lanes};

use crate::knots::Dimensions;

/// The sizes that sweeps work with, and the strides of rows of these lengths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape<R> {
    /// Length of the state.
    pub n: usize,
    /// Length of the control.
    pub m: usize,
    /// Length of the measurement.
    pub p: usize,
    rows: PhantomData<R>,
}

/// How long the rows of a sweep are.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Length {
    Short,
    Medium,
    Long,
}

/// The length of the longest medium rows.
const MEDIUM: usize = 2 * LANES;

impl Length {
    #[inline(always)]
    pub fn of(Dimensions { states, controls, measurements }: Dimensions) -> Self {
        let longest = (states + controls + 1).max(measurements);
        if longest <= LANES {
            Self::Short
        } else if longest <= MEDIUM {
            Self::Medium
        } else {
            Self::Long
        }
    }
}

/// Calls a generic function with the row type that [`Length::of`] selects for these sizes.
macro_rules! by_length {
    ($dimensions:expr, |$rows:ident| $run:expr) => {
        match $crate::shape::Length::of($dimensions) {
            $crate::shape::Length::Short => {
                type $rows = supple_kernels::rows::Short;
                $run
            }
            $crate::shape::Length::Medium => {
                type $rows = supple_kernels::rows::Medium;
                $run
            }
            $crate::shape::Length::Long => {
                type $rows = supple_kernels::rows::Long;
                $run
            }
        }
    };
}
pub(crate) use by_length;

impl<R: Rows> Shape<R> {
    #[inline(always)]
    pub fn of(Dimensions { states: n, controls: m, measurements: p }: Dimensions) -> Self {
        debug_assert!(!R::SHORT || n + m < LANES && p <= LANES);
        Self { n, m, p, rows: PhantomData }
    }

    /// Runs part of a sweep: inlined for short rows, otherwise as a separate function whose call cost is negligible.
    #[inline(always)]
    pub fn part<L: Lanes, J: Job>(self, job: J) -> J::Output {
        if R::SHORT { job.run::<L>() } else { L::apart(job) }
    }

    /// Length of `z = (x, u)`.
    #[inline(always)]
    pub fn joint(self) -> usize {
        self.n + self.m
    }

    /// Stride of rows of length n.
    #[inline(always)]
    pub fn narrow(self) -> usize {
        R::stride(self.n)
    }

    /// Where `[Q_ux | Q_u]` begin in rows `[Q_uu | Q_ux | Q_u]`, and the stride of these.
    #[inline(always)]
    pub fn gains(self) -> (usize, usize) {
        let first = R::stride(self.m);
        (first, first + R::stride(self.n + 1))
    }

    /// Stride of rows of length n + m.
    #[inline(always)]
    pub fn wide(self) -> usize {
        R::stride(self.n + self.m)
    }

    /// Stride of rows of length n + m + 1.
    #[inline(always)]
    pub fn full(self) -> usize {
        R::stride(self.n + self.m + 1)
    }

    /// Stride of rows of length m.
    #[inline(always)]
    pub fn of_controls(self) -> usize {
        R::stride(self.m)
    }

    /// Stride of rows of length p.
    #[inline(always)]
    pub fn small(self) -> usize {
        R::stride(self.p)
    }
}
