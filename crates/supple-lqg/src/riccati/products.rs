//! Products that a step of the sweep forms, and their memory.

use supple_kernels::rows::{Left, Product, Rows, Scaled, View, ViewMut, mirror};
use supple_kernels::{Lanes, Matrices, padded};

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
    /// `T'`, h x n, with room after its last row.
    transposed: Matrices,
    /// `[T_q' 0]`, h x (n + m).
    base: Matrices,
    /// `T_q F_v`, h x h; only the lower triangle is computed.
    carried: Matrices,
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
        }
    }

    /// Memory of this length.
    pub fn lend(&mut self, len: usize) -> &mut [f64] {
        &mut self.product.at_mut(0)[..len]
    }

    /// Keeps `Q_uu`, whose lower triangle is given in the rows of gains, for [`Products::of_controls`].
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

    /// For dynamics `F = [E + dt F_v; F_v]` with `E = [I 0]`, with `T = dt S_{:q} + S_{:v}` and `U = dt T_q + T_v`:
    ///
    /// ```text
    /// F' S F = F_v' (U F_v + [T_q' 0]) + E' (S_qq + T_q F_v)     (lower triangle)
    /// ```
    #[inline(always)]
    pub fn carry<L: Lanes, R: Rows>(
        &mut self,
        shape: Shape<R>,
        carried: Carried,
        s: &[f64],
        f: &[f64],
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
