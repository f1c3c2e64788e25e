//! The Newton system of the search: block tridiagonal in time, plus a rank-one term for the budget.

use supple_kernels::rows::dot;
use supple_kernels::{Band, RIGHT_SIDES, halt};

use super::local::{Local, Scaling};
use super::reduce::Chain;
use crate::dense::{Dense, solve_lower};

/// The length of a symmetric matrix of order `n` as a vector of its lower triangle by rows.
pub(super) fn packed(n: usize) -> usize {
    n * (n + 1) / 2
}

/// A symmetric matrix as the vector whose dot products are traces: entries off the diagonal times the root of 2.
fn pack(a: &Dense, out: &mut [f64]) {
    let mut k = 0;
    for i in 0..a.nrows() {
        for j in 0..i {
            out[k] = std::f64::consts::SQRT_2 * a[(i, j)];
            k += 1;
        }
        out[k] = a[(i, i)];
        k += 1;
    }
}

/// Inverse of [`pack`].
fn unpack(v: &[f64], n: usize) -> Dense {
    let mut out = Dense::zeros(n, n);
    let mut k = 0;
    for i in 0..n {
        for j in 0..i {
            let value = v[k] * std::f64::consts::FRAC_1_SQRT_2;
            (out[(i, j)], out[(j, i)]) = (value, value);
            k += 1;
        }
        out[(i, i)] = v[k];
        k += 1;
    }
    out
}

/// Adds `factor` times row `(i, j)` of the symmetric Kronecker product of `u` (theory, equation L.8), only its packed
/// columns from triangle row `from` on: the row that maps `d` to entry `(i, j)` of `u d u'`. `u` is given by its rows.
#[inline(always)]
fn add_kronecker_row(out: &mut [f64], factor: f64, [left, right]: [&[f64]; 2], from: usize) {
    let mut start = packed(from);
    for k in from..left.len() {
        let (lk, rk) = (factor * left[k], factor * right[k]);
        let row = &mut out[start..start + k + 1];
        for ((out, l), r) in row[..k].iter_mut().zip(&left[..k]).zip(&right[..k]) {
            *out += lk * r + rk * l;
        }
        row[k] += std::f64::consts::FRAC_1_SQRT_2 * (lk * right[k] + rk * left[k]);
        start += k + 1;
    }
}

/// The Newton system, with memory that is reused.
pub(super) struct Newton {
    band: Band,
    out: [Vec<Vec<f64>>; RIGHT_SIDES],
    orders: Vec<usize>,
}

impl Newton {
    /// For a chain of these orders.
    pub fn new(chain: &Chain) -> Self {
        let orders: Vec<usize> = (0..chain.stages.len()).map(|t| chain.order(t)).collect();
        let lengths: Vec<usize> = orders.iter().map(|&n| packed(n)).collect();
        Self { band: Band::zeros(&lengths), out: [Vec::new(), Vec::new()], orders }
    }

    /// The changes `d_t` of `p_t` that solve the system for the gradients given, with `weight` of the budget's rank-one
    /// term, and the change of the cost, as a share of the budget.
    ///
    /// # Errors
    /// The decision at which the system is not numerically positive definite, or the next one when a stop was requested.
    pub fn solve(
        &mut self,
        chain: &Chain,
        local: &[Local],
        scalings: &[Scaling],
        gradients: &[Dense],
        barrier: f64,
        weight: f64,
    ) -> Result<(Vec<Dense>, f64), usize> {
        for t in 0..local.len() {
            if halt::is_requested() {
                return Err(t);
            }
            self.assemble(chain, local, scalings, t, barrier);
            self.set_sides(t, &gradients[t], &local[t].price);
        }
        self.band.solve(&mut self.out)?;
        let [free, priced] = &self.out;
        let (mut of_free, mut of_priced) = (0.0, 0.0);
        let mut price = Vec::new();
        for (t, local) in local.iter().enumerate() {
            price.resize(packed(self.orders[t]), 0.0);
            pack(&local.price, &mut price);
            of_free += dot(&price, &free[t]);
            of_priced += dot(&price, &priced[t]);
        }
        let share = of_free / (1.0 / weight + of_priced);
        let steps = (0..local.len()).map(|t| {
            let step: Vec<f64> = free[t].iter().zip(&priced[t]).map(|(f, p)| f - share * p).collect();
            unpack(&step, self.orders[t])
        });
        Ok((steps.collect(), of_free - share * of_priced))
    }

    /// Writes block row `t` (theory, equation L.7).
    fn assemble(&mut self, chain: &Chain, local: &[Local], scalings: &[Scaling], t: usize, barrier: f64) {
        let n = self.orders[t];
        let here = &scalings[t].metric;
        let next = chain.next(t).map(|next| {
            let a = &local[t].dynamics;
            let carried = &scalings[next].metric * a;
            let half = solve_lower(&local[next].predicted_factor, a.clone());
            (half.transpose() * half, a.transpose() * &carried, carried)
        });
        let mut k = 0;
        for i in 0..n {
            for j in 0..=i {
                let scale = if i == j { std::f64::consts::FRAC_1_SQRT_2 } else { 1.0 };
                let row = self.band.row_mut(t, k);
                row.diagonal.fill(0.0);
                row.next.fill(0.0);
                add_kronecker_row(row.diagonal, scale, rows(here, i, j), i);
                if let Some((known, coupled, carried)) = &next {
                    add_kronecker_row(row.diagonal, scale, rows(coupled, i, j), i);
                    add_kronecker_row(row.diagonal, -0.5 * scale, rows(known, i, j), i);
                    if chain.wraps {
                        let across = carried.transpose();
                        add_kronecker_row(row.diagonal, -scale, rows(carried, i, j), i);
                        add_kronecker_row(row.diagonal, -scale, rows(&across, i, j), i);
                    } else {
                        add_kronecker_row(row.next, -scale, rows(carried, i, j), 0);
                    }
                }
                row.diagonal[k] += 0.5 + barrier;
                k += 1;
            }
        }
    }

    /// Writes the right sides of block `t`: the descent and the price.
    fn set_sides(&mut self, t: usize, gradient: &Dense, price: &Dense) {
        let length = packed(self.orders[t]);
        let mut sides = [vec![0.0; length], vec![0.0; length]];
        pack(gradient, &mut sides[0]);
        pack(price, &mut sides[1]);
        for (k, (descent, price)) in sides[0].iter().zip(&sides[1]).enumerate() {
            let row = self.band.row_mut(t, k);
            (row.right[0], row.right[1]) = (-descent, *price);
        }
    }
}

/// Columns `i` and `j`.
fn rows(a: &Dense, i: usize, j: usize) -> [&[f64]; 2] {
    let n = a.nrows();
    [i, j].map(|row| &a.as_slice()[row * n..(row + 1) * n])
}
