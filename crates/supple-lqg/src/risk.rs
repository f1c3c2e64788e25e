//! Risk-sensitive control: the least exponential of the cost (theory, section P, "Risk-sensitive plans").
//!
//! ```
//! use supple_lqg::risk::{Failure, Given, solve};
//! use supple_lqg::{Belief, Knots, LinearQuadratic, Matrices, Noise, Policy, Regularisation};
//! use supple_lqg::{constant, kalman, solve_riccati};
//!
//! let plant = LinearQuadratic { a: &[[1.0]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
//! let knots = Knots::linear(50, plant)?;
//! let noise = Noise { initial: constant(&[[1.0]]), process: constant(&[[0.1]]), measurement: constant(&[[0.1]]) };
//! let (mut belief, mut expected) = (Belief::zeros(1, 1, 50), Policy::zeros(knots.dimensions, 50));
//! kalman(&knots, &noise, &mut belief)?;
//! solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut expected)?;
//!
//! // With a sensitivity of 0 the controller is that of the expected cost; otherwise it acts more strongly.
//! let (mut policy, mut costates) = (Policy::zeros(knots.dimensions, 50), Matrices::vectors(51, 1));
//! let given = Given { knots: &knots, cost: &knots.cost, belief: &belief, sensitivity: 0.0, shift: 0.0 };
//! assert!(solve(given, &mut policy, &mut costates).is_ok());
//! let gain = policy.feedback.get(10, 0, 0);
//! assert!((gain - expected.feedback.get(10, 0, 0)).abs() < 1e-12);
//! assert!(solve(Given { sensitivity: 0.5, ..given }, &mut policy, &mut costates).is_ok());
//! assert!(policy.feedback.get(10, 0, 0) < gain);
//!
//! // Beyond some sensitivity the exponential of the cost has no finite mean.
//! let far = solve(Given { sensitivity: 1e3, ..given }, &mut policy, &mut costates);
//! assert!(matches!(far, Err(Failure::Breakdown(_))));
//! # Ok::<(), supple_lqg::Error>(())
//! ```

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};
use supple_kernels::{Matrices, math, rows};

use crate::belief::Belief;
use crate::dense::{dense, store};
use crate::knots::Knots;
use crate::riccati::Policy;

/// What the sweep starts from.
///
/// Example: the [module](crate::risk).
#[derive(Clone, Copy)]
pub struct Given<'a> {
    /// The plant along its trajectory.
    pub knots: &'a Knots,
    /// `[l_zz | l_z]`, (n + m) x (n + m + 1), N + 1 of them: those of the knots, or an approximation that is convex.
    pub cost: &'a Matrices,
    /// Its belief.
    pub belief: &'a Belief,
    /// sigma, 1 over the unit of cost.
    pub sensitivity: f64,
    /// Added to the diagonal of `Q_uu` in the gains.
    pub shift: f64,
}

/// Why there is no law.
///
/// Example: the [module](crate::risk).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The exponential of the cost has no finite mean from this step on, whatever the controls.
    Breakdown(usize),
    /// The control's curvature is not positive definite.
    Indefinite(usize),
}

/// What the sweep finds in addition to the law.
///
/// Example: the [module](crate::risk).
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    /// The risk-sensitive cost, less the nominal cost and what the covariance of the belief costs at any controls.
    pub value: f64,
    /// The largest `|Q_u|`: 0 where the trajectory is stationary.
    pub residual: f64,
    /// The largest `|l_u|`, its scale.
    pub scale: f64,
}

impl Found {
    /// The residual relative to 1 plus its scale.
    #[must_use]
    pub fn relative(self) -> f64 {
        self.residual / (1.0 + self.scale)
    }
}

/// The risk-sensitive Riccati sweep (theory, equation P.17), with the covariance of the change of the estimate
/// `G_{t+1} = P_{t+1} - Sigma_{t+1} = Gamma Gamma'` as its noise:
///
/// ```text
/// M = I - sigma Gamma' S+ Gamma > 0           S~ = S+ + sigma S+ Gamma M^-1 Gamma' S+
/// J~_x = J_x+ + sigma S+ Gamma M^-1 Gamma' J_x+
/// Q = l_zz + F' S~ F     Q_z = l_z + F' J~_x    k = -Q_uu^-1 Q_u     K = -Q_uu^-1 Q_ux
/// S = [I K'] Q [I; K]    J_x = Q_x + K' Q_u
/// ```
///
/// Writes `K`, `k` and `J_x` to `policy`, and the costates `J~_x` of the steps 1 to N to `costates`; curvature and value of
/// information are left as they are.
///
/// # Errors
/// Where there is no law.
///
/// Example: the [module](crate::risk).
pub fn solve(given: Given, policy: &mut Policy, costates: &mut Matrices) -> Result<Found, Failure> {
    let Given { knots, cost, belief, sensitivity, shift } = given;
    let (steps, n) = (knots.steps(), knots.dynamics.rows());
    let joint = knots.dynamics.cols();
    let m = joint - n;
    let end = dense(cost, steps);
    let mut s = end.view((0, 0), (n, n)).into_owned();
    let mut slope = DVector::from_fn(n, |i, _| end[(i, joint)]);
    let mut found = Found::default();
    for t in (0..=steps).rev() {
        policy.slope.vector_mut(t).copy_from_slice(slope.as_slice());
        let change = dense(&belief.predicted, t) - dense(&belief.corrected, t);
        let value = inflate(&mut s, &mut slope, &change, sensitivity).ok_or(Failure::Breakdown(t))?;
        found.value += value;
        costates.vector_mut(t).copy_from_slice(slope.as_slice());
        if t == 0 {
            break;
        }
        let (now, f) = (dense(cost, t - 1), dense(&knots.dynamics, t - 1));
        let q = now.columns(0, joint) + f.transpose() * &s * &f;
        let q_z = now.column(joint) + f.transpose() * &slope;
        let (q_ux, mut q_uu) = (q.view((n, 0), (m, n)).into_owned(), q.view((n, n), (m, m)).into_owned());
        let q_u = q_z.rows(n, m).into_owned();
        found.residual = if q_u.amax() > found.residual || q_u.amax().is_nan() { q_u.amax() } else { found.residual };
        found.scale = found.scale.max((0..m).map(|a| now[(n + a, joint)].abs()).fold(0.0, f64::max));
        (0..m).for_each(|a| q_uu[(a, a)] += shift);
        let factor = Cholesky::new(q_uu).ok_or(Failure::Indefinite(t - 1))?;
        let (gain, forward) = (-factor.solve(&q_ux), -factor.solve(&q_u));
        for a in 0..m {
            (0..n).for_each(|i| policy.feedback.set(t - 1, a, i, gain[(a, i)]));
            policy.feedforward.vector_mut(t - 1)[a] = forward[a];
        }
        let closed = closed(&gain);
        s = closed.transpose() * &q * &closed;
        s = (&s + s.transpose()) * 0.5;
        slope = q_z.rows(0, n) + gain.transpose() * q_u;
    }
    Ok(found)
}

/// `S~` and `J~_x` from `S` and `J_x` where a random change of covariance `change` comes in between, and what it adds to the
/// value; `None` if the exponential has no finite mean.
fn inflate(s: &mut DMatrix<f64>, slope: &mut DVector<f64>, change: &DMatrix<f64>, sensitivity: f64) -> Option<f64> {
    if sensitivity == 0.0 {
        return Some(0.5 * s.dot(change));
    }
    let eigen = SymmetricEigen::new((change + change.transpose()) * 0.5);
    let mut gamma = eigen.eigenvectors;
    for (mut column, value) in gamma.column_iter_mut().zip(eigen.eigenvalues.iter()) {
        column *= value.max(0.0).sqrt();
    }
    let s_gamma = &*s * &gamma;
    let m = DMatrix::identity(s.nrows(), s.nrows()) - gamma.transpose() * &s_gamma * sensitivity;
    let factor = Cholesky::new((&m + m.transpose()) * 0.5)?;
    let seen = gamma.transpose() * &*slope;
    let solved = factor.solve(&seen);
    let log_determinant: f64 = 2.0 * (0..m.nrows()).map(|i| math::ln(factor.l_dirty()[(i, i)])).sum::<f64>();
    let value = 0.5 * sensitivity * seen.dot(&solved) - 0.5 * log_determinant / sensitivity;
    *slope += &s_gamma * solved * sensitivity;
    let added = &s_gamma * factor.solve(&s_gamma.transpose()) * sensitivity;
    *s += (&added + added.transpose()) * 0.5;
    value.is_finite().then_some(value)
}

/// The cost-to-go `S` and the price of uncertain belief `Xi` of a law with any gains `K`, for the expected cost (theory,
/// equation P.19), into its `curvature` and `value_of_information`:
///
/// ```text
/// Q = l_zz + F' S+ F      S = [I K'] Q [I; K]      Xi = -(K' Q_uu K + Q_ux' K + K' Q_ux) = Q_xx - S
/// ```
///
/// ```
/// use supple_lqg::{Knots, LinearQuadratic, Policy, Regularisation, risk, solve_riccati};
///
/// let plant = LinearQuadratic { a: &[[1.0]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let knots = Knots::linear(50, plant)?;
/// let mut policy = Policy::zeros(knots.dimensions, 50);
/// solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
/// let best = policy.curvature.get(0, 0, 0);
/// policy.feedback.set(2, 0, 0, -0.9);
/// risk::price(&knots, &mut policy);
/// assert!(policy.curvature.get(0, 0, 0) > best, "any other gain costs more");
/// # Ok::<(), supple_lqg::Error>(())
/// ```
pub fn price(knots: &Knots, policy: &mut Policy) {
    let (steps, n, joint) = (knots.steps(), knots.dynamics.rows(), knots.dynamics.cols());
    let mut s = dense(&knots.cost, steps).view((0, 0), (n, n)).into_owned();
    store(&mut policy.curvature, steps, &s);
    for t in (0..steps).rev() {
        let (cost, f) = (dense(&knots.cost, t), dense(&knots.dynamics, t));
        let q = cost.columns(0, joint) + f.transpose() * &s * &f;
        let closed = closed(&dense(&policy.feedback, t));
        s = closed.transpose() * &q * &closed;
        s = (&s + s.transpose()) * 0.5;
        store(&mut policy.curvature, t, &s);
        store(&mut policy.value_of_information, t, &(q.view((0, 0), (n, n)) - &s));
    }
}

/// `1/2 sum Tr(l_xx Sigma)`: what the covariance of the belief costs at any controls, and [`Found::value`] does not have.
///
/// ```
/// use supple_lqg::{Belief, Knots, LinearQuadratic, risk};
///
/// let plant = LinearQuadratic { a: &[[1.0]], b: &[[1.0]], c: &[[1.0]], q: &[[3.0]], r: &[[1.0]] };
/// let mut belief = Belief::zeros(1, 1, 1);
/// belief.corrected.set(1, 0, 0, 2.0);
/// assert_eq!(risk::belief_alone(&Knots::linear(1, plant)?, &belief), 3.0);
/// # Ok::<(), supple_lqg::Error>(())
/// ```
#[must_use]
pub fn belief_alone(knots: &Knots, belief: &Belief) -> f64 {
    let (cost, sigma) = (&knots.cost, &belief.corrected);
    let n = sigma.rows();
    let at = |t: usize| {
        let row = |i: usize| &cost.at(t)[i * cost.stride()..][..n];
        (0..n).map(|i| rows::dot(row(i), &sigma.at(t)[i * sigma.stride()..][..n])).sum::<f64>()
    };
    0.5 * (0..sigma.count()).map(at).sum::<f64>()
}

/// `[I; K]`
fn closed(gain: &DMatrix<f64>) -> DMatrix<f64> {
    let (m, n) = gain.shape();
    DMatrix::from_fn(n + m, n, |i, j| if i >= n { gain[(i - n, j)] } else { f64::from(u8::from(i == j)) })
}
