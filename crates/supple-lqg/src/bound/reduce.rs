//! A horizon in coordinates of the uncertain directions at each step, scaled by covariances of the problem itself.

use super::horizon::Horizon;
use crate::Error;
use crate::dense::{Dense, Svd, cholesky, dense, solve_lower, svd, symmetric};
use crate::given::{INITIAL, PROCESS, root_of};

/// Standard deviations below this share of the largest, in units of each state's own, count as none.
const RANK_TOLERANCE: f64 = 1e-10;

/// One decision in reduced coordinates: `p` is `n_t x n_t` (theory, equation L.4).
#[derive(Clone, Debug)]
pub(super) struct Stage {
    /// To the next step, `n_{t+1} x n_t`; no rows at the last.
    pub dynamics: Dense,
    /// Of the next step, `n_{t+1} x n_{t+1}`.
    pub process: Dense,
    /// `theta / budget`, `n_t x n_t`.
    pub price: Dense,
    /// `E_t`, `n x n_t`, of full rank: `P_t = E_t p_t E_t'`.
    pub basis: Dense,
    /// `n_t x n`: these coordinates of a state, `reader basis = I`.
    pub reader: Dense,
    /// States unobservable through the price that were left out, `n x k`: `reader unseen = 0`.
    pub unseen: Dense,
}

/// A chain of decisions, or a single one that is its own successor.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    /// The decisions.
    pub stages: Vec<Stage>,
    /// Whether the only decision is its own successor: the stationary problem.
    pub wraps: bool,
}

impl Stage {
    /// A stage that leaves out only what is known.
    fn seen(dynamics: Dense, process: Dense, price: Dense, basis: Dense) -> Self {
        let (reader, unseen) = (left_inverse(&basis), Dense::zeros(basis.nrows(), 0));
        Self { dynamics, process, price, basis, reader, unseen }
    }
}

/// The left inverse of these columns that, with every row scaled to length 1, vanishes on their orthogonal complement.
fn left_inverse(columns: &Dense) -> Dense {
    let norms: Vec<f64> = columns.row_iter().map(|row| row.norm()).collect();
    let by = |i: usize| if norms[i] > 0.0 { 1.0 / norms[i] } else { 0.0 };
    let Svd { u, values, v } = svd(&Dense::from_fn(columns.nrows(), columns.ncols(), |i, k| columns[(i, k)] * by(i)));
    let scaled = Dense::from_fn(columns.ncols(), values.len(), |i, k| v[(i, k)] / values[k]);
    let mut out = scaled * u.transpose();
    for (i, mut column) in out.column_iter_mut().enumerate() {
        column *= by(i);
    }
    out
}

impl Chain {
    /// Which decision follows.
    pub fn next(&self, t: usize) -> Option<usize> {
        if self.wraps { Some(0) } else { (t + 1 < self.stages.len()).then_some(t + 1) }
    }

    /// The order of `p_t`.
    pub fn order(&self, t: usize) -> usize {
        self.stages[t].price.nrows()
    }

    /// The horizon in reduced coordinates; `budget` is what the covariances may cost.
    pub fn of_horizon(horizon: &Horizon, budget: f64) -> Result<Self, Error> {
        let steps = horizon.prices.count();
        let mut basis = root_of(INITIAL, &horizon.initial, 0)?;
        let mut stages = Vec::with_capacity(steps);
        let mut process_root = root_of(PROCESS, &horizon.process, 0)?;
        for t in 0..steps {
            let price = dense(&horizon.prices, t);
            let price = symmetric(basis.transpose() * (price / budget) * &basis);
            let unscaled = || Error::NoBound {
                what: format!("the uncertainty at step {t} overflows"),
                advice: "shorten the horizon, or leave out states that grow and cost nothing",
            };
            if t + 1 == steps {
                let none = Dense::zeros(0, basis.ncols());
                stages.push(Stage::seen(none, Dense::zeros(0, 0), price, basis));
                break;
            }
            if t > 0 && !horizon.process.is_constant() {
                process_root = root_of(PROCESS, &horizon.process, t)?;
            }
            let measured = measured_root(&basis, &price, steps).ok_or_else(unscaled)?;
            let (next, dynamics, process) = reach(&dense(&horizon.dynamics, t), &basis, &process_root, &measured);
            if !next.iter().all(|entry| entry.is_finite()) {
                return Err(unscaled());
            }
            let basis = std::mem::replace(&mut basis, next);
            stages.push(Stage::seen(dynamics, process, price, basis));
        }
        Ok(Self { stages, wraps: false })
    }
}

/// The lower factor `l` of `I + E' J E`: how much the reference covariance `E E'`, which scales coordinates, shrinks
/// when it is measured with the precision `J`; then `E l'^-1` is a square root of the result (theory, below equation L.4).
///
/// `J` measures what costs, precisely enough for about its share of the budget at every decision: what noise drives and
/// what grows keep the size that they have near the requested cost, each at its own rate.
pub(super) fn measured_root(basis: &Dense, price: &Dense, steps: usize) -> Option<Dense> {
    let (n, order) = (basis.nrows(), basis.ncols());
    let share = (steps * n) as f64;
    cholesky(&symmetric(Dense::identity(order, order) + price * share))
}

/// The range of `[A E, W^(1/2)]`: a basis scaled by the covariance `A E (l l')^-1 E' A' + W`, and `A` and `W` in that basis.
pub(super) fn reach(a: &Dense, basis: &Dense, process_root: &Dense, measured: &Dense) -> (Dense, Dense, Dense) {
    let (n, carried, driven) = (a.nrows(), basis.ncols(), process_root.ncols());
    let mut sources = Dense::zeros(n, carried + driven);
    // A E l'^-1, from the left: (l^-1 (A E)')'.
    sources.columns_mut(0, carried).copy_from(&solve_lower(measured, (a * basis).transpose()).transpose());
    sources.columns_mut(carried, driven).copy_from(process_root);
    let norms: Vec<f64> = sources.row_iter().map(|row| row.norm()).collect();
    for (mut row, &norm) in sources.row_iter_mut().zip(&norms) {
        if norm > 0.0 {
            row /= norm;
        }
    }
    let Svd { u, values, v } = svd(&sources);
    let largest = values.first().copied().unwrap_or(0.0);
    let kept: Vec<usize> = (0..values.len()).filter(|&k| values[k] > RANK_TOLERANCE * largest).collect();
    let next = Dense::from_fn(n, kept.len(), |i, k| norms[i] * u[(i, kept[k])] * values[kept[k]]);
    let rows = v.select_columns(&kept).transpose();
    let dynamics = rows.columns(0, carried) * measured.transpose();
    let noise = rows.columns(carried, driven).into_owned();
    (next, dynamics, symmetric(&noise * noise.transpose()))
}
