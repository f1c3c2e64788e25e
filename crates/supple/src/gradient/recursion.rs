use nalgebra::DMatrix;

use crate::belief::Belief;
use crate::knots::Knots;

/// The largest spectral radius of `N_t = (A Sigma A' + W)^-1 A Sigma` over all steps (theory, equation G.7): the paper's
/// recursion for the precision's derivative is stable where it is below 1.
///
/// `None` where a predicted covariance is singular, so that N does not exist.
pub fn recursion_radius(knots: &Knots, belief: &Belief) -> Option<f64> {
    let n = knots.dimensions.states;
    let mut largest: f64 = 0.0;
    for t in 0..knots.steps() {
        let matrix = |entry: &dyn Fn(usize, usize) -> f64| DMatrix::from_fn(n, n, entry);
        let a = matrix(&|i, j| knots.dynamics.get(t, i, j));
        let sigma = matrix(&|i, j| belief.corrected.get(t, i, j));
        let predicted = matrix(&|i, j| belief.predicted.get(t + 1, i, j));
        let recursion = predicted.cholesky()?.solve(&(a * sigma));
        let radius = recursion.complex_eigenvalues().iter().map(|value| value.norm()).fold(0.0, f64::max);
        largest = largest.max(radius);
    }
    Some(largest)
}
