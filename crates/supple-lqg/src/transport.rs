//! Symmetric matrices propagated by the dynamics, such as covariances: `F X F'`.

use supple_kernels::rows::{Left, Product, Rows, Scaled, View, ViewMut, mirror, transpose};
use supple_kernels::{Lanes, Matrices};

use crate::carried::Carried;

/// Memory for propagating n x n matrices through dynamics with up to a given number of columns.
#[derive(Clone, Debug)]
pub(crate) struct Transport {
    /// `F X`, n x columns.
    pub product: Matrices,
    /// `F'`, or only the part of it that belongs to the rates.
    transposed: Matrices,
    /// `F_v X F_v'`, h x h.
    rates: Matrices,
}

impl Transport {
    pub fn new(n: usize, columns: usize) -> Self {
        Self {
            product: Matrices::zeros(1, n, columns),
            transposed: Matrices::zeros(1, columns, n),
            rates: Matrices::zeros(1, n / 2, n / 2),
        }
    }
}

/// Dynamics as given by a sweep: rows of `F`, of which only some columns are used.
#[derive(Clone, Copy)]
pub(crate) struct Mover<'a> {
    pub f: View<'a>,
    pub rows: usize,
    pub columns: usize,
    pub carried: Option<Carried>,
}

impl Mover<'_> {
    /// `out = F X F' + W`; for dynamics `F = [E + dt F_v; F_v]` with `E = [I 0]`, from `G = F_v X`:
    ///
    /// ```text
    /// [vv] = G F_v'      [vq] = G E' + dt G F_v'      [qq] = X_qq + dt (G E' + E G') + dt^2 G F_v'
    /// ```
    ///
    /// `work.product` holds `F X` afterwards; for dynamics with carried positions, only the rows of rates.
    #[inline(always)]
    pub fn transport<L: Lanes, R: Rows>(self, x: View, w: Option<View>, out: &mut [f64], work: &mut Transport) {
        let Self { f, rows: n, columns, carried } = self;
        let (narrow, width) = (R::stride(n), R::stride(columns));
        let Transport { product, transposed, rates } = work;
        let (product, transposed) = (product.at_mut(0), transposed.at_mut(0));
        let h = carried.map_or(0, |carried| carried.rows);
        let (moving, own) = (View::new(&f.numbers[h * f.stride..], f.stride), &mut product[h * width..]);
        let left = Left::plain(moving.numbers, f.stride);
        Product { left, right: x, rows: n - h, inner: columns, width }.set::<L, R>(ViewMut::new(own, width));
        let turned = R::stride(n - h);
        transpose::<L, R>(ViewMut::new(transposed, turned), moving, n - h, columns);
        let (left, right) = (Left::plain(own, width), View::new(transposed, turned));
        let all = Product { left, right, rows: n - h, inner: columns, width: turned }.lower();
        match carried {
            Some(carried) if R::CALLED => {
                let rates = rates.at_mut(0);
                all.set::<L, R>(ViewMut::new(rates, turned));
                mirror::<L, R>(ViewMut::new(rates, turned), h);
                let (g, m) = (View::new(own, width), View::new(rates, turned));
                fill(ViewMut::new(out, narrow), carried, g, m, x);
                if let Some(w) = w {
                    let noise = Scaled { from: w, factor: 1.0, rows: n, count: n };
                    noise.add::<L, R>(ViewMut::new(out, narrow));
                }
            }
            _ => match w {
                Some(w) => all.add_to::<L, R>(w, ViewMut::new(out, narrow)),
                None => all.set::<L, R>(ViewMut::new(out, narrow)),
            },
        }
        mirror::<L, R>(ViewMut::new(out, narrow), n);
    }

    /// The rows of positions of `F X`, from those of rates.
    #[inline(always)]
    pub fn carry<L: Lanes, R: Rows>(self, x: View, work: &mut Transport) {
        if let Some(Carried { rows: h, dt }) = self.carried {
            let width = R::stride(self.columns);
            let (positions, rates) = work.product.at_mut(0).split_at_mut(h * width);
            let moved = Scaled { from: View::new(rates, width), factor: dt, rows: h, count: self.columns };
            moved.add_to::<L, R>(x, ViewMut::new(positions, width));
        }
    }
}

/// The lower triangle from `G`, `M = G F_v'` and `X`.
#[inline(always)]
fn fill(out: ViewMut, carried: Carried, g: View, m: View, x: View) {
    let (Carried { rows: h, dt }, ViewMut { numbers: out, stride }) = (carried, out);
    let (View { numbers: g, stride: width }, View { numbers: m, stride: half }) = (g, m);
    let (upper, lower) = out.split_at_mut(h * stride);
    for i in 0..h {
        let (g_row, moved) = (&g[i * width..i * width + h], &m[i * half..i * half + h]);
        let (position, rate) = lower[i * stride..i * stride + 2 * h].split_at_mut(h);
        for j in 0..h {
            position[j] = g_row[j] + dt * moved[j];
            rate[j] = moved[j];
        }
        let (to, x) = (&mut upper[i * stride..=i * stride + i], &x.numbers[i * x.stride..=i * x.stride + i]);
        for j in 0..=i {
            to[j] = x[j] + dt * (g_row[j] + g[j * width + i]) + dt * dt * moved[j];
        }
    }
}
