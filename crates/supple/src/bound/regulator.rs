//! The optimal regulator of a system that does not change: the Riccati equation by doubling.

use supple_kernels::Matrices;

use super::horizon::Stationary;
use super::subspace::observed;
use crate::Error;
use crate::dense::{Dense, cholesky, dense, semidefinite_root, solve_lower, store, symmetric};

/// Doublings after which a Riccati equation counts as without a solution.
const DOUBLINGS: usize = 60;

impl Stationary {
    /// That of `x+ = A x + B u + w`, `w` of covariance `process`, and the cost `1/2 z' L z` per step of `z = (x, u)`:
    /// `dynamics` is `[A, B]`, n x (n + m), and `cost` is `L`, (n + m) x (n + m), cross terms included.
    ///
    /// Where several regulators keep the cost finite it is that of least cost, which need not keep states bounded that
    /// cost nothing (theory, equation L.14).
    ///
    /// # Errors
    /// Where shapes do not fit, numbers are not finite, `L` is not positive semidefinite, or no regulator keeps the
    /// cost finite.
    pub fn new(dynamics: &Matrices, process: &Matrices, cost: &Matrices) -> Result<Self, Error> {
        let n = dynamics.rows();
        let joint = dynamics.cols();
        let shapes = [
            ("cost rows", cost.rows(), joint),
            ("cost columns", cost.cols(), joint),
            ("process covariance rows", process.rows(), n),
            ("process covariance columns", process.cols(), n),
        ];
        for (what, found, expected) in shapes {
            if found != expected {
                return Err(Error::Shape { what: what.into(), found, expected });
            }
        }
        if joint < n {
            return Err(Error::Shape { what: "a row of [A, B]".into(), found: joint, expected: n });
        }
        for (what, array) in [("[A, B]", dynamics), ("the process covariance", process), ("the cost", cost)] {
            if !array.at(0).iter().all(|v| v.is_finite()) {
                return Err(Error::NotFinite { what, step: 0 });
            }
        }
        let (f, l, w) = (dense(dynamics, 0), dense(cost, 0), dense(process, 0));
        if semidefinite_root(&l).is_none() {
            return Err(Error::NotPositiveSemidefinite { what: "the cost of states and controls", step: 0 });
        }
        let (a, b) = (f.columns(0, n).into_owned(), f.columns(n, joint - n).into_owned());
        let (s, xi) = regulator(&a, &b, &l)?;
        let (mut price, mut system) = (Matrices::constant(n, n), Matrices::constant(n, n));
        store(&mut price, 0, &(xi * 0.5));
        store(&mut system, 0, &a);
        Ok(Self { dynamics: system, process: process.clone(), price, base_cost: 0.5 * s.dot(&w) })
    }
}

/// `S` of the least-cost regulator and `Xi = K' Q_uu K` (theory, equation L.14).
pub(super) fn regulator(a: &Dense, b: &Dense, l: &Dense) -> Result<(Dense, Dense), Error> {
    let n = a.nrows();
    let m = b.ncols();
    let (q, cross, r) =
        (l.view((0, 0), (n, n)).into_owned(), l.view((0, n), (n, m)).into_owned(), l.view((n, n), (m, m)).into_owned());
    // S = X + D with D of a Riccati equation whose price of control is positive definite, whatever R is.
    let shift = if cholesky(&r).is_some() {
        Dense::zeros(n, n)
    } else {
        symmetric(Dense::identity(n, n) * (q.trace().max(f64::MIN_POSITIVE) / n as f64))
    };
    let r_shifted = symmetric(&r + b.transpose() * &shift * b);
    let cross_shifted = &cross + a.transpose() * &shift * b;
    let q_shifted = symmetric(&q + a.transpose() * &shift * a - &shift);
    let factor =
        cholesky(&r_shifted).ok_or(Error::NotPositiveDefinite { what: "the price of control R + B'SB", step: 0 })?;
    let (b_half, cross_half) = (solve_lower(&factor, b.transpose()), solve_lower(&factor, cross_shifted.transpose()));
    let a_free = a - b_half.transpose() * &cross_half;
    let q_free = symmetric(q_shifted - cross_half.transpose() * &cross_half);
    let basis = if shift.norm() == 0.0 { observed(&a_free, &q_free) } else { Dense::identity(n, n) };
    let (a_seen, q_seen) = (basis.transpose() * &a_free * &basis, symmetric(basis.transpose() * &q_free * &basis));
    let b_seen = &b_half * &basis;
    let none = Dense::zeros(a_seen.nrows(), a_seen.nrows());
    let found = doubling(&a_seen, symmetric(b_seen.transpose() * &b_seen), &q_seen, &none);
    let unsolved = || Error::NoBound {
        what: "no regulator keeps the expected cost per step finite".into(),
        advice: "let the controls act on every unstable state that costs something",
    };
    let found = found.ok_or_else(unsolved)?;
    let s = symmetric(&basis * found * basis.transpose() + shift);
    let g = symmetric(&r + b.transpose() * &s * b);
    let factor = cholesky(&g).ok_or_else(unsolved)?;
    let half = solve_lower(&factor, (cross + a.transpose() * &s * b).transpose());
    let xi = symmetric(half.transpose() * half);
    let residual = (q + a.transpose() * &s * a - &xi - &s).norm();
    if residual.is_finite() && residual <= 1e-7 * (s.norm() + xi.norm()) { Ok((s, xi)) } else { Err(unsolved()) }
}

/// Where `H <- Q + A'H (I + G H)^-1 A` leads to from `start`, by doubling the number of its steps; `None` where it leads
/// nowhere.
pub(super) fn doubling(a: &Dense, g: Dense, q: &Dense, start: &Dense) -> Option<Dense> {
    let n = a.nrows();
    // After 2^k steps: `h` from 0, `value` from the start.
    let (mut a, mut g, mut h, mut value) = (a.clone(), g, q.clone(), None::<Dense>);
    for _ in 0..DOUBLINGS {
        let from_start = (Dense::identity(n, n) + &g * start).lu().solve(&a)?;
        let next = &h + symmetric(a.transpose() * start * from_start);
        if !next.iter().all(|v| v.is_finite()) {
            return None;
        }
        if value.is_some_and(|value| (&next - value).norm() <= 1e-15 * next.norm()) {
            return Some(next);
        }
        value = Some(next);
        let lu = (Dense::identity(n, n) + &g * &h).lu();
        let (a_next, g_next) = (lu.solve(&a)?, lu.solve(&g)?);
        h += symmetric(a.transpose() * &h * &a_next);
        g += symmetric(&a * g_next * a.transpose());
        a = &a * a_next;
    }
    value.filter(|_| start.norm() > 0.0)
}
