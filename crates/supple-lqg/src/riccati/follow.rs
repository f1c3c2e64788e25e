use supple_kernels::rows::{
    Left, Product, Rows, Scaled, View, ViewMut, add_scaled, clear_beyond, dot, factor, mirror, solve_lower_beside,
    solve_upper_beside,
};
use supple_kernels::{Job, Lanes};

use super::lq::{Decrease, Lq, Regularisation};
use super::minimise::{give_gains, take_gains};
use super::policy::Policy;
use crate::shape::Shape;

/// The gains at step `t` of a regularised problem or one with limits, and the cost-to-go of following them:
///
/// ```text
/// W = Q_uu K     V = Q_ux + W     S = Q_xx + K' V + Q_ux' K     J_x = Q_x + K' (Q_u + Q_uu k) + Q_ux' k     Xi = K' W
/// ```
pub(super) struct Follow<'a, R> {
    pub shape: Shape<R>,
    pub t: usize,
    pub lq: Lq<'a>,
    pub policy: &'a mut Policy,
}

impl<R: Rows> Job for Follow<'_, R> {
    /// `Err` where `Q_uu` is not positive definite on the controls that are free.
    type Output = Result<Decrease, ()>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { shape, t, lq, policy } = self;
        take_gains::<L, R>(shape, policy);
        policy.products.keep_controls::<L, R>(shape, policy.gain.at(0));
        regularise::<L, R>(shape, lq.regularisation, lq.dynamics.at(t), t + 1, policy);
        find_gains::<L, R>(shape, t, lq, policy)?;
        Ok(cost_to_go::<L, R>(shape, t, lq.with_value, policy))
    }
}

/// Adds the regularisation of the gains to `Q_uu` and `Q_ux`, from `F` and the next `S`.
#[inline(always)]
fn regularise<L: Lanes, R: Rows>(shape: Shape<R>, by: Regularisation, f: &[f64], next: usize, policy: &mut Policy) {
    let Shape { n, m, .. } = shape;
    let (narrow, wide, small, (first, stride)) = (shape.narrow(), shape.wide(), shape.of_controls(), shape.gains());
    let Policy { curvature, gain, products, .. } = policy;
    let (s, gain) = (curvature.at(next), gain.at_mut(0));
    if by.state > 0.0 {
        // F with each row multiplied by its share; state and control columns separate.
        let (by_x, by_u) = products.lend(n * (narrow + small)).split_at_mut(n * narrow);
        for i in 0..n {
            let row = &f[i * wide..i * wide + n + m];
            let (to_x, to_u) = (&mut by_x[i * narrow..(i + 1) * narrow], &mut by_u[i * small..(i + 1) * small]);
            let share = by.state * s[i * narrow + i].abs();
            to_x[n..].fill(0.0);
            to_u[m..].fill(0.0);
            to_x.iter_mut().zip(&row[..n]).for_each(|(to, from)| *to = share * from);
            to_u.iter_mut().zip(&row[n..]).for_each(|(to, from)| *to = share * from);
        }
        let (left, rows, inner) = (Left::transposed(&f[n..], wide), m, n);
        let right = View::new(by_x, narrow);
        Product { left, right, rows, inner, width: narrow }.add::<L, R>(ViewMut::new(&mut gain[first..], stride));
        let right = View::new(by_u, small);
        Product { left, right, rows, inner, width: small }.add::<L, R>(ViewMut::new(gain, stride));
    }
    if by.control > 0.0 {
        for a in 0..m {
            let entry = &mut gain[a * (stride + 1)];
            *entry += by.control * entry.abs().max(f64::MIN_POSITIVE);
        }
    }
}

/// `K` and `k` from `Q_uu` and `[Q_ux | Q_u]`.
#[inline(always)]
fn find_gains<L: Lanes, R: Rows>(shape: Shape<R>, t: usize, lq: Lq, policy: &mut Policy) -> Result<(), ()> {
    let Shape { n, m, .. } = shape;
    let (first, stride) = shape.gains();
    let Policy { feedback, feedforward, q_slope, gain, reciprocals, clamped, box_qp, .. } = policy;
    let (gain, feedforward) = (gain.at_mut(0), &mut feedforward.at_mut(t)[..m]);
    let Some(limits) = lq.limits else {
        let reciprocals = reciprocals.at_mut(0);
        factor::<L, R>(ViewMut::new(gain, stride), m, stride, reciprocals).map_err(drop)?;
        solve_upper_beside::<L, R>(ViewMut::new(gain, stride), m, (first, stride - first), reciprocals);
        give_gains::<L, R>(shape, gain, feedback.at_mut(t), feedforward);
        return Ok(());
    };
    box_qp.find(limits, t, View::new(gain, stride), &q_slope.vector(0)[n..])?;
    let free = box_qp.keep_free(ViewMut::new(gain, stride), first, n, reciprocals.at_mut(0));
    let beside = (first, stride - first);
    solve_lower_beside::<L, R>(ViewMut::new(gain, stride), free, beside, reciprocals.at(0));
    solve_upper_beside::<L, R>(ViewMut::new(gain, stride), free, beside, reciprocals.at(0));
    let feedback = ViewMut::new(feedback.at_mut(t), shape.narrow());
    box_qp.give(View::new(&gain[first..], stride), n, feedback, feedforward);
    clamped[t * m..(t + 1) * m].copy_from_slice(box_qp.held());
    Ok(())
}

/// The cost-to-go of following the gains of step `t`.
#[inline(always)]
fn cost_to_go<L: Lanes, R: Rows>(shape: Shape<R>, t: usize, with_value: bool, policy: &mut Policy) -> Decrease {
    let Shape { n, m, .. } = shape;
    let (narrow, wide, small) = (shape.narrow(), shape.wide(), shape.of_controls());
    let Policy { feedback, feedforward, curvature, slope, value_of_information, q, q_slope, products, .. } = policy;
    let (q, q_slope, (q_uu, w)) = (q.at(0), q_slope.at(0), products.of_controls(m * narrow));
    let (k, by_x, k_rows) = (feedforward.vector(t), &q[n * wide..], feedback.at(t));
    let gains = View::new(k_rows, narrow);
    let (rows, inner, width) = (n, m, narrow);

    let left = Left::transposed(q_uu, small);
    Product { left, right: gains, rows: m, inner, width }.set::<L, R>(ViewMut::new(w, narrow));
    let left = Left::transposed(k_rows, narrow);
    if with_value {
        let xi = value_of_information.at_mut(t);
        let right = View::new(w, narrow);
        Product { left, right, rows, inner, width }.lower().set::<L, R>(ViewMut::new(xi, narrow));
        mirror::<L, R>(ViewMut::new(xi, narrow), n);
    }
    let by_x_rows = Scaled { from: View::new(by_x, wide), factor: 1.0, rows: m, count: n };
    by_x_rows.add::<L, R>(ViewMut::new(w, narrow));
    let curvature = curvature.at_mut(t);
    let product = Product { left, right: View::new(w, narrow), rows, inner, width };
    product.lower().add_to::<L, R>(View::new(q, wide), ViewMut::new(curvature, narrow));
    let product = Product { left: Left::transposed(by_x, wide), right: gains, rows, inner, width };
    product.lower().add::<L, R>(ViewMut::new(curvature, narrow));
    mirror::<L, R>(ViewMut::new(curvature, narrow), n);

    let slope = &mut slope.at_mut(t)[..narrow];
    slope.copy_from_slice(&q_slope[..narrow]);
    let mut decrease = Decrease::default();
    for (a, (&k_a, by_u)) in k.iter().zip(&q_slope[n..n + m]).enumerate() {
        let curved = dot(&q_uu[a * small..a * small + m], k);
        decrease.linear += k_a * by_u;
        decrease.quadratic += 0.5 * k_a * curved;
        add_scaled::<L>(slope, by_u + curved, &k_rows[a * narrow..(a + 1) * narrow]);
        add_scaled::<L>(slope, k_a, &by_x[a * wide..a * wide + narrow]);
    }
    clear_beyond::<L>(slope, n);
    decrease
}
