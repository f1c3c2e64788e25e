//! The structure that integrators give to the dynamics: positions follow rates.

use supple_kernels::{LANES, Lanes, Matrices};

/// The rows of `F` in which positions follow rates: the first h rows are `e_i + dt F_{h + i}`, as in every integrator that
/// updates positions with the new rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Carried {
    /// h.
    pub rows: usize,
    pub dt: f64,
}

impl Carried {
    /// The structure that the first matrix `[A B]` suggests for all; `None` if there is none or it does not pay off, with
    /// fewer than `least` states.
    pub fn suggested(dynamics: &Matrices, least: usize) -> Option<Self> {
        let n = dynamics.rows();
        if n < least.max(1) || !n.is_multiple_of(2) || dynamics.count() == 0 {
            return None;
        }
        let rows = n / 2;
        let row = |i: usize| &dynamics.at(0)[i * dynamics.stride()..][..dynamics.cols()];
        // The ratio at the largest entry outside the identity part.
        let columns = (1..dynamics.cols()).filter(|&j| row(rows)[j] != 0.0);
        let largest = columns.max_by(|&a, &b| row(rows)[a].abs().total_cmp(&row(rows)[b].abs()))?;
        let dt = row(0)[largest] / row(rows)[largest];
        dt.is_finite().then_some(Self { rows, dt })
    }

    /// The structure suggested for all steps, if the matrix of this step has it.
    #[inline(always)]
    pub fn at_step<L: Lanes>(suggested: Option<Self>, f: &[f64], stride: usize) -> Option<Self> {
        // Not with a closure, which would not inherit the instructions of the lanes.
        match suggested {
            Some(carried) if carried.holds::<L>(f, stride) => Some(carried),
            _ => None,
        }
    }

    /// Whether a zero-padded matrix has this structure up to rounding: position rows equal `dt` times the rate rows, plus
    /// 1 on the diagonal and nothing elsewhere.
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
