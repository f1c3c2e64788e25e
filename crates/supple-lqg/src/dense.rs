//! Small dense matrices, where clarity counts for more than speed.

use nalgebra::{Complex, DMatrix, DVector, Schur, SymmetricEigen};
use supple_kernels::Matrices;
use supple_kernels::math;

/// A small dense matrix.
pub type Dense = DMatrix<f64>;

/// Matrix `index` of a sequence.
#[must_use]
pub fn dense(matrices: &Matrices, index: usize) -> Dense {
    Dense::from_fn(matrices.rows(), matrices.cols(), |i, j| matrices.get(index, i, j))
}

/// Whether all numbers are finite.
pub(crate) fn are_finite(numbers: &[f64]) -> bool {
    // Without an early end, so that it is done on vectors.
    numbers.iter().fold(true, |finite, number| finite & number.is_finite())
}

/// Writes `from` as matrix `index` of a sequence.
pub fn store(to: &mut Matrices, index: usize, from: &Dense) {
    for (i, j) in (0..from.nrows()).flat_map(|i| (0..from.ncols()).map(move |j| (i, j))) {
        to.set(index, i, j, from[(i, j)]);
    }
}

/// A square matrix from padded rows.
#[must_use]
pub fn of_rows(rows: &[f64], n: usize, stride: usize) -> Dense {
    Dense::from_fn(n, n, |i, j| rows[i * stride + j])
}

/// A factor of `G G' + H H'`, with at most as many columns as rows.
#[must_use]
pub fn beside(g: Dense, h: &Dense) -> Dense {
    let (n, left) = (g.nrows(), g.ncols());
    let mut both = g.resize_horizontally(left + h.ncols(), 0.0);
    both.columns_mut(left, h.ncols()).copy_from(h);
    if both.ncols() > n { both.transpose().qr().r().transpose() } else { both }
}

/// `(a + a') / 2`.
#[must_use]
pub fn symmetric(mut a: Dense) -> Dense {
    for i in 1..a.nrows() {
        for j in 0..i {
            let mean = 0.5 * (a[(i, j)] + a[(j, i)]);
            (a[(i, j)], a[(j, i)]) = (mean, mean);
        }
    }
    a
}

/// `a p a'`, symmetric.
#[must_use]
pub fn congruence(a: &Dense, p: &Dense) -> Dense {
    symmetric(a * p * a.transpose())
}

/// The covariance after measurements `c x` with noise `v` and any gain, in Joseph's form `(I - K C) P (I - K C)' + K V K'`.
#[must_use]
pub fn joseph(predicted: &Dense, c: &Dense, v: &Dense, gain: &Dense) -> Dense {
    let kept = Dense::identity(predicted.nrows(), predicted.nrows()) - gain * c;
    symmetric(&kept * predicted * kept.transpose() + gain * v * gain.transpose())
}

/// The lower Cholesky factor; `None` where `a` is not positive definite.
#[must_use]
pub fn cholesky(a: &Dense) -> Option<Dense> {
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
#[must_use]
pub fn solve_lower(g: &Dense, mut b: Dense) -> Dense {
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
#[must_use]
pub fn inverse_lower(g: &Dense) -> Dense {
    solve_lower(g, Dense::identity(g.nrows(), g.nrows()))
}

/// `log |g g'|` of a lower triangular `g`.
#[must_use]
pub fn log_determinant(g: &Dense) -> f64 {
    2.0 * (0..g.nrows()).map(|i| math::ln(g[(i, i)])).sum::<f64>()
}

/// The least eigenvalue of a symmetric matrix; infinite for one of order 0.
#[must_use]
pub fn least_eigenvalue(a: Dense) -> f64 {
    match a.nrows() {
        0 => f64::INFINITY,
        1 => a[(0, 0)],
        // If the iteration fails, the matrix must not appear positive definite.
        _ => eigen(a).map_or(f64::NEG_INFINITY, |found| found.eigenvalues.min()),
    }
}

/// Eigenvalues and eigenvectors of a symmetric matrix; `None` where it is not finite.
#[must_use]
pub fn eigen(a: Dense) -> Option<SymmetricEigen<f64, nalgebra::Dyn>> {
    if !a.iter().all(|v| v.is_finite()) {
        return None;
    }
    if a.is_empty() {
        return Some(SymmetricEigen { eigenvectors: a, eigenvalues: nalgebra::DVector::zeros(0) });
    }
    SymmetricEigen::try_new(a, f64::EPSILON, 10_000)
}

/// Iterations for eigenvalues at most.
const EIGENVALUE_ITERATIONS: usize = 10_000;

/// The eigenvalues of a square matrix; `None` where they are not found or the matrix is not finite.
#[must_use]
pub fn eigenvalues(a: &Dense) -> Option<Vec<Complex<f64>>> {
    if a.is_empty() {
        return Some(Vec::new());
    }
    if !a.iter().all(|v| v.is_finite()) {
        return None;
    }
    // The iteration stalls at matrices such as cyclic permutations, but not after a rotation.
    let n = a.nrows();
    let axis = DVector::from_fn(n, |i, _| 1.0 + (i as f64 + 1.0).sqrt()).normalize();
    let reflection = Dense::identity(n, n) - 2.0 * &axis * axis.transpose();
    let turned = std::iter::successors(Some(a.clone()), |matrix| Some(&reflection * matrix * &reflection));
    let schur = turned.take(4).find_map(|matrix| Schur::try_new(matrix, f64::EPSILON, EIGENVALUE_ITERATIONS))?;
    Some(schur.complex_eigenvalues().iter().copied().collect())
}

/// A singular value decomposition `a = u diag(values) v'`: as many values as `a` has rows or columns, the greatest first,
/// and a column of `u` and of `v` for each; one of the two is 0 if the value is 0.
pub struct Svd {
    pub u: Dense,
    pub values: Vec<f64>,
    pub v: Dense,
}

/// Rounds of rotations at most; some six are enough.
const SWEEPS: usize = 60;

/// Columns count as orthogonal when the cosine of their angle is at most this.
const ORTHOGONAL: f64 = 1e-15;

/// By one-sided Jacobi rotations. nalgebra's own decomposition returns wrong values and vectors for some nearly
/// singular matrices (its issue 1172).
#[must_use]
pub fn svd(a: &Dense) -> Svd {
    if a.ncols() > a.nrows() {
        let Svd { u, values, v } = svd(&a.transpose());
        return Svd { u: v, values, v: u };
    }
    let n = a.ncols();
    let size = a.amax();
    let unit = if size > 0.0 && size.is_finite() { size } else { 1.0 };
    let (mut columns, mut v) = (a / unit, Dense::identity(n, n));
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for (i, j) in (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))) {
            let (one, other) = (columns.column(i), columns.column(j));
            let (p, q, g) = (one.norm_squared(), other.norm_squared(), one.dot(&other));
            if g.abs() <= ORTHOGONAL * p.sqrt() * q.sqrt() {
                continue;
            }
            rotated = true;
            let ratio = (q - p) / (2.0 * g);
            let tangent = ratio.signum() / (ratio.abs() + math::hypot(ratio, 1.0));
            let cosine = math::hypot(tangent, 1.0).recip();
            for turned in [&mut columns, &mut v] {
                turn(turned, i, j, cosine, cosine * tangent);
            }
        }
        if !rotated {
            break;
        }
    }
    let norms: Vec<f64> = columns.column_iter().map(|column| column.norm()).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| norms[j].total_cmp(&norms[i]));
    let share = |i: usize, k: usize| if norms[k] > 0.0 { columns[(i, k)] / norms[k] } else { 0.0 };
    Svd {
        u: Dense::from_fn(a.nrows(), n, |i, k| share(i, order[k])),
        values: order.iter().map(|&k| norms[k] * unit).collect(),
        v: v.select_columns(&order),
    }
}

/// Turns columns `i` and `j` in their plane.
fn turn(a: &mut Dense, i: usize, j: usize, cosine: f64, sine: f64) {
    let (mut one, mut other) = a.columns_range_pair_mut(i..i + 1, j..j + 1);
    for (x, y) in one.iter_mut().zip(other.iter_mut()) {
        (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
    }
}

/// The first `rows` rows and `cols` columns of the first matrix, as a constant sequence.
#[must_use]
pub fn first(matrices: &Matrices, rows: usize, cols: usize) -> Matrices {
    let mut out = Matrices::constant(rows, cols);
    store(&mut out, 0, &dense(matrices, 0).view((0, 0), (rows, cols)).into_owned());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_svd(a: &Dense) {
        let Svd { u, values, v } = svd(a);
        let order = values.len();
        assert_eq!(order, a.nrows().min(a.ncols()));
        assert!(values.windows(2).all(|pair| pair[0] >= pair[1]), "{values:?}");
        let back = Dense::from_fn(u.nrows(), order, |i, k| u[(i, k)] * values[k]) * v.transpose();
        let size = a.norm();
        assert!((back - a).norm() <= 1e-14 * size, "{a}");
        let kept = values.iter().filter(|&&value| value > 1e-13 * size).count();
        for side in [u, v] {
            let side = side.columns(0, kept).into_owned();
            assert!((side.transpose() * &side - Dense::identity(kept, kept)).norm() <= 1e-13, "{a}");
        }
        let total = values.iter().map(|value| value * value).sum::<f64>().sqrt();
        assert!((total - size).abs() <= 1e-14 * size, "{a}");
    }

    /// Low-rank matrices, for which other programs give wrong values; tall, wide, empty, tiny and huge ones.
    #[test]
    fn singular_values_are_those_of_the_matrix() {
        for (rows, cols) in (1..13).flat_map(|rows| (1..13).map(move |cols| (rows, cols))) {
            assert_svd(&Dense::from_element(rows, cols, 1.0));
            for rank in 1..4 {
                let factor = |n: usize, seed: usize| {
                    Dense::from_fn(n, rank, |i, k| ((seed + 7 * i + 3 * k + i * k) as f64).sin())
                };
                for unit in [1.0, 1e-140, 1e140] {
                    assert_svd(&(factor(rows, 1) * factor(cols, 5).transpose() * unit));
                }
            }
        }
        assert_svd(&Dense::from_row_slice(3, 3, &[1.0, 2.0, 2.0, 2.0, -1.0, -1.0, 2.0, 1.0, -1.0]));
        let projector = [
            [-0.000_199_842_202_671_662_86, -0.102_044_558_250_595_73, 0.067_035_618_297_062_81],
            [0.001_247_157_883_522_482_6, 0.636_830_827_480_185_7, -0.418_350_071_798_312],
            [-0.001_083_251_950_671_169_7, -0.553_136_251_015_014_6, 0.363_369_014_722_484_86],
        ];
        assert_svd(&Dense::from_row_slice(3, 3, projector.as_flattened()));
        assert_eq!(svd(&Dense::zeros(3, 0)).values.len(), 0);
        assert_eq!(svd(&Dense::zeros(2, 3)).values, [0.0, 0.0]);
    }
}
