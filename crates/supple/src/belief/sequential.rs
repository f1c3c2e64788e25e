//! Measurements that are single states with independent noise, taken one at a time: no matrix is factored, and rounding
//! stays small whatever the ratio of covariance to noise.

use supple_kernels::{LANES, Lanes, Matrices, rows};

use super::Belief;
use super::adjoint::BeliefAdjoint;
use crate::noise::Noise;
use crate::shape::Shape;

/// Whether measurements can be taken one at a time: they pick states, and their noise is independent.
pub(super) fn applies(picks: Option<&[usize]>, noise: &Noise) -> bool {
    let v = &noise.measurement;
    let independent = |t| (0..v.rows()).all(|i| (0..v.rows()).all(|j| i == j || v.get(t, i, j) == 0.0));
    picks.is_some() && (0..v.count()).all(independent)
}

/// From `P_t` to `Sigma_t` (theory, equation B.2b): for each measurement of state `s` with variance `v`, with `g` the row `s` of `P`,
///
/// ```text
/// S = g_s + v      P <- P - g g' / S, of which row and column s are g v / S to the last digit
/// ```
///
/// Keeps `g` and `S` for the way back. `Err(i)` where the `i`th innovation variance is not positive.
#[inline(always)]
pub(super) fn correct<L: Lanes>(
    shape: Shape,
    t: usize,
    (picks, variances): (&[usize], &Matrices),
    belief: &mut Belief,
) -> Result<(), usize> {
    let (n, stride, small) = (shape.n, shape.narrow(), shape.small());
    let Belief { predicted, corrected, gain_transposed, innovation_factor, pivots, .. } = belief;
    let p = corrected.at_mut(t);
    p.copy_from_slice(predicted.at(t));
    let (pivots, factor) = (pivots.at_mut(t), innovation_factor.at_mut(t));
    let variances = variances.at(t);
    for (i, &s) in picks.iter().enumerate() {
        let pivot = &mut pivots[i * stride..(i + 1) * stride];
        pivot.copy_from_slice(&p[s * stride..(s + 1) * stride]);
        let v = variances[i * small + i];
        let innovation = pivot[s] + v;
        if !(innovation > 0.0 && innovation.is_finite()) {
            return Err(i);
        }
        factor[i * small + i] = innovation.sqrt();
        let reciprocal = 1.0 / innovation;
        for column in (0..stride).step_by(LANES) {
            // SAFETY: `pivot` and every row of `p` hold `stride` numbers, and `p` has `n` rows.
            unsafe {
                let line = L::load(pivot.as_ptr().add(column)) * L::constant(-reciprocal);
                for j in 0..n {
                    let to = p.as_mut_ptr().add(j * stride + column);
                    L::constant(*pivot.get_unchecked(j)).mul_add(line, L::load(to)).store(to);
                }
            }
        }
        let left = v * reciprocal;
        for j in 0..n {
            p[j * stride + s] = pivot[j] * left;
            p[s * stride + j] = pivot[j] * left;
        }
    }
    rows::symmetrise::<L>(p, n, stride);
    // L' = V^-1 C Sigma.
    let gain = gain_transposed.at_mut(t);
    for (i, &s) in picks.iter().enumerate() {
        let row = &mut gain[i * stride..(i + 1) * stride];
        row.copy_from_slice(&p[s * stride..(s + 1) * stride]);
        rows::scale::<L>(row, 1.0 / variances[i * small + i]);
    }
    Ok(())
}

/// From the adjoint `Sb` of `Sigma_t`, in `work.sigma`, to that of `P_t` in `work.other` (theory, equation B.2c): the
/// measurements in reverse, each with
///
/// ```text
/// h = Sb g / S     k = g' h / S + i / (2 S)     Sb <- Sb - h e_s' - e_s h' + k e_s e_s'     vb += k
/// ```
///
/// with `i` the weight of the information. `C` picks states whatever the design: it has no adjoint.
#[inline(always)]
pub(super) fn reverse<L: Lanes>(
    shape: Shape,
    t: usize,
    (picks, information): (&[usize], f64),
    belief: &Belief,
    (work, noise_adjoint): (&mut BeliefAdjoint, &mut Noise),
) {
    let (n, stride, small) = (shape.n, shape.narrow(), shape.small());
    let BeliefAdjoint { sigma, other, cross, .. } = work;
    let adjoint = other.at_mut(0);
    adjoint.copy_from_slice(sigma.at(0));
    if picks.is_empty() {
        rows::symmetrise::<L>(adjoint, n, stride);
        return;
    }
    let h = &mut cross.at_mut(0)[..stride];
    let (pivots, factor) = (belief.pivots.at(t), belief.innovation_factor.at(t));
    let v = noise_adjoint.measurement.at_mut(t);
    for (i, &s) in picks.iter().enumerate().rev() {
        let pivot = &pivots[i * stride..(i + 1) * stride];
        let root = factor[i * small + i];
        let reciprocal = 1.0 / (root * root);
        for column in (0..stride).step_by(LANES) {
            // SAFETY: `h` and every row of `adjoint` hold `stride` numbers, and `adjoint` has `n` rows.
            unsafe {
                let mut sums = [L::zero(); 2];
                for j in 0..n {
                    let line = L::load(adjoint.as_ptr().add(j * stride + column));
                    sums[j % 2] = L::constant(*pivot.get_unchecked(j)).mul_add(line, sums[j % 2]);
                }
                ((sums[0] + sums[1]) * L::constant(reciprocal)).store(h.as_mut_ptr().add(column));
            }
        }
        let k = (rows::dot(&pivot[..n], &h[..n]) + 0.5 * information) * reciprocal;
        for j in 0..n {
            adjoint[j * stride + s] -= h[j];
        }
        for j in 0..n {
            adjoint[s * stride + j] -= h[j];
        }
        adjoint[s * stride + s] += k;
        v[i * small + i] += k;
    }
    rows::symmetrise::<L>(adjoint, n, stride);
}
