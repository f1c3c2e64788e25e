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
    /// What all of some matrices `[A B]` have in common; none where some row does not follow another.
    pub fn of(dynamics: &Matrices) -> Option<Self> {
        let (n, stride) = (dynamics.rows(), dynamics.stride());
        if n < SMALL || !n.is_multiple_of(2) || dynamics.count() == 0 {
            return None;
        }
        let rows = n / 2;
        let row = |t: usize, i: usize| &dynamics.at(t)[i * stride..i * stride + dynamics.cols()];
        // The ratio of the largest entry that no identity is added to.
        let columns = (1..dynamics.cols()).filter(|&j| row(0, rows)[j] != 0.0);
        let largest = columns.max_by(|&a, &b| row(0, rows)[a].abs().total_cmp(&row(0, rows)[b].abs()))?;
        let dt = row(0, 0)[largest] / row(0, rows)[largest];
        let follows = |t: usize, i: usize| {
            row(t, i).iter().zip(row(t, rows + i)).enumerate().all(|(j, (carried, rate))| {
                let (own, moved) = (if i == j { 1.0 } else { 0.0 }, dt * rate);
                (carried - own - moved).abs() <= 8.0 * f64::EPSILON * (own + moved.abs())
            })
        };
        let all = dt.is_finite() && (0..dynamics.count()).all(|t| (0..rows).all(|i| follows(t, i)));
        all.then_some(Self { rows, dt })
    }
}
