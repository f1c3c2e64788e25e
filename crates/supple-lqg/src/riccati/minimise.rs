use supple_kernels::rows::{
    Left, Product, Rows, Scaled, View, ViewMut, clear_beyond, combine, dot, factor, mirror, solve_upper_beside,
};
use supple_kernels::{LANES, Lanes};

use super::lq::Decrease;
use super::policy::Policy;
use crate::shape::Shape;

/// The minimiser at step `t`, by `Q_uu = U' U` and `[Y | y] = U'^-1 [Q_ux | Q_u]`:
///
/// ```text
/// K = -U^-1 Y     k = -U^-1 y     S = Q_xx - Y' Y     J_x = Q_x - Y' y     Xi = Y' Y
/// ```
///
/// # Errors
/// Where `Q_uu` is not positive definite.
#[inline(always)]
pub(super) fn minimise<L: Lanes, R: Rows>(
    shape: Shape<R>,
    t: usize,
    with_value: bool,
    policy: &mut Policy,
) -> Result<Decrease, ()> {
    let Shape { n, m, .. } = shape;
    let (narrow, wide, (first, stride)) = (shape.narrow(), shape.wide(), shape.gains());
    take_gains::<L, R>(shape, policy);
    let Policy {
        feedback,
        feedforward,
        curvature,
        slope,
        value_of_information,
        q,
        q_slope,
        gain,
        reciprocals,
        roots,
        ..
    } = policy;
    let (q, gain, reciprocals) = (q.at(0), gain.at_mut(0), reciprocals.at_mut(0));
    factor::<L, R>(ViewMut::new(gain, stride), m, stride, reciprocals).map_err(drop)?;
    if let Some(roots) = roots {
        let small = roots.stride();
        for (to, from) in roots.at_mut(t).chunks_exact_mut(small).zip(gain.chunks_exact(stride)) {
            to[..m].copy_from_slice(&from[..m]);
        }
    }
    let k = &mut feedforward.at_mut(t)[..m];
    k.iter_mut().enumerate().for_each(|(a, k)| *k = gain[a * stride + first + n]);
    let square = dot(k, k);

    let y = &gain[first..];
    let (left, right) = (Left::transposed(y, stride), View::new(y, stride));
    let told = Product { left, right, rows: n, inner: m, width: narrow }.lower();
    let (curvature, q) = (curvature.at_mut(t), View::new(q, wide));
    let xi = value_of_information.at_mut(t);
    // Of long rows, the product is not computed a second time, as this takes longer than reading it.
    let shared = with_value && R::CALLED;
    if shared {
        told.set::<L, R>(ViewMut::new(xi, narrow));
        for first in (0..n).step_by(LANES) {
            let (end, from) = (n.min(first + LANES), View::new(&xi[first * narrow..], narrow));
            let less = Scaled { from, factor: -1.0, rows: end - first, count: end };
            let base = View::new(&q.numbers[first * wide..], wide);
            less.add_to::<L, R>(base, ViewMut::new(&mut curvature[first * narrow..], narrow));
        }
    } else {
        told.subtract_from::<L, R>(q, ViewMut::new(curvature, narrow));
    }
    mirror::<L, R>(ViewMut::new(curvature, narrow), n);
    let slope = &mut slope.at_mut(t)[..narrow];
    combine::<L, R>(slope, Some(q_slope.at(0)), -1.0, k, View::new(y, stride));
    clear_beyond::<L>(slope, n);
    if with_value {
        if !shared {
            told.set::<L, R>(ViewMut::new(xi, narrow));
        }
        mirror::<L, R>(ViewMut::new(xi, narrow), n);
    }

    solve_upper_beside::<L, R>(ViewMut::new(gain, stride), m, (first, stride - first), reciprocals);
    give_gains::<L, R>(shape, gain, feedback.at_mut(t), k);
    Ok(Decrease { linear: -square, quadratic: 0.5 * square })
}

/// The lower triangle of `Q_uu`, and `[Q_ux | Q_u]`, from the lower triangle of `Q`.
#[inline(always)]
pub(super) fn take_gains<L: Lanes, R: Rows>(shape: Shape<R>, policy: &mut Policy) {
    let Shape { n, m, .. } = shape;
    let (wide, (first, stride)) = (shape.wide(), shape.gains());
    let Policy { q, q_slope, gain, .. } = policy;
    let (q, by_u, gain) = (&q.at(0)[n * wide..], &q_slope.at(0)[n..n + m], gain.at_mut(0));
    let rows = Scaled { from: View::new(&q[n..], wide), factor: 1.0, rows: m, count: m };
    rows.set::<L, R>(ViewMut::new(gain, stride));
    let rows = Scaled { from: View::new(q, wide), factor: 1.0, rows: m, count: n };
    rows.set::<L, R>(ViewMut::new(&mut gain[first..], stride));
    for (a, by_u) in by_u.iter().enumerate() {
        gain[a * stride + first + n] = *by_u;
    }
}

/// `K = -X` and `k = -x` from `[X | x]` in the place of `[Q_ux | Q_u]`.
#[inline(always)]
pub(super) fn give_gains<L: Lanes, R: Rows>(shape: Shape<R>, gain: &[f64], feedback: &mut [f64], k: &mut [f64]) {
    let Shape { n, m, .. } = shape;
    let (narrow, (first, stride)) = (shape.narrow(), shape.gains());
    let rows = Scaled { from: View::new(&gain[first..], stride), factor: -1.0, rows: m, count: n };
    rows.set::<L, R>(ViewMut::new(feedback, narrow));
    for (a, k) in k.iter_mut().enumerate() {
        *k = -gain[a * stride + first + n];
    }
}
