//! Linear equations with the mass matrix.

use supple_kernels::{Ldl, Scalar};

/// Solves `M x = b` with a symmetric positive definite matrix `M`, preserving its sparsity. Only entries on and below the
/// diagonal are read.
///
/// # Panics
/// If the sizes of `mass` and `b` differ.
///
/// Example: [`forward_dynamics`](crate::forward_dynamics).
pub fn solve<S: Scalar>(mass: Vec<Vec<S>>, b: &[S]) -> Vec<S> {
    assert_eq!(mass.len(), b.len(), "a row for every entry");
    Ldl::new(&mass).solve(b.to_vec())
}
