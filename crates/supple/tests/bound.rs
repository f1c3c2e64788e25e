//! The least directed information: pinned numbers, certificates, edges, and the sensors that attain it.

use supple::Matrices;
use supple::bound::{BoundSettings, Horizon, Stationary, minimum_information, stationary_minimum};

const A: [[f64; 4]; 4] =
    [[0.12, 0.63, -0.52, 0.33], [0.26, -1.28, 1.57, 1.13], [-1.77, -0.30, 0.77, 0.25], [-0.16, 0.20, -0.58, 0.56]];
const B: [[f64; 4]; 4] =
    [[0.66, -0.58, 0.03, -0.20], [2.61, -0.91, 0.87, -0.07], [-0.64, -1.12, -0.19, 0.61], [0.93, 0.58, -1.18, -1.21]];
const W: [[f64; 4]; 4] =
    [[4.94, -0.10, 1.29, 0.35], [-0.10, 5.55, 2.07, 0.31], [1.29, 2.07, 2.02, 1.43], [0.35, 0.31, 1.43, 3.10]];

fn matrix(rows: usize, cols: usize, entry: impl Fn(usize, usize) -> f64) -> Matrices {
    let mut out = Matrices::constant(rows, cols);
    for (i, j) in (0..rows).flat_map(|i| (0..cols).map(move |j| (i, j))) {
        out.set(0, i, j, entry(i, j));
    }
    out
}

/// Tanaka's plant with the cost `x+'x+ + u'u` per step: as `1/2 z' L z`, `L = 2 [A B]'[A B] + 2 diag(0, I)`, and
/// `Tr W` more.
fn tanaka() -> (Stationary, f64) {
    let joint = |i: usize, j: usize| if j < 4 { A[i][j] } else { B[i][j - 4] };
    let cost = |a: usize, b: usize| {
        let known: f64 = (0..4).map(|k| joint(k, a) * joint(k, b)).sum();
        2.0 * (known + if a == b && a >= 4 { 1.0 } else { 0.0 })
    };
    let system = Stationary::new(&matrix(4, 8, joint), &matrix(4, 4, |i, j| W[i][j]), &matrix(8, 8, cost)).unwrap();
    (system, (0..4).map(|i| W[i][i]).sum())
}

const BITS: f64 = std::f64::consts::LN_2;

#[test]
fn tanaka_stationary() {
    let (system, known) = tanaka();
    assert!((system.base_cost + known - 31.48334).abs() < 1e-5, "{}", system.base_cost + known);
    let pinned = [
        (33.0, 6.1727),
        (35.0, 4.5742),
        (40.0, 3.2719),
        (50.0, 2.3595),
        (60.0, 1.9437),
        (80.0, 1.6031),
        (100.0, 1.4631),
        (200.0, 1.2770),
        (1000.0, 1.1861),
    ];
    for (cost, bits) in pinned {
        let found = stationary_minimum(&system, cost - known, &BoundSettings::default()).unwrap();
        println!(
            "{cost} {} gap {:e} rank {} it {}",
            found.nats / BITS,
            found.nats - found.lower_nats,
            found.virtual_sensor().rank,
            found.iterations
        );
        assert!((found.nats / BITS - bits).abs() < 2e-4 && found.nats - found.lower_nats < 1e-6 * BITS);
    }
}

/// The same over a finite horizon that starts from a unit covariance: cost over x_2..x_{T+1} and u_1..u_T.
fn tanaka_horizon(steps: usize) -> Horizon {
    let cost = |a: usize, b: usize| if a == b { 2.0 } else { 0.0 };
    finite(&A, &B, &matrix(4, 4, |i, j| W[i][j]), &matrix(8, 8, cost), steps)
}

/// A horizon of `x+ = A x + B u + w` from a unit covariance, with the cost `1/2 (x+, u)' L (x+, u)` per step.
fn finite<const N: usize>(a: &[[f64; N]; N], b: &[[f64; N]; N], w: &Matrices, l: &Matrices, steps: usize) -> Horizon {
    use nalgebra::DMatrix;
    let dense = |m: &Matrices, r: usize, c: usize| DMatrix::from_fn(N, N, |i, j| m.get(0, r + i, c + j));
    let (a, b) = (DMatrix::from_fn(N, N, |i, j| a[i][j]), DMatrix::from_fn(N, N, |i, j| b[i][j]));
    let (q, r, w_dense) = (dense(l, 0, 0), dense(l, N, N), dense(w, 0, 0));
    let mut prices = Matrices::zeros(steps, N, N);
    let (mut s, mut known) = (DMatrix::zeros(N, N), 0.0);
    for t in (0..steps).rev() {
        let next = &q + s;
        known += 0.5 * (&next * &w_dense).trace();
        let half = b.transpose() * &next * &a;
        let xi = half.transpose() * (&r + b.transpose() * &next * &b).try_inverse().unwrap() * &half;
        s = a.transpose() * &next * &a - &xi;
        for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
            prices.set(t, i, j, 0.25 * (xi[(i, j)] + xi[(j, i)]));
        }
    }
    Horizon {
        dynamics: matrix(N, N, |i, j| a[(i, j)]),
        process: w.clone(),
        initial: matrix(N, N, |i, j| if i == j { 1.0 } else { 0.0 }),
        prices,
        base_cost: known + 0.5 * s.trace(),
    }
}

#[test]
fn tanaka_finite() {
    for (steps, cost, bits) in
        [(10, 40.0, 2.61241), (20, 40.0, 2.93752), (10, 80.0, 1.11315), (20, 80.0, 1.35806), (2, 80.0, 0.0)]
    {
        let found =
            minimum_information(&tanaka_horizon(steps), cost * steps as f64, &BoundSettings::default()).unwrap();
        let gap = (found.nats - found.lower_nats) / BITS / steps as f64;
        println!("{steps} {cost} {} gap {gap:e} it {}", found.nats / BITS / steps as f64, found.iterations);
        assert!((found.nats / BITS / steps as f64 - bits).abs() < 2e-4 && gap < 1e-6);
    }
}
