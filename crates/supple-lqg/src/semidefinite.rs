//! Positive semidefinite matrices: the tests of definiteness of the sweeps.
//!
//! Matrices that are given are judged after scaling to a unit diagonal, so that units do not matter: [`refuse_indefinite`]
//! and [`semidefinite_root`]. Computed covariances are judged by their rounding errors, which are relative to their largest
//! entries: [`semidefinite_factor`] and, in the Kalman recursion, [`mend`].

use nalgebra::DMatrix;
use supple_kernels::{Matrices, rows};

use crate::dense::{Dense, are_finite, eigen, symmetric};

/// Checks that a given matrix is positive semidefinite, whatever the units of its rows: [`semidefinite_factor`] of the
/// matrix scaled to a unit diagonal.
///
/// # Errors
/// If it is not: the order of its first leading block that is indefinite.
///
/// ```
/// let indefinite = supple_lqg::constant(&[[1.0, 2.0], [2.0, 1.0]]);
/// assert_eq!(supple_lqg::refuse_indefinite(&indefinite, 0), Err(2));
/// ```
pub fn refuse_indefinite(matrix: &Matrices, index: usize) -> Result<(), usize> {
    let n = matrix.rows();
    let scale: Vec<f64> = (0..n).map(|i| matrix.get(index, i, i).abs().sqrt()).collect();
    let mut scaled = Matrices::zeros(1, n, n);
    for i in 0..n {
        for j in 0..n {
            let (entry, unit) = (matrix.get(index, i, j), scale[i] * scale[j]);
            if unit == 0.0 && entry != 0.0 {
                return Err(i.max(j) + 1);
            }
            scaled.set(0, i, j, if unit > 0.0 { entry / unit } else { 0.0 });
        }
    }
    semidefinite_factor(&scaled, 0).map(drop)
}

/// A factor `G` of one of these matrices, which equals `G G'`; handles singular covariances by zero columns at vanishing
/// pivots of the Cholesky factorisation. Row-major, order x order. Its tolerances are relative to the largest entry, because
/// rounding of a computed covariance is.
///
/// # Errors
/// If the matrix is indefinite: the order of its first leading block that is indefinite.
///
/// ```
/// // A singular covariance: its second column is 0.
/// let factor = supple_lqg::semidefinite_factor(&supple_lqg::constant(&[[4.0, 2.0], [2.0, 1.0]]), 0);
/// assert_eq!(factor, Ok(vec![2.0, 0.0, 1.0, 0.0]));
/// ```
pub fn semidefinite_factor(covariance: &Matrices, index: usize) -> Result<Vec<f64>, usize> {
    let n = covariance.rows();
    let mut factor = vec![0.0; n * n];
    let largest = (0..n).map(|i| covariance.get(index, i, i).abs()).fold(0.0, f64::max);
    for j in 0..n {
        let (above, row) = factor.split_at_mut(j * n);
        for k in 0..j {
            let other = &above[k * n..];
            let rest = covariance.get(index, j, k) - rows::dot(&row[..k], &other[..k]);
            let pivot = other[k];
            row[k] = if pivot > 0.0 { rest / pivot } else { 0.0 };
            if pivot == 0.0 && rest.abs() > 1e-7 * largest {
                return Err(j + 1);
            }
        }
        let scale = covariance.get(index, j, j);
        let pivot = scale - rows::dot(&row[..j], &row[..j]);
        if pivot < -1e-10 * largest || !pivot.is_finite() {
            return Err(j + 1);
        }
        row[j] = if pivot > 1e-14 * scale { pivot.sqrt() } else { 0.0 };
    }
    Ok(factor)
}

/// `f` with `f f' = a` and as many columns as the rank of a symmetric positive semidefinite `a`: by eigenvalues, after rows
/// are scaled to a variance of 1, so that units do not matter. Eigenvalues below rounding count as 0.
///
/// # Errors
/// A message, if `a` is not positive semidefinite, not symmetric or not finite: which of its entries, counted from 0, or
/// which eigenvalue.
pub fn semidefinite_root(a: &Dense) -> Result<Dense, String> {
    let n = a.nrows();
    let deviation: Vec<f64> = (0..n).map(|i| a[(i, i)].max(0.0).sqrt()).collect();
    let by = |i: usize| if deviation[i] > 0.0 { 1.0 / deviation[i] } else { 0.0 };
    for (i, j) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))) {
        let (here, there, scale) = (a[(i, j)], a[(j, i)], deviation[i] * deviation[j]);
        if !(here.is_finite() && there.is_finite()) {
            let ([i, j], entry) = if here.is_finite() { ([j, i], there) } else { ([i, j], here) };
            return Err(format!("entry [{i}][{j}] is {entry:?}"));
        }
        if (here - there).abs() > 1e-9 * scale {
            return Err(format!("entry [{i}][{j}] is {here:?}, and [{j}][{i}] is {there:?}"));
        }
        if here.abs() > (1.0 + 1e-9) * scale {
            let most = format!("greater than the diagonal entries {:?} and {:?} allow", a[(i, i)], a[(j, j)]);
            return Err(format!("entry [{i}][{j}] is {here:?}, {}", if i == j { "below 0" } else { &most }));
        }
    }
    let correlations = symmetric(Dense::from_fn(n, n, |i, j| a[(i, j)] * by(i) * by(j)));
    let found = eigen(correlations).ok_or("its eigenvalues were not found")?;
    let threshold = 16.0 * n as f64 * f64::EPSILON;
    let least = found.eigenvalues.iter().copied().fold(0.0, f64::min);
    if least < -1e-9 {
        return Err(format!("scaled to a diagonal of ones it has the eigenvalue {least:?}"));
    }
    let kept: Vec<usize> = (0..n).filter(|&k| found.eigenvalues[k] > threshold).collect();
    Ok(Dense::from_fn(n, kept.len(), |i, k| {
        deviation[i] * found.eigenvectors[(i, kept[k])] * found.eigenvalues[kept[k]].sqrt()
    }))
}

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
    // Numbers that are not finite have no eigenvalues; the sweep finds them at its end.
    if (0..n).any(|i| !are_finite(&a[i * stride..i * stride + n])) {
        return;
    }
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

    #[test]
    fn indefinite_matrices_are_found_in_any_units() {
        let check = |rows: [[f64; 3]; 3], units: [f64; 3]| {
            let mut matrix = Matrices::zeros(1, 3, 3);
            for i in 0..3 {
                for j in 0..3 {
                    matrix.set(0, i, j, units[i] * rows[i][j] * units[j]);
                }
            }
            refuse_indefinite(&matrix, 0)
        };
        for units in [[1.0; 3], [1e6, 1.0, 1.0], [1e-9, 1.0, 1e9], [1.0, 1e100, 1e-100]] {
            assert_eq!(check([[1.0, 0.0, 0.0], [0.0, 1.0, 2.0], [0.0, 2.0, 1.0]], units), Err(3));
            assert_eq!(check([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]], units), Err(2));
            assert_eq!(check([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0]], units), Err(3));
            // Singular, and that by rounding too.
            assert_eq!(check([[1.0, 0.1, 0.3], [0.1, 0.01, 0.03], [0.3, 0.03, 0.09]], units), Ok(()));
            assert_eq!(check([[0.0, 0.0, 0.0], [0.0, 1.0, 0.5], [0.0, 0.5, 1.0]], units), Ok(()));
        }
    }
}
