use supple_kernels::{Matrices, rows};

use crate::Error;
use crate::dense::{dense, semidefinite_root};
use crate::knots::Knots;
use crate::noise::Noise;
use crate::plan::{Plan, PlanMode, Policy, Regularisation, solve_riccati};

/// A linear system over T decisions with the price of what is not known at each, all sensors and controllers left open.
///
/// Whatever is measured, the optimal controller acts on the estimate, and the expected cost is
/// `base_cost + sum_t Tr(Theta_t P_t)` with `P_t` the covariance of `x_t` once `u_t` is chosen (theory, equation L.1).
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
    /// The expected cost with the state known exactly: the least there is.
    pub base_cost: f64,
}

impl Horizon {
    /// That of a plan's linearisation. A risk-sensitive plan gives its trajectory only: the prices are those of the law of
    /// least expected cost along it.
    ///
    /// # Errors
    /// Where there is no such law.
    pub fn of_plan(plan: &Plan, noise: &Noise) -> Result<Self, Error> {
        if plan.mode != PlanMode::Risk {
            return Ok(Self::under(&plan.policy, plan, noise));
        }
        let Knots { dimensions, dynamics, cost, .. } = &plan.knots;
        let mut law = Policy::zeros(*dimensions, plan.knots.steps());
        solve_riccati(dynamics, cost, Regularisation::default(), &mut law)
            .map_err(|step| Error::NotPositiveDefinite { what: "the control's curvature", step })?;
        Ok(Self::under(&law, plan, noise))
    }

    /// That of a plan's linearisation, with the prices of a law.
    fn under(policy: &Policy, plan: &Plan, noise: &Noise) -> Self {
        let (n, steps) = (plan.knots.dimensions.states, plan.knots.steps());
        let mut dynamics = Matrices::zeros(steps, n, n);
        let mut prices = Matrices::zeros(steps, n, n);
        for t in 0..steps {
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                dynamics.set(t, i, j, plan.knots.dynamics.get(t, i, j));
                prices.set(t, i, j, 0.5 * policy.value_of_information.get(t, i, j));
            }
        }
        let (s, traced) = (&policy.curvature, |a: &Matrices, b: &Matrices, t, k| rows::dot(a.at(t), b.at(k)));
        let known: f64 = (0..steps).map(|t| traced(s, &noise.process, t + 1, t)).sum();
        let base_cost = plan.nominal_cost + 0.5 * (known + traced(s, &noise.initial, 0, 0));
        Self { dynamics, process: noise.process.clone(), initial: noise.initial.clone(), prices, base_cost }
    }
}

/// The same where nothing changes over time, per step: `x+ = A x + B u + w`, with the cost `1/2 z' L z` of
/// `z = (x, u)`.
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
}

impl Horizon {
    /// How many decisions there are.
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
            ("the process covariance", &self.process, steps.saturating_sub(1)),
            ("the covariance of the first state", &self.initial, 1),
        ];
        for (what, array, count) in arrays {
            for (found, expected) in [(array.rows(), n), (array.cols(), n)] {
                if found != expected {
                    return Err(Error::Shape { what: format!("a row or column of {what}"), found, expected });
                }
            }
            if !array.is_constant() && array.count() < count {
                let what = format!("{what} over {steps} decisions");
                return Err(Error::Shape { what, found: array.count(), expected: count });
            }
            for t in 0..array.count() {
                if !array.at(t).iter().all(|v| v.is_finite()) {
                    return Err(Error::NotFinite { what, step: t });
                }
            }
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
            ("the covariance of the first state", &self.initial, 1),
            ("the process covariance", &self.process, self.steps().saturating_sub(1)),
            ("the price of not knowing the state", &self.prices, self.steps()),
        ];
        for (what, array, count) in arrays {
            for t in 0..count.min(array.count()) {
                semidefinite_root(&dense(array, t)).ok_or(Error::NotPositiveSemidefinite { what, step: t })?;
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
        horizon.check()
    }
}
