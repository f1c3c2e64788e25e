//! Measurements of a step taken together.

use supple_kernels::rows::{
    Left, Product, Rows, Scaled, View, ViewMut, dot, factor, mirror, solve_column, solve_upper_beside, symmetrise,
};
use supple_kernels::{Job, Lanes};

use super::array;
use super::innovation::form;
use super::state::{Belief, Work};
use crate::knots::Knots;
use crate::shape::Shape;

/// Whether rounding errors are small relative to the innovation covariance and to `Sigma`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Digits {
    Enough,
    Few,
}

/// From `P_t` to `Sigma_t` with the noise `V`, as a part of a sweep: with `S^y = U' U` and `Y = U'^-1 C P`
///
/// ```text
/// T = P - Y' Y      L' = U^-1 Y      D' = C T - V L'      Sigma = T - D L'
/// ```
pub(super) struct Correct<'a, R> {
    pub shape: Shape<R>,
    pub t: usize,
    pub knots: &'a Knots,
    pub v: &'a [f64],
    pub belief: &'a mut Belief,
}

impl<R: Rows> Job for Correct<'_, R> {
    /// `Err(i)` where the `i`th pivot of the innovation covariance is not positive.
    type Output = Result<Digits, usize>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { shape, t, knots, v, belief } = self;
        let Shape { n, p, .. } = shape;
        let (narrow, small) = (shape.narrow(), shape.small());
        let stride = small + narrow;
        let (c, predicted) = (knots.measurement.at(t), belief.predicted.at(t));
        let Work { cross, innovation, reciprocals, noise_factor, column, .. } = &mut belief.work;
        let (cross, rows, reciprocals) = (cross.at_mut(0), innovation.at_mut(0), reciprocals.at_mut(0));

        form::<L, R>(shape, c, predicted, v, cross, ViewMut::new(rows, stride));
        let beside = Scaled { from: View::new(cross, narrow), factor: 1.0, rows: p, count: n };
        beside.set::<L, R>(ViewMut::new(&mut rows[small..], stride));
        factor::<L, R>(ViewMut::new(rows, stride), p, stride, reciprocals)?;
        let kept = belief.innovation_factor.at_mut(t);
        let (mut over_pivot, mut told): (f64, f64) = (0.0, 0.0);
        let mut alone = true;
        for i in 0..p {
            for j in 0..=i {
                kept[i * small + j] = rows[j * stride + i];
            }
            // At least `|C| |P| |C|'`, by Cauchy's inequality.
            let spread: f64 = (0..n).map(|j| c[i * narrow + j] * c[i * narrow + j] * predicted[j * narrow + j]).sum();
            let (line, root) = (&kept[i * small..=i * small + i], kept[i * small + i]);
            over_pivot = over_pivot.max(n as f64 * spread / (root * root));
            told += dot(line, line) / v[i * small + i];
            alone &= v[i * small..i * small + i].iter().all(|&v| v == 0.0);
        }
        if !alone {
            let seen = |i: usize, j: usize| dot(&cross[i * narrow..i * narrow + n], &c[j * narrow..j * narrow + n]);
            told = trace_by_noise(v, small, p, noise_factor.at_mut(0), column.at_mut(0), seen);
        }
        // An infinite trace is that of a `V` that is not positive definite, which square roots refuse.
        let few = array::hides(over_pivot) || array::blurs(over_pivot, told) || told == f64::INFINITY;

        let corrected = belief.corrected.at_mut(t);
        let (left, right) = (Left::transposed(&rows[small..], stride), View::new(&rows[small..], stride));
        let told = Product { left, right, rows: n, inner: p, width: narrow }.lower();
        told.subtract_from::<L, R>(View::new(predicted, narrow), ViewMut::new(corrected, narrow));
        mirror::<L, R>(ViewMut::new(corrected, narrow), n);
        solve_upper_beside::<L, R>(ViewMut::new(rows, stride), p, (small, narrow), reciprocals);
        let gain = belief.gain_transposed.at_mut(t);
        let solved = Scaled { from: View::new(&rows[small..], stride), factor: 1.0, rows: p, count: n };
        solved.set::<L, R>(ViewMut::new(gain, narrow));

        // D', overwriting C P.
        let defect = cross;
        let (left, right) = (Left::plain(c, narrow), View::new(corrected, narrow));
        Product { left, right, rows: p, inner: n, width: narrow }.set::<L, R>(ViewMut::new(defect, narrow));
        let (left, gain) = (Left::transposed(v, small), View::new(gain, narrow));
        Product { left, right: gain, rows: p, inner: p, width: narrow }.subtract::<L, R>(ViewMut::new(defect, narrow));
        let left = Left::transposed(defect, narrow);
        Product { left, right: gain, rows: n, inner: p, width: narrow }
            .subtract::<L, R>(ViewMut::new(corrected, narrow));
        symmetrise::<L, R>(ViewMut::new(corrected, narrow), n);
        let shrinks = (0..n).any(|j| array::hides(predicted[j * narrow + j] / corrected[j * narrow + j]));
        let gain = &belief.gain_transposed.at(t)[..p * narrow];
        let few = few || shrinks && shows(n, narrow, [predicted, corrected], gain, c);
        Ok(if few { Digits::Few } else { Digits::Enough })
    }
}

/// Whether rounding of `P` affects `Sigma`: an error `dP` propagates to `(I - L C) dP (I - L C)'`.
fn shows(n: usize, stride: usize, [predicted, corrected]: [&[f64]; 2], gain: &[f64], c: &[f64]) -> bool {
    let deviation = |j: usize| predicted[j * (stride + 1)].sqrt();
    (0..n).any(|j| {
        let left = |k: usize| {
            let told: f64 = gain.chunks_exact(stride).zip(c.chunks_exact(stride)).map(|(l, c)| l[j] * c[k]).sum();
            (f64::from(u8::from(j == k)) - told).abs() * deviation(k)
        };
        array::hides((0..n).map(left).sum::<f64>().powi(2) / corrected[j * (stride + 1)])
    })
}

/// `Tr(M V^-1)` of an `M` given by its entries, with a factor of `V` and one column as work space; infinite if `V` is not
/// positive definite.
fn trace_by_noise(
    v: &[f64],
    stride: usize,
    p: usize,
    factor: &mut [f64],
    column: &mut [f64],
    entry: impl Fn(usize, usize) -> f64,
) -> f64 {
    for i in 0..p {
        for j in 0..=i {
            let (row, other) = (&factor[i * stride..i * stride + j], &factor[j * stride..j * stride + j]);
            let left = v[i * stride + j] - dot(row, other);
            if i == j && (left.is_nan() || left <= 0.0) {
                return f64::INFINITY;
            }
            factor[i * stride + j] = if i == j { left.sqrt() } else { left / factor[j * stride + j] };
        }
    }
    let mut trace = 0.0;
    for j in 0..p {
        (0..p).for_each(|i| column[i] = entry(i, j));
        solve_column(factor, stride, &mut column[..p]);
        trace += column[j];
    }
    trace
}
