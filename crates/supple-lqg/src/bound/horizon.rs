//! Linear systems with a cost of state uncertainty: over a horizon, and time-invariant.

use supple_kernels::Matrices;

use crate::Error;
use crate::given::{Given, INITIAL, PROCESS, root_of};

/// A linear system over T decisions with a cost of state uncertainty at each; sensors and controllers are left open.
///
/// Whatever is measured, the optimal controller acts on the estimate, so the expected cost is
/// `base_cost + sum_t Tr(Theta_t P_t)`, where `P_t` is the covariance of `x_t` when `u_t` is chosen (theory, equation L.1).
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug)]
pub struct Horizon {
    /// `A_t`, n x n, T of them or one that holds at every step.
    pub dynamics: Matrices,
    /// `W_t`, n x n, T of them or one that holds at every step; may be singular.
    pub process: Matrices,
    /// `X_0`, n x n; may be singular.
    pub initial: Matrices,
    /// `Theta_t`, n x n, positive semidefinite, T of them: half the value of information `Xi_t`, cost per covariance.
    pub prices: Matrices,
    /// The least possible expected cost: with the state known exactly.
    pub base_cost: f64,
}

/// The time-invariant problem, per step: `x+ = A x + B u + w`, with the cost `1/2 z' L z` of
/// `z = (x, u)`.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug)]
pub struct Stationary {
    /// `A`, n x n.
    pub dynamics: Matrices,
    /// `W`, n x n; may be singular.
    pub process: Matrices,
    /// `Theta`, n x n: half of `K' Q_uu K` of the optimal regulator.
    pub price: Matrices,
    /// `1/2 Tr(W S)`: the expected cost per step with the state known exactly.
    pub base_cost: f64,
    /// States known to never cost anything, by columns, n x k: they need no information even if they grow.
    pub unpriced: Matrices,
    /// `R`, r x n, if the numbers are, up to rounding, those of a system in which only `R x` costs anything; no
    /// rows if no state is left out because of rounding. The bounds then hold for that system.
    pub costly: Matrices,
}

impl Horizon {
    /// The number of decisions.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.prices.count()
    }

    /// Whether the arrays fit each other and are finite.
    ///
    /// # Errors
    /// Which array does not.
    pub fn check(&self) -> Result<(), Error> {
        let (n, steps) = (self.prices.rows(), self.prices.count());
        let arrays = [
            ("the prices", &self.prices, steps.max(1)),
            ("the dynamics", &self.dynamics, steps.saturating_sub(1)),
            (PROCESS, &self.process, steps.saturating_sub(1)),
            (INITIAL, &self.initial, 1),
        ];
        for (what, array, count) in arrays {
            Given { what, array, shape: (n, n), count }.check_finite()?;
        }
        if !self.base_cost.is_finite() {
            return Err(Error::NotFinite { what: "the least expected cost", step: 0 });
        }
        Ok(())
    }
}

impl Horizon {
    /// Whether covariances and prices are positive semidefinite.
    pub(super) fn check_covariances(&self) -> Result<(), Error> {
        let arrays = [
            (INITIAL, &self.initial, 1),
            (PROCESS, &self.process, self.steps().saturating_sub(1)),
            ("the cost of state uncertainty", &self.prices, self.steps()),
        ];
        for (what, array, count) in arrays {
            for t in 0..count.min(array.count()) {
                root_of(what, array, t)?;
            }
        }
        Ok(())
    }
}

impl Stationary {
    /// Whether the arrays fit each other and are finite.
    ///
    /// # Errors
    /// Which array does not.
    pub fn check(&self) -> Result<(), Error> {
        let once = |m: &Matrices| {
            let mut out = Matrices::constant(m.rows(), m.cols());
            if m.count() > 0 {
                out.as_mut_slice().copy_from_slice(m.at(0));
            }
            out
        };
        let horizon = Horizon {
            dynamics: once(&self.dynamics),
            process: once(&self.process),
            initial: once(&self.process),
            prices: once(&self.price),
            base_cost: self.base_cost,
        };
        let (n, found) = (self.price.rows(), self.unpriced.rows());
        if found != n {
            return Err(Error::Shape { what: "a column of the states without a cost".into(), found, expected: n });
        }
        horizon.check()?;
        check_growth(&self.dynamics)
    }
}

/// The largest entry of dynamics whose powers stay within double precision while a covariance settles.
const MOST_GROWTH: f64 = 1e60;

/// Whether covariances under constant dynamics stay within double precision.
pub(super) fn check_growth(dynamics: &Matrices) -> Result<(), Error> {
    match dynamics.at(0).iter().find(|entry| entry.abs() > MOST_GROWTH) {
        Some(entry) => Err(Error::NoBound {
            what: format!("the dynamics have the entry {entry:?}, beyond {MOST_GROWTH:?}"),
            advice: "shorten the time step, or scale the states to similar sizes",
        }),
        None => Ok(()),
    }
}
