//! Linear equations with the mass matrix.

// Loops over rows and columns by index read like the formulas.
#![allow(clippy::needless_range_loop)]

use supple_kernels::Scalar;

/// `x` with `M x = b`, of a symmetric positive definite matrix `M`, by `M = L' D L` with unit lower triangular `L`,
/// which keeps the zeros of a mass matrix: Featherstone 2008, section 6.5. Only entries on and below the diagonal are
/// read.
///
/// # Panics
/// Where `mass` or `b` are of other sizes than each other.
pub fn solve<S: Scalar>(mass: Vec<Vec<S>>, b: &[S]) -> Vec<S> {
    let (lower, inverses) = factor(mass);
    let mut x = b.to_vec();
    for row in (0..x.len()).rev() {
        for column in 0..row {
            x[column] = x[column] - lower[row][column] * x[row];
        }
    }
    for row in 0..x.len() {
        x[row] = x[row] * inverses[row];
        for column in 0..row {
            x[row] = x[row] - lower[row][column] * x[column];
        }
    }
    x
}

/// `L` below the diagonal, and the entries of `1 / D`.
fn factor<S: Scalar>(mut mass: Vec<Vec<S>>) -> (Vec<Vec<S>>, Vec<S>) {
    let size = mass.len();
    let mut inverses = vec![S::zero(); size];
    for k in (0..size).rev() {
        inverses[k] = mass[k][k].recip();
        for i in 0..k {
            let factor = mass[k][i] * inverses[k];
            for j in 0..=i {
                mass[i][j] = mass[i][j] - factor * mass[k][j];
            }
        }
        for i in 0..k {
            mass[k][i] = mass[k][i] * inverses[k];
        }
    }
    (mass, inverses)
}
