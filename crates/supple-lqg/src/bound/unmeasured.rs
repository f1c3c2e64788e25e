//! The expected cost without measurements.

use supple_kernels::Matrices;

use super::horizon::Horizon;
use crate::dense::{congruence, dense, store};

/// The expected cost of the optimal controller if nothing is ever measured, and its derivatives: with
/// `S_0 = X_0` and `S_{t+1} = A_t S_t A_t' + W_t` (theory, equation L.33)
///
/// ```text
/// J = base_cost + sum_t Tr(Theta_t S_t)
/// ```
///
/// No information is needed at any expected cost of at least this.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug)]
pub struct Unmeasured {
    /// `J`.
    pub cost: f64,
    /// With respect to `A_t`, n x n: one for each decision; the last is 0.
    pub dynamics: Matrices,
    /// With respect to `W_t`, n x n, the same number; the last is 0.
    pub process: Matrices,
    /// With respect to `X_0`, n x n.
    pub initial: Matrices,
    /// With respect to `Theta_t`, n x n, the same number: `S_t`.
    pub prices: Matrices,
}

impl Horizon {
    /// The expected cost without measurements, and its derivatives.
    ///
    /// # Panics
    /// Where the arrays do not fit each other, see [`Horizon::check`].
    #[must_use]
    pub fn unmeasured(&self) -> Unmeasured {
        let (n, steps) = (self.prices.rows(), self.steps());
        let zeros = || Matrices::zeros(steps, n, n);
        let (mut dynamics, mut process, mut prices) = (zeros(), zeros(), zeros());
        let of = |matrices: &Matrices, t: usize| dense(matrices, if matrices.count() == 1 { 0 } else { t });
        let mut spread = dense(&self.initial, 0);
        let mut cost = self.base_cost;
        for t in 0..steps {
            store(&mut prices, t, &spread);
            cost += dense(&self.prices, t).dot(&spread);
            if t + 1 < steps {
                spread = congruence(&of(&self.dynamics, t), &spread) + of(&self.process, t);
            }
        }
        let mut initial = Matrices::zeros(1, n, n);
        let mut by_spread = dense(&initial, 0);
        for t in (0..steps).rev() {
            if t + 1 < steps {
                let a = of(&self.dynamics, t);
                store(&mut dynamics, t, &(&by_spread * &a * dense(&prices, t) * 2.0));
                store(&mut process, t, &by_spread);
                by_spread = congruence(&a.transpose(), &by_spread);
            }
            by_spread += dense(&self.prices, t);
        }
        store(&mut initial, 0, &by_spread);
        Unmeasured { cost, dynamics, process, initial, prices }
    }
}
