//! Horizons to bound.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

use nalgebra::DMatrix;
use serde_json::Value as Json;
use supple::Matrices;
use supple::bound::{Horizon, Stationary};

/// One matrix that stands at every step.
pub fn matrix(rows: usize, cols: usize, entry: impl Fn(usize, usize) -> f64) -> Matrices {
    let mut out = Matrices::constant(rows, cols);
    for (i, j) in (0..rows).flat_map(|i| (0..cols).map(move |j| (i, j))) {
        out.set(0, i, j, entry(i, j));
    }
    out
}

/// A sequence of matrices.
pub fn sequence(of: &[DMatrix<f64>]) -> Matrices {
    let mut out = Matrices::zeros(of.len(), of[0].nrows(), of[0].ncols());
    for (t, m) in of.iter().enumerate() {
        for (i, j) in (0..m.nrows()).flat_map(|i| (0..m.ncols()).map(move |j| (i, j))) {
            out.set(t, i, j, m[(i, j)]);
        }
    }
    out
}

/// Matrix `t` of a sequence.
pub fn dense(of: &Matrices, t: usize) -> DMatrix<f64> {
    DMatrix::from_fn(of.rows(), of.cols(), |i, j| of.get(t, i, j))
}

/// A horizon from JSON: `dynamics`, `process`, `prices` (T, n, n) and `initial` (n, n).
pub fn horizon_of(case: &Json) -> Horizon {
    let numbers = |m: &Json| -> DMatrix<f64> {
        let rows: Vec<Vec<f64>> = serde_json::from_value(m.clone()).unwrap();
        DMatrix::from_fn(rows.len(), rows.len(), |i, j| rows[i][j])
    };
    let all = |key: &str| sequence(&case[key].as_array().unwrap().iter().map(numbers).collect::<Vec<_>>());
    let initial = sequence(&[numbers(&case["initial"])]);
    Horizon { dynamics: all("dynamics"), process: all("process"), initial, prices: all("prices"), base_cost: 0.0 }
}

/// `A` of Tanaka's plant, rounded to two decimals as printed.
pub const A: [[f64; 4]; 4] =
    [[0.12, 0.63, -0.52, 0.33], [0.26, -1.28, 1.57, 1.13], [-1.77, -0.30, 0.77, 0.25], [-0.16, 0.20, -0.58, 0.56]];
/// `B`.
pub const B: [[f64; 4]; 4] =
    [[0.66, -0.58, 0.03, -0.20], [2.61, -0.91, 0.87, -0.07], [-0.64, -1.12, -0.19, 0.61], [0.93, 0.58, -1.18, -1.21]];
/// `W`.
pub const W: [[f64; 4]; 4] =
    [[4.94, -0.10, 1.29, 0.35], [-0.10, 5.55, 2.07, 0.31], [1.29, 2.07, 2.02, 1.43], [0.35, 0.31, 1.43, 3.10]];

/// Tanaka's plant with the cost `x+'x+ + u'u` per step: as `1/2 z' L z`, `L = 2 [A B]'[A B] + 2 diag(0, I)`, and
/// `Tr W` more.
pub fn tanaka() -> (Stationary, f64) {
    let joint = |i: usize, j: usize| if j < 4 { A[i][j] } else { B[i][j - 4] };
    let cost = |a: usize, b: usize| {
        let known: f64 = (0..4).map(|k| joint(k, a) * joint(k, b)).sum();
        2.0 * (known + if a == b && a >= 4 { 1.0 } else { 0.0 })
    };
    let system = Stationary::new(&matrix(4, 8, joint), &matrix(4, 4, |i, j| W[i][j]), &matrix(8, 8, cost)).unwrap();
    (system, (0..4).map(|i| W[i][i]).sum())
}

/// Tanaka's plant over a finite horizon that starts from a unit covariance, with the cost `x+'x+ + u'u` per step, and the
/// gains of its regulator.
pub fn tanaka_horizon(steps: usize) -> (Horizon, Vec<DMatrix<f64>>) {
    let of = |m: &[[f64; 4]; 4]| DMatrix::from_fn(4, 4, |i, j| m[i][j]);
    finite(&of(&A), &of(&B), &of(&W), steps)
}

/// A horizon of `x+ = A x + B u + w` from a unit covariance, with the cost `x+'x+ + u'u` per step, and gains `u = K x`.
pub fn finite(a: &DMatrix<f64>, b: &DMatrix<f64>, w: &DMatrix<f64>, steps: usize) -> (Horizon, Vec<DMatrix<f64>>) {
    let (n, m) = (a.nrows(), b.ncols());
    let (mut s, mut known) = (DMatrix::zeros(n, n), 0.0);
    let (mut prices, mut gains) = (Vec::new(), Vec::new());
    for _ in 0..steps {
        let next = DMatrix::identity(n, n) + s;
        known += (&next * w).trace();
        let (half, whole) = (b.transpose() * &next * a, DMatrix::identity(m, m) + b.transpose() * &next * b);
        let gain = -whole.try_inverse().unwrap() * &half;
        let price = -half.transpose() * &gain;
        s = a.transpose() * &next * a - &price;
        prices.push((&price + price.transpose()) * 0.5);
        gains.push(gain);
    }
    prices.reverse();
    gains.reverse();
    let horizon = Horizon {
        dynamics: matrix(n, n, |i, j| a[(i, j)]),
        process: matrix(n, n, |i, j| w[(i, j)]),
        initial: matrix(n, n, |i, j| if i == j { 1.0 } else { 0.0 }),
        prices: sequence(&prices),
        base_cost: known + s.trace(),
    };
    (horizon, gains)
}
