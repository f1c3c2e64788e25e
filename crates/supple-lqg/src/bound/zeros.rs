//! Motions that cost nothing for ever: what an optimal regulator leaves alone.

use super::subspace::{complement, range, unit_columns, unstable};
use crate::dense::{Dense, Svd, eigenvalues, semidefinite_root, svd};

/// Lengths below this share of 1 count as 0, once rows have length 1.
const RANK_TOLERANCE: f64 = 1e-10;

/// Modes that die out faster than this per step need no care.
const SETTLES: f64 = 0.8;

/// Modes closer to the unit circle than this count as on it.
const ON_CIRCLE: f64 = 1e-7;

/// An orthonormal basis, by columns, of states that some control keeps at no cost for ever while they do not die out
/// (theory, below equation L.14): `(A + B F) V = V A_0` with `L [V; F V] = 0` and `A_0` not stable.
///
/// No PSD solution of the Riccati equation but the least one is 0 there, and doubling need not lead to it.
pub(super) fn free_motions(a: &Dense, b: &Dense, l: &Dense) -> Dense {
    let (n, m) = (a.nrows(), b.ncols());
    let none = Dense::zeros(n, 0);
    let Some(root) = semidefinite_root(l) else { return none };
    let mut seen = Dense::zeros(n, 0);
    loop {
        let rows = outputs(a, b, &root, &seen);
        let (x, u) = (rows.columns(0, n).into_owned(), rows.columns(n, m).into_owned());
        // Combinations of outputs that no control touches.
        let untouched = left_null(&u);
        let mut both = Dense::zeros(n, seen.ncols() + untouched.ncols());
        both.columns_mut(0, seen.ncols()).copy_from(&seen);
        both.columns_mut(seen.ncols(), untouched.ncols()).copy_from(&significant(x.transpose() * untouched));
        let next = range(both);
        if next.ncols() <= seen.ncols() || next.ncols() == n {
            seen = if next.ncols() == n { next } else { seen };
            break;
        }
        seen = next;
    }
    if seen.ncols() == n {
        return none;
    }
    let free = complement(&seen);
    let rows = outputs(a, b, &root, &seen);
    let control = pseudo_inverse(&rows.columns(n, m).into_owned()) * rows.columns(0, n) * &free * -1.0;
    let dynamics = free.transpose() * (a * &free + b * control);
    lasting(&dynamics).map_or(none, |kept| free * kept)
}

/// An orthonormal basis of the modes that do not die out, by columns.
pub(super) fn lasting(a: &Dense) -> Option<Dense> {
    let moduli = moduli(a);
    let least = moduli.as_ref().and_then(|moduli| moduli.iter().copied().min_by(f64::total_cmp));
    match moduli.map(|moduli| radius(moduli, a.nrows())) {
        Some(None) => Some(Dense::zeros(a.nrows(), 0)),
        // All of them last.
        Some(Some(radius)) if least.is_some_and(|least| least > radius) => Some(Dense::identity(a.nrows(), a.nrows())),
        Some(Some(radius)) => unstable(a, radius),
        None => unstable(a, 1.0 - 1e-3),
    }
}

/// A radius that splits the modes that last from those that die out, where there are both, far from either; `None`
/// where all die out.
fn radius(mut moduli: Vec<f64>, order: usize) -> Option<f64> {
    moduli.retain(|&modulus| modulus < 1.0 - ON_CIRCLE);
    if moduli.len() == order {
        return None;
    }
    moduli.retain(|&modulus| modulus > SETTLES);
    moduli.extend([SETTLES, 1.0 - ON_CIRCLE]);
    moduli.sort_by(f64::total_cmp);
    // The widest gap in distances to the circle.
    let gaps = moduli.windows(2).map(|pair| ((1.0 - pair[0]) / (1.0 - pair[1]), pair));
    let widest = gaps.max_by(|a, b| a.0.total_cmp(&b.0));
    widest.map(|(_, pair)| 1.0 - ((1.0 - pair[0]) * (1.0 - pair[1])).sqrt())
}

/// Absolute values of the eigenvalues.
pub(super) fn moduli(a: &Dense) -> Option<Vec<f64>> {
    Some(eigenvalues(a)?.into_iter().map(|value| value.norm()).collect())
}

/// Rows of length 1: what costs now, and what is seen of the next state.
fn outputs(a: &Dense, b: &Dense, root: &Dense, seen: &Dense) -> Dense {
    let (n, m, p) = (a.nrows(), b.ncols(), root.ncols());
    let mut columns = Dense::zeros(n + m, p + seen.ncols());
    columns.columns_mut(0, p).copy_from(root);
    columns.view_mut((0, p), (n, seen.ncols())).copy_from(&(a.transpose() * seen));
    columns.view_mut((n, p), (m, seen.ncols())).copy_from(&(b.transpose() * seen));
    unit_columns(columns).transpose()
}

/// Columns that are longer than rounding.
fn significant(a: Dense) -> Dense {
    let mut a = a;
    for mut column in a.column_iter_mut() {
        if column.norm() <= RANK_TOLERANCE {
            column.fill(0.0);
        }
    }
    a
}

/// An orthonormal basis of what is orthogonal to the columns.
fn left_null(a: &Dense) -> Dense {
    let Svd { u, values, .. } = svd(a);
    let kept: Vec<usize> = (0..values.len()).filter(|&k| values[k] > RANK_TOLERANCE).collect();
    complement(&u.select_columns(&kept))
}

/// `a^+`, singular values below the tolerance being 0.
fn pseudo_inverse(a: &Dense) -> Dense {
    let Svd { u, values, v } = svd(a);
    let inverse = |k: usize| if values[k] > RANK_TOLERANCE { 1.0 / values[k] } else { 0.0 };
    let scaled = Dense::from_fn(v.nrows(), values.len(), |i, k| v[(i, k)] * inverse(k));
    scaled * u.transpose()
}
