//! The structure that integrators give to the dynamics: positions follow rates.

use supple_kernels::Matrices;

/// Rows of `F` that say how positions follow rates: the first h rows are `e_i + dt F_{h + i}`, as those of every integrator
/// are that moves positions by the new rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Carried {
    /// h.
    pub rows: usize,
    pub dt: f64,
}

/// Below so many states products are too small for their structure to pay.
const SMALL: usize = 24;

impl Carried {
    /// What the first of some matrices `[A B]` suggests of all; none where nothing does, or where it would not pay.
    pub fn suggested(dynamics: &Matrices) -> Option<Self> {
        let n = dynamics.rows();
        if n < SMALL || !n.is_multiple_of(2) || dynamics.count() == 0 {
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

    /// Whether one matrix is of this structure, but for rounding.
    #[inline(always)]
    pub fn holds(&self, f: &[f64], stride: usize) -> bool {
        let Self { rows, dt } = *self;
        let (positions, rates) = f.split_at(rows * stride);
        let follows = |own: f64, carried: f64, rate: f64| {
            let moved = dt * rate;
            (carried - own - moved).abs() <= 8.0 * f64::EPSILON * (own + moved.abs())
        };
        // Without a branch in it, so that it runs in lanes.
        let all = |carried: &[f64], rates: &[f64]| {
            carried.iter().zip(rates).fold(true, |all, (&carried, &rate)| all & follows(0.0, carried, rate))
        };
        let mut holds = true;
        for (i, (carried, rates)) in positions.chunks_exact(stride).zip(rates.chunks_exact(stride)).enumerate() {
            let own = follows(1.0, carried[i], rates[i]);
            holds &= own & all(&carried[..i], &rates[..i]) & all(&carried[i + 1..], &rates[i + 1..]);
        }
        holds
    }
}
