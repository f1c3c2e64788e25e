use nalgebra::Cholesky;
use supple_kernels::{Matrices, rows};

use crate::dense::{Dense, dense, store, symmetric};
use crate::knots::Dimensions;
use crate::knots::KnotAdjoints;
use crate::knots::Knots;
use crate::noise::Noise;
use crate::riccati::Policy;

/// Derivatives of a scalar with respect to quantities computed along a plan, each with all others held fixed: input of the
/// reverse sweeps (theory, equation G.9). Derivatives with respect to symmetric matrices are symmetric.
///
/// Example: [`add_control_partials`](crate::add_control_partials).
#[derive(Clone, Debug, PartialEq)]
pub struct Partials {
    /// With respect to `A_t`, n x n, N of them.
    pub dynamics: Matrices,
    /// With respect to `C_t`, p x n, N + 1 of them.
    pub measurement: Matrices,
    /// With respect to `W_t`, n x n, N of them.
    pub process: Matrices,
    /// With respect to `V_t`, p x p, N + 1 of them.
    pub measurement_noise: Matrices,
    /// With respect to `X_0`, n x n.
    pub initial: Matrices,
    /// With respect to the predicted covariances `P_t`, n x n, N + 1 of them.
    pub predicted: Matrices,
    /// With respect to the corrected covariances `Sigma_t`, n x n, N + 1 of them.
    pub corrected: Matrices,
    /// With respect to the feedback `K_t`, m x n, N of them.
    pub feedback: Matrices,
    /// With respect to the value of information `Xi_t`, n x n, N of them.
    pub value_of_information: Matrices,
}

impl Partials {
    /// By how much the number would change, to first order, if all covariances grew by the share 1: information does not
    /// change with that, so what is found is the error that rounding left in its derivatives. The covariances are those of a
    /// belief, `P_t` and `Sigma_t`.
    #[must_use]
    pub fn along_covariances(&self, predicted: &Matrices, corrected: &Matrices, noise: &Noise) -> f64 {
        let pairs = [
            (&self.process, &noise.process),
            (&self.measurement_noise, &noise.measurement),
            (&self.initial, &noise.initial),
            (&self.predicted, predicted),
            (&self.corrected, corrected),
        ];
        let of_pair = |(slopes, covariances): (&Matrices, &Matrices)| {
            (0..slopes.count()).map(|t| rows::dot(slopes.at(t), covariances.at(t))).sum::<f64>()
        };
        pairs.into_iter().map(of_pair).sum()
    }

    /// Zeros for `steps` steps.
    #[must_use]
    pub fn zeros(dimensions: Dimensions, steps: usize) -> Self {
        let Dimensions { states: n, controls: m, measurements: p, .. } = dimensions;
        let square = |count| Matrices::zeros(count, n, n);
        Self {
            dynamics: square(steps),
            measurement: Matrices::zeros(steps + 1, p, n),
            process: square(steps),
            measurement_noise: Matrices::zeros(steps + 1, p, p),
            initial: square(1),
            predicted: square(steps + 1),
            corrected: square(steps + 1),
            feedback: Matrices::zeros(steps, m, n),
            value_of_information: square(steps),
        }
    }

    /// Adds the derivatives with respect to knots and noise to their adjoints; measurements that pick states have none.
    pub fn add_to(&self, knots: &Knots, adjoints: &mut KnotAdjoints, noise: &mut Noise) {
        for t in 0..self.dynamics.count() {
            add_entries(&mut adjoints.dynamics, &self.dynamics, t);
            add_entries(&mut noise.process, &self.process, t);
        }
        for t in 0..self.measurement.count() {
            if knots.picks.is_none() {
                add_entries(&mut adjoints.measurement, &self.measurement, t);
            }
            add_entries(&mut noise.measurement, &self.measurement_noise, t);
        }
        add_entries(&mut noise.initial, &self.initial, 0);
    }

    /// Converts derivatives with respect to the feedback at step `t`, the minimiser of `Q`, to those with respect to `Q`,
    /// (n + m) x (n + m): with `Y = Q_uu^-1 Kb` over the controls that are free,
    ///
    /// ```text
    /// Qb_ux = -Y / 2      Qb_uu = -(Y K' + K Y') / 2
    /// ```
    #[must_use]
    pub fn through_feedback(&self, knots: &Knots, policy: &Policy, t: usize) -> Option<Dense> {
        let by_feedback = dense(&self.feedback, t);
        if by_feedback.iter().all(|&entry| entry == 0.0) {
            return None;
        }
        let (m, n) = by_feedback.shape();
        let f = dense(&knots.dynamics, t);
        let b = f.columns(n, m);
        let q_uu = dense(&knots.cost, t).view((n, n), (m, m)) + b.transpose() * dense(&policy.curvature, t + 1) * b;
        let free: Vec<usize> = (0..m).filter(|a| !policy.clamped[t * m + a]).collect();
        let factor = Cholesky::new(symmetric(q_uu.select_rows(&free).select_columns(&free)))?;
        let solved = factor.solve(&by_feedback.select_rows(&free));
        let mut y = Dense::zeros(m, n);
        for (row, &a) in free.iter().enumerate() {
            y.set_row(a, &solved.row(row));
        }
        let mut out = Dense::zeros(n + m, n + m);
        out.view_mut((n, 0), (m, n)).copy_from(&(&y * -0.5));
        out.view_mut((0, n), (n, m)).copy_from(&(y.transpose() * -0.5));
        out.view_mut((n, n), (m, m)).copy_from(&-symmetric(y * dense(&policy.feedback, t).transpose()));
        Some(out)
    }
}

/// `to_t += from_t` in the columns that `from` has; a matrix that does not change over time receives the sum.
fn add_entries(to: &mut Matrices, from: &Matrices, t: usize) {
    for (i, j) in (0..from.rows()).flat_map(|i| (0..from.cols()).map(move |j| (i, j))) {
        let sum = to.get(t, i, j) + from.get(t, i, j);
        to.set(t, i, j, sum);
    }
}

/// `to_t += from`
pub fn add_dense(to: &mut Matrices, t: usize, from: &Dense) {
    let sum = dense(to, t) + from;
    store(to, t, &sum);
}
