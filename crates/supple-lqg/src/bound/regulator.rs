//! The optimal regulator of a system that does not change: the Riccati equation by doubling.

use supple_kernels::Matrices;

use super::horizon::Stationary;
use super::subspace::{complement, seen_states};
use super::units::scales;
use super::zeros::{free_motions, moduli};
use crate::Error;
use crate::dense::{Dense, cholesky, congruence, dense, eigen, semidefinite_root, store, symmetric};

/// Eigenvalues of prices of control below this, with a diagonal of 1, count as 0.
const CONTROL_TOLERANCE: f64 = 1e-11;

/// How far inside of the unit circle the modes of a closed loop must be.
const SETTLED: f64 = 1e-8;

/// Directions cost something whose share of the dearest one's cost is above this.
const COSTS: f64 = 1e-9;

/// Doublings after which a Riccati equation counts as without a solution.
const DOUBLINGS: usize = 60;

/// How far what doubling and steps lead to may be apart, relatively.
const AGREED: f64 = 1e-6;

/// Steps from 0 at most, and what all of them may cost: cubes of the number of states.
const MOST_STEPS: usize = 2000;
const STEPS_WORK: usize = 1_000_000;

/// Steps have reached their limit when one changes it by less than this, relatively.
const STEADY: f64 = 1e-14;

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
    let (n, m) = (a.nrows(), b.ncols());
    let unsolved = || Error::NoBound {
        what: "no regulator achieves a finite expected cost per step".into(),
        advice: "let the controls act on every unstable state that costs something",
    };
    let units = Units::of(a, b, l);
    let scaled = Quadratic {
        a: Dense::from_fn(n, n, |i, j| a[(i, j)] / units.states[i] * units.states[j]),
        b: Dense::from_fn(n, m, |i, j| b[(i, j)] / units.states[i] * units.controls[j]),
        l: symmetric(Dense::from_fn(n + m, n + m, |i, j| l[(i, j)] * units.joint(i) * units.joint(j) / units.cost)),
    };
    let s = match (scaled.least(), scaled.by_steps()) {
        // Rounding may take a direction of the controls for free that is not, or the other way round.
        (Some(found), Some(steps)) if (&found - &steps).norm() > AGREED * steps.norm() => steps,
        (found, steps) => found.or(steps).ok_or_else(unsolved)?,
    };
    let mut xi = scaled.value_of_information(&s).ok_or_else(unsolved)?;
    // What no control can answer costs the same whether it is known or not: exactly, whatever the rounding.
    let seen = seen_states(a, |i| (0..n + m).any(|k| l[(i, k)] != 0.0));
    let answered = |j: usize| (n..n + m).any(|k| l[(j, k)] != 0.0) || (0..n).any(|i| seen[i] && a[(i, j)] != 0.0);
    for j in (0..n).filter(|&j| !answered(j)) {
        xi.row_mut(j).fill(0.0);
        xi.column_mut(j).fill(0.0);
    }
    let back =
        |x: Dense| symmetric(Dense::from_fn(n, n, |i, j| x[(i, j)] * units.cost / units.states[i] / units.states[j]));
    Ok((back(s), back(xi)))
}

/// How large states, controls and cost are.
struct Units {
    states: Vec<f64>,
    controls: Vec<f64>,
    cost: f64,
}

impl Units {
    fn of(a: &Dense, b: &Dense, l: &Dense) -> Self {
        let (n, m) = (a.nrows(), b.ncols());
        let reached = Dense::from_fn(n, m, |i, j| {
            let size = b.column(j).norm();
            if size > 0.0 { b[(i, j)] / size } else { 0.0 }
        });
        let states = scales(a, &(&reached * reached.transpose()));
        let of_states = (0..n).map(|i| l[(i, i)] * states[i] * states[i]).fold(0.0, f64::max);
        let largest = (0..m).map(|j| l[(n + j, n + j)]).fold(0.0, f64::max);
        let cost = if of_states > 0.0 { of_states } else { largest.max(f64::MIN_POSITIVE) };
        let controls = (0..m).map(|j| {
            let moved: f64 = (0..n).map(|i| (b[(i, j)] / states[i]).powi(2)).sum();
            let size = (moved + l[(n + j, n + j)] / cost).sqrt();
            if size > 0.0 { 1.0 / size } else { 1.0 }
        });
        let controls = controls.collect();
        Self { states, controls, cost }
    }

    fn joint(&self, i: usize) -> f64 {
        let n = self.states.len();
        if i < n { self.states[i] } else { self.controls[i - n] }
    }
}

/// A linear system with a quadratic cost, `1/2 z' L z` per step of `z = (x, u)`.
struct Quadratic {
    a: Dense,
    b: Dense,
    l: Dense,
}

/// `L + [A B]' S [A B]` in blocks.
struct Hamiltonian {
    xx: Dense,
    ux: Dense,
    uu: Dense,
}

impl Quadratic {
    /// The least solution of its Riccati equation: that which steps from 0 lead to.
    fn least(&self) -> Option<Dense> {
        let (n, m) = (self.a.nrows(), self.b.ncols());
        let free = free_motions(&self.a, &self.b, &self.l);
        let basis = complement(&free);
        let order = basis.ncols();
        let mut wide = Dense::zeros(n + m, order + m);
        wide.view_mut((0, 0), (n, order)).copy_from(&basis);
        wide.view_mut((n, order), (m, m)).fill_with_identity();
        let seen = Self {
            a: basis.transpose() * &self.a * &basis,
            b: basis.transpose() * &self.b,
            l: congruence(&wide.transpose(), &self.l),
        };
        let found = seen.least_of_seen()?;
        let s = congruence(&basis, &found);
        let residual = (self.back(&s)? - &s).norm();
        (residual.is_finite() && residual <= 1e-7 * s.norm().max(f64::MIN_POSITIVE)).then_some(s)
    }

    /// The limit of steps from 0, where few of them reach it; none where they do not.
    fn by_steps(&self) -> Option<Dense> {
        let n = self.a.nrows();
        let most = (STEPS_WORK / (n * n * n).max(1)).min(MOST_STEPS);
        let mut s = Dense::zeros(n, n);
        for _ in 0..most {
            let next = self.back(&s)?;
            let change = (&next - &s).norm();
            s = next;
            if !change.is_finite() || change <= STEADY * s.norm() {
                return change.is_finite().then_some(s);
            }
        }
        None
    }

    /// The same where nothing moves for ever at no cost. Steps from 0 until every control has its price, then doubling
    /// from there: what is left is of a Riccati equation whose price of control is positive definite, whatever R is.
    fn least_of_seen(&self) -> Option<Dense> {
        let n = self.a.nrows();
        let mut s = Dense::zeros(n, n);
        if n == 0 {
            return Some(s);
        }
        if cholesky(&self.hamiltonian(&s).uu).is_none() {
            for _ in 0..n {
                s = self.back(&s)?;
            }
        }
        let h = self.hamiltonian(&s);
        // Controls that never cost nor move what costs are left out.
        let half = whitened(&h.uu)?;
        let (to_u, to_x) = (&self.b * &half, half.transpose() * &h.ux);
        let a_free = &self.a - &to_u * &to_x;
        let q_free = symmetric(&h.xx - to_x.transpose() * &to_x - &s);
        let none = Dense::zeros(n, n);
        let found = doubling(&a_free, symmetric(&to_u * to_u.transpose()), &q_free, &none, s.norm())?;
        let s = symmetric(s + found);
        self.is_settled(&s)?.then_some(s)
    }

    /// Whether what costs dies out in closed loop: where it does not, the cost grows without limit.
    fn is_settled(&self, s: &Dense) -> Option<bool> {
        let h = self.hamiltonian(s);
        let half = whitened(&h.uu)?;
        let closed = &self.a - &self.b * &half * (half.transpose() * &h.ux);
        let found = eigen(s.clone())?;
        let least = COSTS * found.eigenvalues.iter().fold(0.0f64, |a, &b| a.max(b));
        let kept: Vec<usize> = (0..s.nrows()).filter(|&k| found.eigenvalues[k] > least).collect();
        let basis = found.eigenvectors.select_columns(&kept);
        let closed = basis.transpose() * closed * basis;
        Some(moduli(&closed)?.into_iter().all(|modulus| modulus < 1.0 - SETTLED))
    }

    fn hamiltonian(&self, s: &Dense) -> Hamiltonian {
        let (n, m) = (self.a.nrows(), self.b.ncols());
        let moved = s * &self.b;
        Hamiltonian {
            xx: symmetric(self.l.view((0, 0), (n, n)) + self.a.transpose() * s * &self.a),
            ux: self.l.view((n, 0), (m, n)) + moved.transpose() * &self.a,
            uu: symmetric(self.l.view((n, n), (m, m)) + self.b.transpose() * &moved),
        }
    }

    /// One step of the Riccati equation.
    fn back(&self, s: &Dense) -> Option<Dense> {
        let h = self.hamiltonian(s);
        let half = whitened(&h.uu)?.transpose() * &h.ux;
        Some(symmetric(h.xx - half.transpose() * half))
    }

    /// `Xi = K' Q_uu K`.
    fn value_of_information(&self, s: &Dense) -> Option<Dense> {
        let h = self.hamiltonian(s);
        let half = whitened(&h.uu)?.transpose() * &h.ux;
        Some(symmetric(half.transpose() * half))
    }
}

/// `F` with `F F' = a^+`: eigenvalues below the tolerance count as 0.
fn whitened(a: &Dense) -> Option<Dense> {
    let n = a.nrows();
    let by: Vec<f64> = (0..n).map(|i| if a[(i, i)] > 0.0 { 1.0 / a[(i, i)].sqrt() } else { 0.0 }).collect();
    let found = eigen(symmetric(Dense::from_fn(n, n, |i, j| a[(i, j)] * by[i] * by[j])))?;
    let kept: Vec<usize> = (0..n).filter(|&k| found.eigenvalues[k] > CONTROL_TOLERANCE).collect();
    Some(Dense::from_fn(n, kept.len(), |i, k| {
        by[i] * found.eigenvectors[(i, kept[k])] / found.eigenvalues[kept[k]].sqrt()
    }))
}

/// Where `H <- Q + A'H (I + G H)^-1 A` leads to from `start`, by doubling the number of its steps; `None` where it
/// leads nowhere. What rounding leaves of a matrix of the size `beside` does not count.
pub(super) fn doubling(a: &Dense, g: Dense, q: &Dense, start: &Dense, beside: f64) -> Option<Dense> {
    let n = a.nrows();
    // After 2^k steps: `h` from 0, `value` from the start.
    let (mut a, mut g, mut h, mut value) = (a.clone(), g, q.clone(), None::<Dense>);
    for _ in 0..DOUBLINGS {
        let from_start = (Dense::identity(n, n) + &g * start).lu().solve(&a)?;
        let next = &h + symmetric(a.transpose() * start * from_start);
        if !next.iter().all(|v| v.is_finite()) {
            return None;
        }
        if value.is_some_and(|value| (&next - value).norm() <= 1e-15 * (next.norm() + beside)) {
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
