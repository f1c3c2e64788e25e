use supple_kernels::rows::{self, Into, Left, multiply, multiply_lower};
use supple_kernels::{Job, Lanes, Matrices, dispatch};

use super::sequential::CorrectEach;
use super::{array, guard};
use crate::Error;
use crate::carried::Carried;
use crate::dense::{Dense, dense};
use crate::knots::Knots;
use crate::noise::Noise;
use crate::shape::{Shape, with_shape};

/// The belief along a trajectory: covariances, gains and innovation factors.
#[derive(Clone, Debug)]
pub struct Belief {
    /// `P_t`, n x n, N + 1 of them: before the measurement at t.
    pub predicted: Matrices,
    /// `Sigma_t`, n x n, N + 1 of them: after it.
    pub corrected: Matrices,
    /// Transposed Kalman gain `L_t'`, p x n, N + 1 of them.
    pub gain_transposed: Matrices,
    /// Lower Cholesky factor of `S^y_t = C P C' + V`, p x p, N + 1 of them; or, where measurements are taken one at a
    /// time, the roots of their variances on the diagonal, whose product is the same.
    pub innovation_factor: Matrices,
    /// Rows of the covariance that were measured, p x n, N + 1 of them, where measurements are taken one at a time.
    pub(super) pivots: Matrices,
    /// How the last sweep took measurements.
    pub(super) form: Form,
    /// Number of repairs that restored positive semidefiniteness of `Sigma`.
    pub repairs: usize,
    pub(super) work: Work,
}

/// How measurements are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// All of a step together.
    Together,
    /// One at a time.
    EachAlone,
    /// All together, with square roots of the covariances.
    Roots,
}

/// Memory of one step.
#[derive(Clone, Debug)]
pub(super) struct Work {
    square: Matrices,
    transposed: Matrices,
    /// G = C P, p x n.
    pub cross: Matrices,
    /// D', p x n.
    defect: Matrices,
    /// Of `V`, p x p, where it is not diagonal.
    noise_factor: Matrices,
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
            form: Form::Together,
            repairs: 0,
            work: Work {
                square: Matrices::zeros(1, n, n),
                transposed: Matrices::zeros(1, n, n),
                cross: Matrices::zeros(1, p, n),
                defect: Matrices::zeros(1, p, n),
                noise_factor: Matrices::zeros(1, p, p),
            },
        }
    }

    /// A factor, n x p, of the covariance reduction by the measurements of step `t`: `L S^y L' = P - Sigma` (also
    /// rename `told` to `reduction`).
    pub(crate) fn told(&self, t: usize) -> Dense {
        let factor = dense(&self.innovation_factor, t);
        if self.form != Form::EachAlone {
            return dense(&self.gain_transposed, t).tr_mul(&factor.lower_triangle());
        }
        let mut told = dense(&self.pivots, t).transpose();
        told.column_iter_mut().zip(factor.diagonal().iter()).for_each(|(mut column, root)| column /= *root);
        told
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
/// Independent measurements of single states are processed sequentially, which is equivalent. If double precision is
/// not sufficient, for example with two sensors of very different precision, the square-root form is used (B.2d).
///
/// # Errors
/// Where `V` is not positive definite, or a number is not finite.
pub fn kalman(knots: &Knots, noise: &Noise, belief: &mut Belief) -> Result<(), Error> {
    dispatch(Sweep { knots, noise, belief })
}

struct Sweep<'a> {
    knots: &'a Knots,
    noise: &'a Noise,
    belief: &'a mut Belief,
}

/// Steps between two full checks that `Sigma` is positive semidefinite.
const GUARD_INTERVAL: usize = 16;

impl Job for Sweep<'_> {
    type Output = Result<(), Error>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { knots, noise, belief } = self;
        with_shape!(Shape::of(knots.dimensions), |shape| sweep::<L>(shape, knots, noise, belief))
    }
}

#[inline(always)]
fn sweep<L: Lanes>(shape: Shape, knots: &Knots, noise: &Noise, belief: &mut Belief) -> Result<(), Error> {
    let steps = knots.steps();
    belief.repairs = 0;
    let picks = knots.picks.as_deref().filter(|_| noise.measurements_are_independent());
    belief.form = if picks.is_some() { Form::EachAlone } else { Form::Together };
    let suggested = Carried::suggested(&knots.dynamics);
    belief.predicted.at_mut(0).copy_from_slice(noise.initial.at(0));
    for t in 0..=steps {
        if t > 0 {
            let (steps, w) = ((t - 1, t), noise.process.at(t - 1));
            shape.part::<L, _>(Predict { shape, suggested, steps, knots, w, belief });
        }
        match picks {
            Some(picks) => {
                let corrected =
                    shape.part::<L, _>(CorrectEach { shape, t, picks, variances: noise.measurement.at(t), belief });
                corrected.map_err(|_| Error::NotPositiveDefinite { what: "the innovation covariance", step: t })?;
            }
            None => {
                let v = noise.measurement.at(t);
                if shape.part::<L, _>(Correct { shape, t, knots, v, belief }) != Ok(Digits::Enough) {
                    return array::sweep(knots, noise, belief);
                }
            }
        }
        if t % GUARD_INTERVAL == 0 || t == steps {
            belief.repairs += usize::from(guard::mend(belief.corrected.at_mut(t), shape.n, shape.narrow()));
        }
    }
    Ok(())
}

/// From the belief at one step to what it predicts of another, [`predict`], as a part of a sweep.
pub(super) struct Predict<'a> {
    pub shape: Shape,
    pub suggested: Option<Carried>,
    pub steps: (usize, usize),
    pub knots: &'a Knots,
    pub w: &'a [f64],
    pub belief: &'a mut Belief,
}

impl Job for Predict<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        predict::<L>(self);
    }
}

/// `P_to = A_from Sigma_from A_from' + W`; of dynamics `A = [E + dt A_v; A_v]` with `E = [I 0]`, from `G = A_v Sigma`:
///
/// ```text
/// P_vv = G A_v' + W_vv      P_vq = G E' + dt G A_v' + W_vq      P_qq = Sigma_qq + dt (G E' + E G') + dt^2 G A_v' +
/// W_qq
/// ```
#[inline(always)]
fn predict<L: Lanes>(part: Predict) {
    let Predict { shape, suggested, steps: (from, to), knots, w, belief } = part;
    let (n, stride, wide) = (shape.n, shape.narrow(), shape.wide());
    let Belief { predicted, corrected, work: Work { square, transposed, .. }, .. } = belief;
    let (a_sigma, transposed) = (square.at_mut(0), transposed.at_mut(0));
    let (sigma, predicted) = (corrected.at(from), predicted.at_mut(to));
    let carried = suggested.filter(|carried| carried.holds(knots.dynamics.at(from), wide));
    let h = carried.map_or(0, |carried| carried.rows);
    let f = &knots.dynamics.at(from)[h * wide..];
    multiply::<L>(a_sigma, Left::plain(f, wide), sigma, stride, (n - h, n), Into::Set);
    rows::transpose::<L>(transposed, stride, f, wide, (n - h, n));
    let left = Left::plain(a_sigma, stride);
    let Some(Carried { dt, .. }) = carried else {
        multiply_lower::<L>((predicted, stride), left, (transposed, stride), (n, n), Into::AddTo(w));
        rows::mirror::<L>(predicted, n, stride);
        return;
    };
    let (upper, lower) = predicted.split_at_mut(h * stride);
    multiply_lower::<L>((upper, stride), left, (transposed, stride), (h, n), Into::Set);
    rows::mirror::<L>(upper, h, stride);
    for i in 0..h {
        let (row, moved) = (i * stride, &upper[i * stride..i * stride + h]);
        let (carried, rate) = lower[row..row + n].split_at_mut(h);
        for j in 0..h {
            carried[j] = a_sigma[row + j] + dt * moved[j] + w[row + h * stride + j];
            rate[j] = moved[j] + w[row + h * stride + h + j];
        }
    }
    for i in 0..h {
        for j in 0..=i {
            let at = i * stride + j;
            let first = a_sigma[at] + a_sigma[j * stride + i];
            upper[at] = sigma[at] + dt * first + dt * dt * upper[at] + w[at];
        }
    }
    rows::mirror::<L>(predicted, n, stride);
}

/// Whether rounding errors are small relative to the innovation covariance and to `Sigma`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Digits {
    Enough,
    Few,
}

/// From `P_t` to `Sigma_t` with the noise `V`, [`correct`], as a part of a sweep.
pub(super) struct Correct<'a> {
    pub shape: Shape,
    pub t: usize,
    pub knots: &'a Knots,
    pub v: &'a [f64],
    pub belief: &'a mut Belief,
}

impl Job for Correct<'_> {
    /// `Err(i)` where the `i`th pivot of the innovation covariance is not positive.
    type Output = Result<Digits, usize>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { shape, t, knots, v, belief } = self;
        correct::<L>(shape, t, knots, v, belief)
    }
}

#[inline(always)]
fn correct<L: Lanes>(shape: Shape, t: usize, knots: &Knots, v: &[f64], belief: &mut Belief) -> Result<Digits, usize> {
    let (n, p, stride, small) = (shape.n, shape.p, shape.narrow(), shape.small());
    let c = knots.measurement.at(t);
    let predicted = belief.predicted.at(t);
    let Work { cross, defect, noise_factor, .. } = &mut belief.work;
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
    let (mut over_pivot, mut told): (f64, f64) = (0.0, 0.0);
    let mut alone = true;
    for i in 0..p {
        // At least `|C| |P| |C|'`, by Cauchy's inequality.
        let spread: f64 = (0..n).map(|j| c[i * stride + j] * c[i * stride + j] * predicted[j * stride + j]).sum();
        let (line, root) = (&factor[i * small..=i * small + i], factor[i * small + i]);
        over_pivot = over_pivot.max(n as f64 * spread / (root * root));
        told += rows::dot(line, line) / v[i * small + i];
        alone &= v[i * small..i * small + i].iter().all(|&v| v == 0.0);
    }
    if !alone {
        let own = noise_factor.at_mut(0);
        own.copy_from_slice(v);
        rows::cholesky(own, p, small)?;
        rows::cholesky_solve_from::<L>(own, small, c, defect, stride, p);
        told = (0..p).map(|i| rows::dot(&cross[i * stride..i * stride + n], &defect[i * stride..i * stride + n])).sum();
    }
    let few = array::hides(over_pivot) || array::blurs(over_pivot, told);
    let digits = if few { Digits::Few } else { Digits::Enough };
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
    Ok(digits)
}
