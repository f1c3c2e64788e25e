use supple_kernels::rows::{self, Into, Left, multiply};
use supple_kernels::{Job, Lanes, Matrices, dispatch};

use super::guard;
use crate::Error;
use crate::knots::Knots;
use crate::noise::Noise;

/// What is known of the state along a trajectory.
#[derive(Clone, Debug)]
pub struct Belief {
    /// `P_t`, n x n, N + 1 of them: before the measurement at t.
    pub predicted: Matrices,
    /// `Sigma_t`, n x n, N + 1 of them: after it.
    pub corrected: Matrices,
    /// Transposed Kalman gain `L_t'`, p x n, N + 1 of them.
    pub gain_transposed: Matrices,
    /// Lower Cholesky factor of `S^y_t = C P C' + V`, p x p, N + 1 of them.
    pub innovation_factor: Matrices,
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
        let steps = knots.steps();
        belief.repairs = 0;
        belief.predicted.at_mut(0).copy_from_slice(noise.initial.at(0));
        for t in 0..=steps {
            if t > 0 {
                predict::<L>((t - 1, t), knots, noise, belief);
            }
            if correct::<L>(t, knots, noise, belief).is_err() {
                *result = Err(Error::NotPositiveDefinite { what: "the innovation covariance", step: t });
                return;
            }
            if t % GUARD_INTERVAL == 0 || t == steps {
                let (n, stride) = (knots.dimensions.states, belief.corrected.stride());
                belief.repairs += usize::from(guard::mend(belief.corrected.at_mut(t), n, stride));
            }
        }
    }
}

/// `P_to = A_from Sigma_from A_from' + W`.
#[inline(always)]
pub(super) fn predict<L: Lanes>((from, to): (usize, usize), knots: &Knots, noise: &Noise, belief: &mut Belief) {
    let n = knots.dimensions.states;
    let (stride, wide) = (belief.corrected.stride(), knots.dynamics.stride());
    let f = knots.dynamics.at(from);
    let Work { square, transposed, .. } = &mut belief.work;
    let (a_sigma, transposed) = (square.at_mut(0), transposed.at_mut(0));
    multiply::<L>(a_sigma, Left::plain(f, wide), belief.corrected.at(from), stride, (n, n), Into::Set);
    rows::transpose(transposed, stride, f, wide, (n, n));
    let predicted = belief.predicted.at_mut(to);
    predicted.copy_from_slice(noise.process.at(to));
    multiply::<L>(predicted, Left::plain(a_sigma, stride), transposed, stride, (n, n), Into::Add);
    rows::symmetrise(predicted, n, stride);
}

/// From `P_t` to `Sigma_t`.
#[inline(always)]
pub(super) fn correct<L: Lanes>(t: usize, knots: &Knots, noise: &Noise, belief: &mut Belief) -> Result<(), usize> {
    let (n, p) = (knots.dimensions.states, knots.dimensions.measurements);
    let (stride, small) = (belief.corrected.stride(), belief.innovation_factor.stride());
    let (c, v) = (knots.measurement.at(t), noise.measurement.at(t));
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
    gain.copy_from_slice(cross);
    rows::cholesky_solve::<L>(factor, small, gain, stride, p);

    // T = P - L (C P), kept in `corrected`; then Sigma = T - D L'.
    let corrected = belief.corrected.at_mut(t);
    corrected.copy_from_slice(predicted);
    multiply::<L>(corrected, Left::transposed(gain, stride), cross, stride, (n, p), Into::Subtract);
    for k in 0..p {
        let c = &c[k * stride..k * stride + n];
        for i in 0..n {
            let noise: f64 = (0..p).map(|j| gain[j * stride + i] * v[j * small + k]).sum();
            defect[k * stride + i] = rows::dot(&corrected[i * stride..i * stride + n], c) - noise;
        }
    }
    multiply::<L>(corrected, Left::transposed(defect, stride), gain, stride, (n, p), Into::Subtract);
    rows::symmetrise(corrected, n, stride);
    Ok(())
}
