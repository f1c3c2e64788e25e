//! The structure that integrators give to the dynamics: positions follow rates.

use supple_kernels::{LANES, Lanes, Matrices};

/// Rows of `F` that say how positions follow rates: the first h rows are `e_i + dt F_{h + i}`, as those of every integrator
/// are that moves positions by the new rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Carried {
    /// h.
    pub rows: usize,
    pub dt: f64,
}

impl Carried {
    /// What the first of some matrices `[A B]` suggests of all; `None` if nothing does, or where it does not pay: with
    /// fewer than `least` states.
    pub fn suggested(dynamics: &Matrices, least: usize) -> Option<Self> {
        let n = dynamics.rows();
        if n < least.max(1) || !n.is_multiple_of(2) || dynamics.count() == 0 {
            return None;
        }
        let rows = n / 2;
        let row = |i: usize| &dynamics.at(0)[i * dynamics.stride()..][..dynamics.cols()];
        // The ratio of the largest entry that no identity is added to.
        let columns = (1..dynamics.cols()).filter(|&j| row(rows)[j] != 0.0);
        let largest = columns.max_by(|&a, &b| row(rows)[a].abs().total_cmp(&row(rows)[b].abs()))?;
        let dt = row(0)[largest] / row(rows)[largest];
        dt.is_finite().then_some(Self { rows, dt })
    }

    /// The structure that is suggested of all steps, where the matrix of one has it.
    #[inline(always)]
    pub fn at_step<L: Lanes>(suggested: Option<Self>, f: &[f64], stride: usize) -> Option<Self> {
        // Not by a closure, which would not run in lanes.
        match suggested {
            Some(carried) if carried.holds::<L>(f, stride) => Some(carried),
            _ => None,
        }
    }

    /// Whether one matrix, with zero padding, is of this structure, but for rounding: on the diagonal, where 1 is added, and
    /// nowhere else, positions differ from what rates make of them.
    #[inline(always)]
    fn holds<L: Lanes>(&self, f: &[f64], stride: usize) -> bool {
        const ROUNDING: f64 = 8.0 * f64::EPSILON;
        let Self { rows, dt } = *self;
        let (step, rounding, zero, one) = (L::constant(dt), L::constant(ROUNDING * dt), L::zero(), L::one());
        let (positions, rates) = f.split_at(rows * stride);
        let mut others = zero;
        for i in 0..rows {
            let (carried, rates) = (&positions[i * stride..(i + 1) * stride], &rates[i * stride..(i + 1) * stride]);
            let moved = dt * rates[i];
            if (carried[i] - 1.0 - moved).abs() > ROUNDING * (1.0 + moved.abs()) {
                return false;
            }
            for (carried, rates) in carried.as_chunks::<LANES>().0.iter().zip(rates.as_chunks::<LANES>().0) {
                let (carried, rates) = (L::from_array(*carried), L::from_array(*rates));
                let (off, within) = (step.neg_mul_add(rates, carried), rates * rounding);
                others += within.neg_mul_add(within, off * off).select(one, zero);
            }
        }
        others.to_array().iter().sum::<f64>() == rows as f64
    }
}
