//! The quadratic that a step of the sweep minimises: `Q = l_zz + F' S F` and its slope.

use supple_kernels::rows::{Left, Product, Rows, Scaled, View, ViewMut, combine, mirror};
use supple_kernels::{Lanes, Matrices, padded};

use super::policy::Policy;
use crate::carried::Carried;
use crate::shape::Shape;

/// Memory of one step.
#[derive(Clone, Debug)]
pub(super) struct Products {
    /// `S F`, or `U F_v + [T_q' 0]` of (P.2f); and for other products of the step.
    product: Matrices,
    /// `Q_uu`, m x m.
    controls: Matrices,
    /// `U`, h x h.
    upper: Matrices,
    /// `T'`, h x n, and what follows its last row.
    transposed: Matrices,
    /// `[T_q' 0]`, h x (n + m).
    base: Matrices,
    /// `T_q F_v`, h x h, of which the lower triangle is computed.
    carried: Matrices,
    /// Weights of rates.
    weights: Vec<f64>,
}

impl Products {
    pub fn new(n: usize, m: usize) -> Self {
        let (h, square) = (n / 2, || Matrices::zeros(1, n / 2, n / 2));
        Self {
            product: Matrices::zeros(1, n.max(m), padded(n) + m),
            controls: Matrices::zeros(1, m, m),
            upper: square(),
            transposed: Matrices::zeros(1, h + 1, n),
            base: Matrices::zeros(1, h, n + m),
            carried: square(),
            weights: vec![0.0; h],
        }
    }

    /// Memory of this length.
    pub fn lend(&mut self, len: usize) -> &mut [f64] {
        &mut self.product.at_mut(0)[..len]
    }

    /// Keeps `Q_uu`, of which the lower triangle is given in the rows of gains, for [`Products::of_controls`].
    #[inline(always)]
    pub fn keep_controls<L: Lanes, R: Rows>(&mut self, shape: Shape<R>, gains: &[f64]) {
        let (m, small, (_, stride)) = (shape.m, shape.of_controls(), shape.gains());
        let kept = self.controls.at_mut(0);
        let rows = Scaled { from: View::new(gains, stride), factor: 1.0, rows: m, count: m };
        rows.set::<L, R>(ViewMut::new(kept, small));
        mirror::<L, R>(ViewMut::new(kept, small), m);
    }

    /// `Q_uu`, and memory of this length.
    pub fn of_controls(&mut self, len: usize) -> (&[f64], &mut [f64]) {
        (self.controls.at(0), &mut self.product.at_mut(0)[..len])
    }
}

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
            products.carry::<L, R>(shape, carried, (s, f), cost, q);
            let h = carried.rows;
            for ((weight, q), v) in products.weights.iter_mut().zip(next_slope).zip(&next_slope[h..]) {
                *weight = carried.dt * q + v;
            }
            combine::<L, R>(slope, None, 1.0, &products.weights, View::new(&f[h * wide..], wide));
            slope.iter_mut().zip(&next_slope[..h]).for_each(|(to, from)| *to += from);
        }
        _ => {
            let product = products.product.at_mut(0);
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

impl Products {
    /// Of dynamics `F = [E + dt F_v; F_v]` with `E = [I 0]`, with `T = dt S_{:q} + S_{:v}` and `U = dt T_q + T_v`:
    ///
    /// ```text
    /// F' S F = F_v' (U F_v + [T_q' 0]) + E' (S_qq + T_q F_v)     (lower triangle)
    /// ```
    #[inline(always)]
    fn carry<L: Lanes, R: Rows>(
        &mut self,
        shape: Shape<R>,
        carried: Carried,
        (s, f): (&[f64], &[f64]),
        cost: View,
        q: ViewMut,
    ) {
        let (h, joint, wide, narrow) = (carried.rows, shape.joint(), shape.wide(), shape.narrow());
        self.combine::<L, R>(shape, carried, s);
        let Self { product, upper, transposed, base, carried: moved, .. } = self;
        let (half, rates, product) = (R::stride(h), View::new(&f[h * wide..], wide), product.at_mut(0));
        let moved = moved.at_mut(0);
        let left = Left::transposed(transposed.at(0), narrow);
        let moving = Product { left, right: rates, rows: h, inner: h, width: half };
        moving.lower().add_to::<L, R>(View::new(s, narrow), ViewMut::new(moved, half));

        // U is symmetric.
        let left = Left::transposed(upper.at(0), half);
        let weighed = Product { left, right: rates, rows: h, inner: h, width: wide };
        weighed.add_to::<L, R>(View::new(base.at(0), wide), ViewMut::new(product, wide));
        let (left, right) = (Left::transposed(rates.numbers, wide), View::new(product, wide));
        let ViewMut { numbers: q, stride } = q;
        let product = Product { left, right, rows: joint, inner: h, width: wide };
        product.lower().add_to::<L, R>(cost, ViewMut::new(q, stride));
        // Right of the lower triangle there are zeros.
        let moved = Scaled { from: View::new(moved, half), factor: 1.0, rows: h, count: h };
        moved.add::<L, R>(ViewMut::new(q, stride));
    }

    /// `U`, `T'` and `[T_q' 0]`.
    #[inline(always)]
    fn combine<L: Lanes, R: Rows>(&mut self, shape: Shape<R>, Carried { rows: h, dt }: Carried, s: &[f64]) {
        let (narrow, half, wide) = (shape.narrow(), R::stride(h), shape.wide());
        let Self { upper, transposed, base, .. } = self;
        let (t, by_rates) = (transposed.at_mut(0), View::new(&s[h * narrow..], narrow));
        let positions = Scaled { from: View::new(s, narrow), factor: dt, rows: h, count: shape.n };
        positions.add_to::<L, R>(by_rates, ViewMut::new(t, narrow));
        let (of_positions, of_rates) = (View::new(t, narrow), View::new(&t[h..], narrow));
        let positions = Scaled { from: of_positions, factor: dt, rows: h, count: h };
        positions.add_to::<L, R>(of_rates, ViewMut::new(upper.at_mut(0), half));
        let positions = Scaled { factor: 1.0, ..positions };
        positions.set::<L, R>(ViewMut::new(base.at_mut(0), wide));
    }
}
