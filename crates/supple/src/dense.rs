//! Small dense matrices, where clarity counts for more than speed.

use nalgebra::{DMatrix, SymmetricEigen};
use supple_kernels::Matrices;

/// A small dense matrix.
pub(crate) type Dense = DMatrix<f64>;

/// Matrix `index` of a sequence.
pub(crate) fn dense(matrices: &Matrices, index: usize) -> Dense {
    Dense::from_fn(matrices.rows(), matrices.cols(), |i, j| matrices.get(index, i, j))
}

/// Writes `from` as matrix `index` of a sequence.
pub(crate) fn store(to: &mut Matrices, index: usize, from: &Dense) {
    for (i, j) in (0..from.nrows()).flat_map(|i| (0..from.ncols()).map(move |j| (i, j))) {
        to.set(index, i, j, from[(i, j)]);
    }
}

/// `(a + a') / 2`.
pub(crate) fn symmetric(mut a: Dense) -> Dense {
    for i in 1..a.nrows() {
        for j in 0..i {
            let mean = 0.5 * (a[(i, j)] + a[(j, i)]);
            (a[(i, j)], a[(j, i)]) = (mean, mean);
        }
    }
    a
}

/// `a p a'`, symmetric.
pub(crate) fn congruence(a: &Dense, p: &Dense) -> Dense {
    symmetric(a * p * a.transpose())
}

/// The lower Cholesky factor; `None` where `a` is not positive definite.
pub(crate) fn cholesky(a: &Dense) -> Option<Dense> {
    let n = a.nrows();
    let mut g = Dense::zeros(n, n);
    for j in 0..n {
        let mut pivot = a[(j, j)];
        for k in 0..j {
            pivot -= g[(j, k)] * g[(j, k)];
        }
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        let root = pivot.sqrt();
        g[(j, j)] = root;
        for i in j + 1..n {
            let mut sum = a[(i, j)];
            for k in 0..j {
                sum -= g[(i, k)] * g[(j, k)];
            }
            g[(i, j)] = sum / root;
        }
    }
    Some(g)
}

/// `g^-1 b` for a lower triangular `g` without zeros on its diagonal.
pub(crate) fn solve_lower(g: &Dense, mut b: Dense) -> Dense {
    let n = g.nrows();
    for mut column in b.column_iter_mut() {
        for i in 0..n {
            let mut sum = column[i];
            for k in 0..i {
                sum -= g[(i, k)] * column[k];
            }
            column[i] = sum / g[(i, i)];
        }
    }
    b
}

/// `g^-1` of a lower triangular `g`.
pub(crate) fn inverse_lower(g: &Dense) -> Dense {
    solve_lower(g, Dense::identity(g.nrows(), g.nrows()))
}

/// `log |g g'|` of a lower triangular `g`.
pub(crate) fn log_determinant(g: &Dense) -> f64 {
    2.0 * (0..g.nrows()).map(|i| g[(i, i)].ln()).sum::<f64>()
}

/// The least eigenvalue of a symmetric matrix; infinite for one of order 0.
pub(crate) fn least_eigenvalue(a: Dense) -> f64 {
    match a.nrows() {
        0 => f64::INFINITY,
        1 => a[(0, 0)],
        _ => a.symmetric_eigenvalues().min(),
    }
}

/// Eigenvalues and eigenvectors of a symmetric matrix; `None` where it is not finite.
pub(crate) fn eigen(a: Dense) -> Option<SymmetricEigen<f64, nalgebra::Dyn>> {
    if !a.iter().all(|v| v.is_finite()) {
        return None;
    }
    if a.is_empty() {
        return Some(SymmetricEigen { eigenvectors: a, eigenvalues: nalgebra::DVector::zeros(0) });
    }
    SymmetricEigen::try_new(a, f64::EPSILON, 10_000)
}

/// `f` of rank columns with `f f' = a`, for a symmetric positive semidefinite `a`: by eigenvalues once every row has
/// been scaled to a variance of 1, so that units do not matter. What is below rounding counts as 0.
///
/// `None` where `a` is not positive semidefinite, not symmetric or not finite.
pub(crate) fn semidefinite_root(a: &Dense) -> Option<Dense> {
    let n = a.nrows();
    let deviation: Vec<f64> = (0..n).map(|i| a[(i, i)].max(0.0).sqrt()).collect();
    let by = |i: usize| if deviation[i] > 0.0 { 1.0 / deviation[i] } else { 0.0 };
    for (i, j) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))) {
        let (here, there, scale) = (a[(i, j)], a[(j, i)], deviation[i] * deviation[j]);
        let fits = (here - there).abs() <= 1e-9 * scale && here.abs() <= (1.0 + 1e-9) * scale;
        if !(here.is_finite() && there.is_finite() && fits) {
            return None;
        }
    }
    let correlations = symmetric(Dense::from_fn(n, n, |i, j| a[(i, j)] * by(i) * by(j)));
    let found = eigen(correlations)?;
    let threshold = 16.0 * n as f64 * f64::EPSILON;
    if found.eigenvalues.iter().any(|&v| v < -1e-9) {
        return None;
    }
    let kept: Vec<usize> = (0..n).filter(|&k| found.eigenvalues[k] > threshold).collect();
    Some(Dense::from_fn(n, kept.len(), |i, k| {
        deviation[i] * found.eigenvectors[(i, kept[k])] * found.eigenvalues[kept[k]].sqrt()
    }))
}
