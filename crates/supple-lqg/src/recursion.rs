use nalgebra::DMatrix;
use supple_kernels::math;

use crate::belief::Belief;
use crate::knots::Knots;

/// The largest spectral radius of `N_t = (A Sigma A' + W)^-1 A Sigma` over all steps (theory, equation G.7): the paper's
/// recursion for the precision's derivative is stable where it is below 1.
///
/// `None` where a predicted covariance is singular, so that N does not exist.
///
/// Example: [`entropy_form`](crate::entropy_form).
#[must_use]
pub fn recursion_radius(knots: &Knots, belief: &Belief) -> Option<f64> {
    let n = knots.dimensions.states;
    let mut largest: f64 = 0.0;
    for t in 0..knots.steps() {
        let matrix = |entry: &dyn Fn(usize, usize) -> f64| DMatrix::from_fn(n, n, entry);
        let a = matrix(&|i, j| knots.dynamics.get(t, i, j));
        let sigma = matrix(&|i, j| belief.corrected.get(t, i, j));
        let predicted = matrix(&|i, j| belief.predicted.get(t + 1, i, j));
        let recursion = predicted.cholesky()?.solve(&(a * sigma));
        largest = largest.max(spectral_radius(recursion));
    }
    Some(largest)
}

/// The largest modulus of the eigenvalues, by Gelfand's formula `lim |M^k|^(1/k)` with k = 2^40.
///
/// 0 for matrices of zeros, and infinite or not a number where an entry is.
///
/// Always forty products: eigenvalue iterations may not converge if some eigenvalues are equal.
///
/// ```
/// use nalgebra::DMatrix;
///
/// let turn = DMatrix::from_row_slice(2, 2, &[0.0, -3.0, 3.0, 0.0]);
/// assert!((supple_lqg::spectral_radius(turn) - 3.0).abs() < 1e-9);
/// ```
#[must_use]
pub fn spectral_radius(mut matrix: DMatrix<f64>) -> f64 {
    // Scaled first, as squares of large entries are infinite.
    let size = matrix.amax();
    if size == 0.0 || !size.is_finite() {
        return size;
    }
    matrix /= size;
    let (mut logarithm, mut share) = (math::ln(size), 1.0);
    for _ in 0..40 {
        let norm = matrix.norm();
        if norm == 0.0 {
            return 0.0;
        }
        logarithm += share * math::ln(norm);
        share *= 0.5;
        matrix /= norm;
        matrix = &matrix * &matrix;
    }
    math::exp(logarithm)
}
