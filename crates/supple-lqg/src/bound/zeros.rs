//! Separates modes that do not decay from those that do.

use super::subspace::unstable;
use crate::dense::{Dense, eigenvalues};

/// Modes that decay faster than this per step need no special treatment.
const SETTLES: f64 = 0.8;

/// Modes closer to the unit circle than this count as on it.
const ON_CIRCLE: f64 = 1e-7;

/// An orthonormal basis of the modes that do not decay, as columns.
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

/// A radius, far from both, that separates the persistent modes from the decaying ones, if there are both; `None`
/// if all decay.
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
