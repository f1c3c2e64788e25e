//! Linear equations with the mass matrix.

use supple_kernels::{Ldl, Scalar};

/// `x` with `M x = b`, of a symmetric positive definite matrix `M`, whose zeros are kept. Only entries on and below the
/// diagonal are read.
///
/// # Panics
/// Where `mass` or `b` are of other sizes than each other.
pub fn solve<S: Scalar>(mass: Vec<Vec<S>>, b: &[S]) -> Vec<S> {
    assert_eq!(mass.len(), b.len(), "a row for every entry");
    Ldl::new(&mass).solve(b.to_vec())
}
