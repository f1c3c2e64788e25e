//! The quadratic that a step of the sweep minimises: `Q = l_zz + F' S F` and its slope.

use supple_kernels::Lanes;
use supple_kernels::rows::{Left, Product, Rows, View, ViewMut, combine};

use super::policy::Policy;
use crate::carried::Carried;
use crate::shape::Shape;

/// A knot's `F` and `[l_zz | l_z]`.
#[derive(Clone, Copy)]
pub(super) struct Knot<'a> {
    pub dynamics: &'a [f64],
    pub cost: &'a [f64],
}

/// The lower triangle of `Q = l_zz + F' S F` and the slope `Q_z = l_z + F' J_x`, into `policy.q` and `policy.q_slope`, from
/// the cost-to-go of step `next` (theory, equations P.2 and P.2f).
#[inline(always)]
pub(super) fn form<L: Lanes, R: Rows>(
    shape: Shape<R>,
    knot: Knot,
    carried: Option<Carried>,
    next: usize,
    policy: &mut Policy,
) {
    let Shape { n, .. } = shape;
    let (joint, narrow, wide, full) = (shape.joint(), shape.narrow(), shape.wide(), shape.full());
    let Policy { curvature, slope, q, q_slope, products, .. } = policy;
    let (s, next_slope, f) = (curvature.at(next), &slope.at(next)[..n], knot.dynamics);
    let (cost, slope) = (View::new(knot.cost, full), &mut q_slope.at_mut(0)[..wide]);
    let q = ViewMut::new(q.at_mut(0), wide);
    match carried {
        Some(carried) if R::CALLED => {
            products.carry::<L, R>(shape, carried, s, f, cost, q);
            let h = carried.rows;
            let weights = products.lend(h);
            for ((weight, q), v) in weights.iter_mut().zip(next_slope).zip(&next_slope[h..]) {
                *weight = carried.dt * q + v;
            }
            combine::<L, R>(slope, None, 1.0, weights, View::new(&f[h * wide..], wide));
            slope.iter_mut().zip(&next_slope[..h]).for_each(|(to, from)| *to += from);
        }
        _ => {
            let product = products.lend(n * wide);
            let (left, right) = (Left::transposed(s, narrow), View::new(f, wide));
            Product { left, right, rows: n, inner: n, width: wide }.set::<L, R>(ViewMut::new(product, wide));
            let (left, right) = (Left::transposed(f, wide), View::new(product, wide));
            Product { left, right, rows: joint, inner: n, width: wide }.lower().add_to::<L, R>(cost, q);
            combine::<L, R>(slope, None, 1.0, next_slope, View::new(f, wide));
        }
    }
    for (a, to) in slope[..joint].iter_mut().enumerate() {
        *to += knot.cost[a * full + joint];
    }
}
