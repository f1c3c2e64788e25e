//! Observable and uncertain subspaces of a time-invariant system and its cost.

use crate::dense::{Dense, Svd, svd};

/// Singular values below this share of the largest count as 0.
const RANK_TOLERANCE: f64 = 1e-10;

/// Undriven modes whose growth factor per step exceeds 1 by less than this count as not growing.
pub const GROWTH: f64 = 1e-6;

/// An orthonormal basis of the range, by columns.
pub fn range(a: Dense) -> Dense {
    let Svd { u, values, .. } = svd(&a);
    let largest = values.first().copied().unwrap_or(0.0);
    let kept: Vec<usize> = (0..values.len()).filter(|&k| values[k] > RANK_TOLERANCE * largest).collect();
    u.select_columns(&kept)
}

/// An orthonormal basis of the orthogonal complement of orthonormal columns.
pub fn complement(basis: &Dense) -> Dense {
    let n = basis.nrows();
    if basis.ncols() >= n {
        return Dense::zeros(n, 0);
    }
    if basis.ncols() == 0 {
        return Dense::identity(n, n);
    }
    let Svd { u, values, .. } = svd(&(Dense::identity(n, n) - basis * basis.transpose()));
    let kept: Vec<usize> = (0..n).filter(|&k| values[k] > 0.5).collect();
    u.select_columns(&kept)
}

/// Columns scaled to length 1; those of zeros stay.
pub fn unit_columns(mut a: Dense) -> Dense {
    for mut column in a.column_iter_mut() {
        let norm = column.norm();
        if norm > 0.0 {
            column /= norm;
        }
    }
    a
}

/// An orthonormal basis of the smallest subspace that contains the range of `first` and is invariant under `a`.
pub fn invariant_hull(a: &Dense, first: Dense) -> Dense {
    let mut basis = range(unit_columns(first));
    while basis.ncols() < a.nrows() {
        let carried = unit_columns(a * &basis);
        // New directions lie outside the basis by more than rounding.
        let outside = &carried - &basis * (basis.transpose() * &carried);
        let new: Vec<usize> = (0..outside.ncols()).filter(|&k| outside.column(k).norm() > RANK_TOLERANCE).collect();
        if new.is_empty() {
            break;
        }
        let mut both = Dense::zeros(a.nrows(), basis.ncols() + new.len());
        both.columns_mut(0, basis.ncols()).copy_from(&basis);
        both.columns_mut(basis.ncols(), new.len()).copy_from(&unit_columns(outside.select_columns(&new)));
        basis = range(both);
    }
    basis
}

/// An orthonormal basis of the states observable through `price`: `x' A^k' price A^k x` of the others is 0 for all k.
#[must_use]
pub fn observed(a: &Dense, price: &Dense) -> Dense {
    invariant_hull(&a.transpose(), price.clone())
}

/// An orthonormal basis of the invariant subspace that belongs to the eigenvalues outside of the circle of this radius.
pub fn unstable(a: &Dense, radius: f64) -> Option<Dense> {
    let n = a.nrows();
    let identity = Dense::identity(n, n);
    // The sign of (A - r)^-1 (A + r): 1 where |lambda| > r. Close to r, the side of an eigenvalue is uncertain.
    let mut sign = (a - &identity * radius).lu().solve(&(a + &identity * radius))?;
    for _ in 0..100 {
        let inverse = sign.clone().try_inverse()?;
        let scale = (inverse.norm() / sign.norm()).sqrt();
        let next = (&sign * scale + inverse / scale) * 0.5;
        let change = (&next - &sign).norm();
        sign = next;
        if change <= 1e-13 * sign.norm() {
            break;
        }
    }
    let projector = (sign + identity) * 0.5;
    // The rank of a projector is its trace; the remainder is rounding.
    let count = projector.trace().round().max(0.0) as usize;
    Some(svd(&projector).u.columns(0, count.min(n)).into_owned())
}

/// Which states affect the given ones, now or later, judged by the zeros of `a`.
pub fn seen_states(a: &Dense, given: impl Fn(usize) -> bool) -> Vec<bool> {
    let n = a.nrows();
    let mut seen: Vec<bool> = (0..n).map(given).collect();
    loop {
        let new: Vec<usize> = (0..n).filter(|&j| !seen[j] && (0..n).any(|i| seen[i] && a[(i, j)] != 0.0)).collect();
        if new.is_empty() {
            return seen;
        }
        new.into_iter().for_each(|j| seen[j] = true);
    }
}
