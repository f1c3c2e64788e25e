use supple_kernels::rows::{self, Into, Left, multiply};
use supple_kernels::{Job, Lanes, Matrices, dispatch};

use super::{guard, sequential};
use crate::Error;
use crate::knots::Knots;
use crate::noise::Noise;
use crate::shape::{Shape, with_shape};

/// What is known of the state along a trajectory.
#[derive(Clone, Debug)]
pub struct Belief {
    /// `P_t`, n x n, N + 1 of them: before the measurement at t.
    pub predicted: Matrices,
    /// `Sigma_t`, n x n, N + 1 of them: after it.
    pub corrected: Matrices,
    /// Transposed Kalman gain `L_t'`, p x n, N + 1 of them.
    pub gain_transposed: Matrices,
    /// Lower Cholesky factor of `S^y_t = C P C' + V`, p x p, N + 1 of them; or, where measurements are taken one at a time,
    /// the roots of their variances on the diagonal, whose product is the same.
    pub innovation_factor: Matrices,
    /// Rows of the covariance that were measured, p x n, N + 1 of them, where measurements are taken one at a time.
    pub(super) pivots: Matrices,
    /// How often rounding had to be mended for `Sigma` to stay positive semidefinite.
    pub repairs: usize,
    work: Work,
}

/// Memory of one step.
#[derive(Clone, Debug)]
struct Work {
    square: Matrices,
    transposed: Matrices,
    /// G = C P, p x n.
    cross: Matrices,
    /// D', p x n.
    defect: Matrices,
}

impl Belief {
    /// Zeros for `steps` steps.
    pub fn zeros(states: usize, measurements: usize, steps: usize) -> Self {
        let (n, p) = (states, measurements);
        Self {
            predicted: Matrices::zeros(steps + 1, n, n),
            corrected: Matrices::zeros(steps + 1, n, n),
            gain_transposed: Matrices::zeros(steps + 1, p, n),
            innovation_factor: Matrices::zeros(steps + 1, p, p),
            pivots: Matrices::zeros(steps + 1, p, n),
            repairs: 0,
            work: Work {
                square: Matrices::zeros(1, n, n),
                transposed: Matrices::zeros(1, n, n),
                cross: Matrices::zeros(1, p, n),
                defect: Matrices::zeros(1, p, n),
            },
        }
    }
}

/// The Kalman recursion over knots (theory, equation B.1), in Joseph form:
///
/// ```text
/// P_0 = X_0      P_{t+1} = A Sigma A' + W      S^y = C P C' + V      L = P C' (S^y)^-1
/// Sigma = (I - L C) P (I - L C)' + L V L'
/// ```
///
/// With `T = P - L C P` and `D = T C' - L V`, zero but for rounding, the last line is `T - D L'`: the same number in
/// n^2 p operations, with the same cancellation of rounding errors. `P`, `Sigma`, `W` and `X_0` may be singular.
/// Measurements that are single states with independent noise are taken one at a time instead, which is the same.
///
/// # Errors
/// Where an innovation covariance is not positive definite.
pub fn kalman(knots: &Knots, noise: &Noise, belief: &mut Belief) -> Result<(), Error> {
    let mut result = Ok(());
    dispatch(Sweep { knots, noise, belief, result: &mut result });
    result
}

struct Sweep<'a> {
    knots: &'a Knots,
    noise: &'a Noise,
    belief: &'a mut Belief,
    result: &'a mut Result<(), Error>,
}

/// Steps between two full checks that `Sigma` is positive semidefinite.
const GUARD_INTERVAL: usize = 16;

impl Job for Sweep<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { knots, noise, belief, result } = self;
        with_shape!(Shape::of(knots.dimensions), |shape| *result = sweep::<L>(shape, knots, noise, belief));
    }
}

#[inline(always)]
fn sweep<L: Lanes>(shape: Shape, knots: &Knots, noise: &Noise, belief: &mut Belief) -> Result<(), Error> {
    let steps = knots.steps();
    belief.repairs = 0;
    let picks = knots.picks.as_deref().filter(|picks| sequential::applies(Some(picks), noise));
    belief.predicted.at_mut(0).copy_from_slice(noise.initial.at(0));
    for t in 0..=steps {
        if t > 0 {
            predict::<L>(shape, (t - 1, t), knots, noise.process.at(t - 1), belief);
        }
        let corrected = match picks {
            Some(picks) => sequential::correct::<L>(shape, t, (picks, &noise.measurement), belief),
            None => correct::<L>(shape, t, knots, noise.measurement.at(t), belief),
        };
        corrected.map_err(|_| Error::NotPositiveDefinite { what: "the innovation covariance", step: t })?;
        if t % GUARD_INTERVAL == 0 || t == steps {
            belief.repairs += usize::from(guard::mend(belief.corrected.at_mut(t), shape.n, shape.narrow()));
        }
    }
    Ok(())
}

/// `P_to = A_from Sigma_from A_from' + W`.
#[inline(always)]
pub(super) fn predict<L: Lanes>(
    shape: Shape,
    (from, to): (usize, usize),
    knots: &Knots,
    w: &[f64],
    belief: &mut Belief,
) {
    let (n, stride, wide) = (shape.n, shape.narrow(), shape.wide());
    let f = knots.dynamics.at(from);
    let Work { square, transposed, .. } = &mut belief.work;
    let (a_sigma, transposed) = (square.at_mut(0), transposed.at_mut(0));
    multiply::<L>(a_sigma, Left::plain(f, wide), belief.corrected.at(from), stride, (n, n), Into::Set);
    rows::transpose::<L>(transposed, stride, f, wide, (n, n));
    let predicted = belief.predicted.at_mut(to);
    let base = Into::AddTo(w);
    multiply::<L>(predicted, Left::plain(a_sigma, stride), transposed, stride, (n, n), base);
    rows::symmetrise::<L>(predicted, n, stride);
}

/// From `P_t` to `Sigma_t` with the noise `V`.
#[inline(always)]
pub(super) fn correct<L: Lanes>(
    shape: Shape,
    t: usize,
    knots: &Knots,
    v: &[f64],
    belief: &mut Belief,
) -> Result<(), usize> {
    let (n, p, stride, small) = (shape.n, shape.p, shape.narrow(), shape.small());
    let c = knots.measurement.at(t);
    let predicted = belief.predicted.at(t);
    let Work { cross, defect, .. } = &mut belief.work;
    let (cross, defect) = (cross.at_mut(0), defect.at_mut(0));

    multiply::<L>(cross, Left::plain(c, stride), predicted, stride, (p, n), Into::Set);
    let factor = belief.innovation_factor.at_mut(t);
    for i in 0..p {
        for j in 0..=i {
            let (row, other) = (&cross[i * stride..i * stride + n], &c[j * stride..j * stride + n]);
            factor[i * small + j] = rows::dot(row, other) + v[i * small + j];
        }
    }
    rows::cholesky(factor, p, small)?;
    let gain = belief.gain_transposed.at_mut(t);
    rows::cholesky_solve_from::<L>(factor, small, cross, gain, stride, p);

    // T = P - L (C P), symmetric but for rounding; D' = C T - V L'; Sigma = T - D L'.
    let corrected = belief.corrected.at_mut(t);
    let base = Into::SubtractFrom(predicted);
    multiply::<L>(corrected, Left::transposed(gain, stride), cross, stride, (n, p), base);
    rows::symmetrise::<L>(corrected, n, stride);
    multiply::<L>(defect, Left::plain(c, stride), corrected, stride, (p, n), Into::Set);
    multiply::<L>(defect, Left::plain(v, small), gain, stride, (p, p), Into::Subtract);
    multiply::<L>(corrected, Left::transposed(defect, stride), gain, stride, (n, p), Into::Subtract);
    rows::symmetrise::<L>(corrected, n, stride);
    Ok(())
}
