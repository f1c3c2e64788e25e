//! Sequential updates with measurements of single states with independent noise: no matrix is factored, and rounding
//! stays small whatever the ratio of covariance to noise.

use supple_kernels::math;
use supple_kernels::rows::{self, Left, Product, Rows, View, ViewMut, combine, mirror_single};
use supple_kernels::{Job, Lanes, Matrices};

use super::innovation::Innovation;
use super::state::Belief;
use crate::noise::Noise;
use crate::shape::Shape;

/// Number of measurements whose changes of the covariance are applied together.
const GROUP: usize = 8;

/// From `P_t` to `Sigma_t`, [`correct`], as a part of a sweep.
pub(super) struct CorrectEach<'a, R> {
    pub shape: Shape<R>,
    pub t: usize,
    /// The state that each measurement measures.
    pub picks: &'a [usize],
    /// `V`.
    pub variances: &'a [f64],
    pub belief: &'a mut Belief,
}

impl<R: Rows> Job for CorrectEach<'_, R> {
    type Output = Result<(), usize>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        correct::<L, R>(self)
    }
}

/// From `P_t` to `Sigma_t` (theory, equation B.2b): for each measurement of state `s` with variance `v`, with `g` the row
/// `s` of `P`,
///
/// ```text
/// S = g_s + v      P <- P - g g' / S; row and column s are set to g v / S exactly
/// ```
///
/// Stores `g` and `S` for the reverse sweep. For a group of measurements, every `g` is computed first, given the preceding
/// ones; then `P`, stored as its lower triangle only, is updated once. `Err(i)` if the `i`th innovation variance is not
/// positive.
#[inline(always)]
fn correct<L: Lanes, R: Rows>(part: CorrectEach<R>) -> Result<(), usize> {
    let CorrectEach { shape, t, picks, variances, belief } = part;
    let (n, stride, small) = (shape.n, shape.narrow(), shape.small());
    let Belief { predicted, corrected, gain_transposed, innovation_factor, pivots, work, .. } = belief;
    let p = corrected.at_mut(t);
    p.copy_from_slice(predicted.at(t));
    let (pivots, factor, gain) = (pivots.at_mut(t), innovation_factor.at_mut(t), gain_transposed.at_mut(t));
    let exact = work.cross.at_mut(0);
    let mut reciprocals = [0.0; GROUP];
    for first in (0..picks.len()).step_by(GROUP) {
        let group = &picks[first..picks.len().min(first + GROUP)];
        let variance = |k: usize| variances[(first + k) * small + first + k];
        let (mut rows, mut scaled) =
            (pivots[first * stride..].chunks_mut(stride), gain[first * stride..].chunks_mut(stride));
        let mut done: [(&[f64], &[f64]); GROUP] = [(&[], &[]); GROUP];
        for (k, &s) in group.iter().enumerate() {
            let (Some(pivot), Some(scaled)) = (rows.next(), scaled.next()) else {
                unreachable!("a row of each measurement")
            };
            if first == 0 {
                // All of `P_t` is still available here; values just stored one by one are slow to load as vectors.
                pivot.copy_from_slice(&p[s * stride..(s + 1) * stride]);
            } else {
                pivot[..=s].copy_from_slice(&p[s * stride..=s * stride + s]);
                for j in s + 1..n {
                    pivot[j] = p[j * stride + s];
                }
            }
            for (j, &(before, by)) in done[..k].iter().enumerate() {
                take::<L>(pivot, s, group[j], before, by, variance(j) * reciprocals[j]);
            }
            let innovation = pivot[s] + variance(k);
            if !(innovation > 0.0 && innovation.is_finite()) {
                return Err(first + k);
            }
            factor[(first + k) * (small + 1)] = innovation.sqrt();
            reciprocals[k] = 1.0 / innovation;
            scaled.copy_from_slice(pivot);
            rows::scale::<L>(scaled, reciprocals[k]);
            done[k] = (pivot, scaled);
        }
        // The exact values in the measured rows, once the whole group is processed.
        for (k, (&s, exact)) in group.iter().zip(exact.chunks_mut(stride)).enumerate() {
            exact.copy_from_slice(done[k].0);
            rows::scale::<L>(exact, variance(k) * reciprocals[k]);
            for j in k + 1..group.len() {
                let (before, by) = done[j];
                take::<L>(exact, s, group[j], before, by, variance(j) * reciprocals[j]);
            }
        }
        let (pivots, gain) = (&pivots[first * stride..], &gain[first * stride..]);
        let (left, right) = (Left::transposed(pivots, stride), View::new(gain, stride));
        let told = Product { left, right, rows: n, inner: group.len(), width: stride };
        told.lower().subtract::<L, R>(ViewMut::new(p, stride));
        for (&s, exact) in group.iter().zip(exact.chunks(stride)) {
            p[s * stride..=s * stride + s].copy_from_slice(&exact[..=s]);
            for j in s + 1..n {
                p[j * stride + s] = exact[j];
            }
        }
    }
    mirror_single::<L, R>(ViewMut::new(p, stride), n);
    // L' = V^-1 C Sigma.
    for (i, &s) in picks.iter().enumerate() {
        let row = &mut gain[i * stride..(i + 1) * stride];
        row.copy_from_slice(&p[s * stride..(s + 1) * stride]);
        rows::scale::<L>(row, 1.0 / variances[i * small + i]);
    }
    Ok(())
}

impl Belief {
    /// Updates an estimate with measurements one at a time, once [`correct_each`](super::correct_each) has updated the
    /// covariance; the combined innovation statistics
    /// are the same as with all measurements together.
    pub fn take_in(&self, t: usize, picks: &[usize], measured: &[f64], mean: &mut [f64]) -> Innovation {
        let (pivots, factor) = (self.pivots.at(t), &self.innovation_factor);
        let stride = self.pivots.stride();
        let mut found = Innovation::default();
        for (i, &s) in picks.iter().enumerate() {
            let (pivot, root) = (&pivots[i * stride..], factor.get(t, i, i));
            let innovation = (measured[i] - mean[s]) / root;
            found.squared += innovation * innovation;
            found.log_determinant += 2.0 * math::ln(root);
            let by = innovation / root;
            mean.iter_mut().zip(pivot).for_each(|(mean, pivot)| *mean += by * pivot);
        }
        found
    }
}

/// Row `s` of the covariance after state `other` was measured: `g`, `g / S` and `v / S` belong to that measurement.
#[inline(always)]
fn take<L: Lanes>(row: &mut [f64], s: usize, other: usize, g: &[f64], scaled: &[f64], left: f64) {
    if s == other {
        row.copy_from_slice(g);
        rows::scale::<L>(row, left);
    } else {
        rows::add_scaled::<L>(row, -g[s], scaled);
        row[other] = g[s] * left;
    }
}

/// [`reverse`] as a part of a sweep.
pub(super) struct ReverseEach<'a, R> {
    pub shape: Shape<R>,
    pub t: usize,
    /// The state that each measurement measures.
    pub picks: &'a [usize],
    /// Weight of the information.
    pub information: f64,
    pub belief: &'a Belief,
    pub memory: Memory<'a>,
    pub noise_adjoint: &'a mut Noise,
}

/// The adjoint of `Sigma_t`, the output for the adjoint of `P_t`, and a row of length n.
pub(super) struct Memory<'a> {
    pub sigma: &'a Matrices,
    pub predicted: &'a mut Matrices,
    pub row: &'a mut Matrices,
}

impl<R: Rows> Job for ReverseEach<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        reverse::<L, R>(self);
    }
}

/// From the adjoint `Sb` of `Sigma_t` to that of `P_t` (theory, equation B.2c): the measurements in reverse order, each by
///
/// ```text
/// h = Sb g / S     k = g' h / S + i / (2 S)     Sb <- Sb - h e_s' - e_s h' + k e_s e_s'     vb += k
/// ```
///
/// where `i` is the weight of the information. `C` picks states regardless of the design, so it has no adjoint.
#[inline(always)]
fn reverse<L: Lanes, R: Rows>(part: ReverseEach<R>) {
    let ReverseEach { shape, t, picks, information, belief, memory, noise_adjoint } = part;
    let Memory { sigma, predicted, row } = memory;
    let (n, stride, small) = (shape.n, shape.narrow(), shape.small());
    let adjoint = predicted.at_mut(0);
    adjoint.copy_from_slice(sigma.at(0));
    if picks.is_empty() {
        rows::symmetrise::<L, R>(ViewMut::new(adjoint, stride), n);
        return;
    }
    let h = &mut row.at_mut(0)[..stride];
    let (pivots, factor) = (belief.pivots.at(t), belief.innovation_factor.at(t));
    let v = noise_adjoint.measurement.at_mut(t);
    for (i, &s) in picks.iter().enumerate().rev() {
        let pivot = &pivots[i * stride..i * stride + n];
        let root = factor[i * small + i];
        let reciprocal = 1.0 / (root * root);
        combine::<L, R>(h, None, reciprocal, pivot, View::new(adjoint, stride));
        let k = (rows::dot(pivot, &h[..n]) + 0.5 * information) * reciprocal;
        for j in 0..n {
            adjoint[j * stride + s] -= h[j];
        }
        for j in 0..n {
            adjoint[s * stride + j] -= h[j];
        }
        adjoint[s * stride + s] += k;
        v[i * small + i] += k;
    }
    rows::symmetrise::<L, R>(ViewMut::new(adjoint, stride), n);
}
