use nalgebra::DMatrix;
use supple_kernels::rows;

/// Replaces a symmetric matrix that rounding made indefinite by the nearest positive semidefinite one; returns whether
/// this was necessary.
///
/// The test is an LDL' factorisation in which a pivot up to 1e-13 of its diagonal entry counts as zero; the column below
/// it must vanish to the square root of that.
///
/// ```
/// // Its eigenvalues are 3 and -1.
/// let mut indefinite = [1.0, 2.0, 2.0, 1.0];
/// assert!(supple_lqg::mend(&mut indefinite, 2, 2));
/// assert!((indefinite[0] - 1.5).abs() < 1e-12);
/// ```
#[inline]
pub fn mend(a: &mut [f64], n: usize, stride: usize) -> bool {
    if is_semidefinite(a, n, stride) {
        return false;
    }
    project(a, n, stride);
    true
}

/// The largest order whose factor is kept on the stack.
const ORDER: usize = 32;

fn is_semidefinite(a: &[f64], n: usize, stride: usize) -> bool {
    if n > ORDER {
        return is_large_semidefinite(a, n, stride);
    }
    let mut lower = [[0.0; ORDER]; ORDER];
    let mut pivots = [0.0; ORDER];
    for j in 0..n {
        for i in j..n {
            let mut sum = a[i * stride + j];
            for k in 0..j {
                sum -= lower[i][k] * lower[j][k] * pivots[k];
            }
            lower[i][j] = sum;
        }
        let (pivot, scale) = (lower[j][j], a[j * stride + j]);
        if pivot < -1e-13 * scale.abs() || scale < 0.0 || pivot.is_nan() {
            return false;
        }
        // A pivot that is zero up to rounding leaves a column of rounding errors.
        let vanishes = pivot <= 1e-13 * scale;
        // With a floor for variances that have all but underflowed.
        let bound = |i: usize| (1e-6 * (scale * a[i * stride + i].abs()).sqrt()).max(1e-150);
        if vanishes && (j + 1..n).any(|i| lower[i][j].abs() > bound(i)) {
            return false;
        }
        pivots[j] = if vanishes { 0.0 } else { pivot };
        for row in lower.iter_mut().take(n).skip(j) {
            row[j] = if vanishes { 0.0 } else { row[j] / pivot };
        }
    }
    true
}

/// Decides by eigenvalues, after a Cholesky factorisation of the matrix with a slightly larger diagonal has failed.
fn is_large_semidefinite(a: &[f64], n: usize, stride: usize) -> bool {
    let mut factor = a[..n * stride].to_vec();
    for i in 0..n {
        // A variance of 0 implies a row of zeros.
        factor[i * stride + i] += (1e-13 * a[i * stride + i]).max(f64::MIN_POSITIVE);
    }
    if rows::cholesky(&mut factor, n, stride).is_ok() {
        return true;
    }
    let eigenvalues = DMatrix::from_fn(n, n, |i, j| a[i * stride + j]).symmetric_eigenvalues();
    eigenvalues.min() >= -1e-13 * eigenvalues.max().abs()
}

#[cold]
fn project(a: &mut [f64], n: usize, stride: usize) {
    let eigen = DMatrix::from_fn(n, n, |i, j| a[i * stride + j]).symmetric_eigen();
    let kept = eigen.eigenvalues.map(|value| value.max(0.0));
    let nearest = &eigen.eigenvectors * DMatrix::from_diagonal(&kept) * eigen.eigenvectors.transpose();
    for i in 0..n {
        for j in 0..n {
            a[i * stride + j] = 0.5 * (nearest[(i, j)] + nearest[(j, i)]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_semidefinite_matrices_and_mends_others() {
        let mut singular = [1.0, 2.0, 2.0, 4.0];
        assert!(!mend(&mut singular, 2, 2));
        let mut zero = [0.0; 4];
        assert!(!mend(&mut zero, 2, 2));
        let mut hollow = [0.0, 1.0, 1.0, 0.0];
        assert!(mend(&mut hollow, 2, 2));
        let mut indefinite = [1.0, 2.0, 2.0, 1.0];
        assert!(mend(&mut indefinite, 2, 2));
        assert!(is_semidefinite(&indefinite, 2, 2));
        assert!((indefinite[0] - 1.5).abs() < 1e-12, "the eigenvalue -1 is cut off");
    }
}
