//! The quadratic that a step of the sweep minimises: `Q = l_zz + F' S F` and its slope.

use supple_kernels::rows::{self, Into, Left, multiply, multiply_lower};
use supple_kernels::{Job, Lanes, Matrices};

use crate::carried::Carried;
use crate::shape::Shape;

/// Memory of [`Quadratic`].
#[derive(Clone, Debug)]
pub(super) struct Products {
    /// `S F`, or the part of it that rates move.
    product: Matrices,
    /// `[T_q; U]` of (P.2f).
    combined: Matrices,
    /// `F' J_x`.
    slope: Matrices,
}

impl Products {
    pub fn new(n: usize, joint: usize) -> Self {
        Self {
            product: Matrices::zeros(1, n.max(joint - n), joint),
            combined: Matrices::zeros(1, n, n),
            slope: Matrices::vectors(1, joint),
        }
    }

    /// Memory of this length for a product of the gains.
    pub fn of_controls(&mut self, len: usize) -> &mut [f64] {
        &mut self.product.at_mut(0)[..len]
    }
}

/// The lower triangle of `Q = l_zz + F' S F` and the slope `Q_z = l_z + F' J_x` in column n + m of `q`, from the knot's
/// `F` and `[l_zz | l_z]` and the next `S` and `J_x` (theory, equations P.2 and P.2f).
pub(super) struct Quadratic<'a> {
    pub shape: Shape,
    pub carried: Option<Carried>,
    pub knot: (&'a [f64], &'a [f64]),
    pub next: (&'a [f64], &'a [f64]),
    pub q: &'a mut [f64],
    pub products: &'a mut Products,
}

impl Job for Quadratic<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { shape, carried, knot: (f, cost), next: (next, next_slope), q, products } = self;
        let (n, joint, stride, wide) = (shape.n, shape.joint(), shape.wide(), shape.full());
        let Products { product, combined, slope } = products;
        let (product, slope) = (product.at_mut(0), slope.at_mut(0));
        match carried {
            Some(carried) => {
                let Carried { rows: h, dt } = carried;
                combine(shape, carried, next, combined.at_mut(0));
                let rates = &f[h * stride..];
                let combined = Left::plain(combined.at(0), shape.narrow());
                multiply::<L>(product, combined, rates, stride, (n, n - h), Into::Set);
                let moved = (&product[h * stride..], stride);
                let left = Left::transposed(rates, stride);
                multiply_lower::<L>((q, wide), left, moved, (joint, n - h), Into::AddTo(cost));
                carry::<L>(shape, h, next, product, q);
                slope.fill(0.0);
                slope[..h].copy_from_slice(&next_slope[..h]);
                for i in 0..n - h {
                    let carried = if i < h { dt * next_slope[i] } else { 0.0 };
                    let row = &rates[i * stride..(i + 1) * stride];
                    rows::add_scaled::<L>(slope, next_slope[h + i] + carried, row);
                }
            }
            None => {
                multiply::<L>(product, Left::plain(next, shape.narrow()), f, stride, (n, n), Into::Set);
                let left = Left::transposed(f, stride);
                multiply_lower::<L>((q, wide), left, (product, stride), (joint, n), Into::AddTo(cost));
                slope.fill(0.0);
                for (i, &factor) in next_slope[..n].iter().enumerate() {
                    rows::add_scaled::<L>(slope, factor, &f[i * stride..(i + 1) * stride]);
                }
            }
        }
        for a in 0..joint {
            q[a * wide + joint] = cost[a * wide + joint] + slope[a];
        }
    }
}

/// `[T_q; U]`: `T = dt S_{:q} + S_{:v}`, `U = dt T_q + T_v`.
#[inline(always)]
fn combine(shape: Shape, carried: Carried, s: &[f64], out: &mut [f64]) {
    let (n, narrow, Carried { rows: h, dt }) = (shape.n, shape.narrow(), carried);
    for i in 0..n {
        let (s, out) = (&s[i * narrow..i * narrow + n], &mut out[i * narrow..i * narrow + n - h]);
        for ((out, q), v) in out.iter_mut().zip(&s[..h]).zip(&s[h..]) {
            *out = dt * q + v;
        }
    }
    let (upper, lower) = out.split_at_mut(h * narrow);
    for (to, from) in lower.chunks_mut(narrow).zip(upper.chunks(narrow)).take(h) {
        to[..n - h].iter_mut().zip(&from[..n - h]).for_each(|(to, from)| *to += dt * from);
    }
}

/// Adds `E' S_qq E + E' T_q F_v + (E' T_q F_v)'` to the lower triangle.
#[inline(always)]
fn carry<L: Lanes>(shape: Shape, h: usize, s: &[f64], product: &[f64], q: &mut [f64]) {
    let (joint, narrow, stride, wide) = (shape.joint(), shape.narrow(), shape.wide(), shape.full());
    for a in 0..h {
        let (row, s) = (&mut q[a * wide..=a * wide + a], &s[a * narrow..=a * narrow + a]);
        for ((to, moved), s) in row.iter_mut().zip(&product[a * stride..=a * stride + a]).zip(s) {
            *to += moved + s;
        }
    }
    rows::add_transposed_lower::<L>((q, wide), (product, stride), (joint, h));
}
