//! How far a point can be from the minimum: the gap to a feasible point of the dual.

use super::local::{Local, Place, slack_of_budget};
use super::reduce::Chain;
use crate::dense::{Dense, congruence, eigen, solve_lower, symmetric};
use supple_kernels::math;

/// The gap between the information at an iterate and the dual value of its multipliers, nats: infinite if they are not
/// feasible (theory, equation L.12). Never less than the distance to the minimum.
pub(super) fn gap(chain: &Chain, place: &Place, local: &[Local]) -> f64 {
    let mut gap = place.price * slack_of_budget(local);
    for (t, at) in local.iter().enumerate() {
        let multiplier = &place.multipliers[t];
        let (mut slope, mut size) =
            (&at.price * place.price + multiplier, at.price.norm() * place.price + multiplier.norm());
        let mut known = Dense::zeros(slope.nrows(), slope.nrows());
        if let Some(next) = chain.next(t) {
            let taken = congruence(&at.dynamics.transpose(), &place.multipliers[next]);
            size += taken.norm();
            slope -= taken;
            let half = solve_lower(&local[next].predicted_factor, at.dynamics.clone());
            known = symmetric(half.transpose() * half);
        }
        gap += multiplier.dot(&at.slack) + excess(&symmetric(slope), known, size);
    }
    if gap.is_finite() && gap > 0.0 { gap } else { f64::INFINITY }
}

/// An upper bound on how much `1/2 log |A p A' + W| - 1/2 log |p| + Tr(M p)` at the identity exceeds its infimum over `p`
/// (theory, equation L.11). `known` is `A' Pbar^-1 A`, and `size` the magnitude of the terms summed in `M`.
fn excess(slope: &Dense, known: Dense, size: f64) -> f64 {
    let n = slope.nrows();
    let Some(found) = eigen(known) else { return f64::INFINITY };
    let turned = found.eigenvectors.transpose() * slope * &found.eigenvectors;
    let rounding = 8.0 * (n as f64) * f64::EPSILON * size;
    let mut excess = 0.0;
    for i in 0..n {
        let beside: f64 = (0..n).filter(|&j| j != i).map(|j| turned[(i, j)].abs()).sum();
        let least = turned[(i, i)] - beside - rounding;
        excess += turned[(i, i)] - infimum((1.0 - found.eigenvalues[i]).clamp(0.0, 1.0), least);
    }
    excess
}

/// The infimum over `q > 0` of `1/2 log(1 - c + c / q) + m q`, for `c` in `[0, 1]`.
fn infimum(c: f64, m: f64) -> f64 {
    if m.is_nan() || m <= 0.0 {
        return f64::NEG_INFINITY;
    }
    if c == 0.0 {
        return 0.0;
    }
    // c / q at the minimum.
    let e = m * c + (m * m * c * c + 2.0 * m * (1.0 - c) * c).sqrt();
    0.5 * math::ln_1p(e - c) + m * c / e
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_infimum_is_below_every_value_and_reached() {
        for (c, m) in [(0.5, 0.25), (1.0, 0.5), (1e-9, 1e-4), (0.3, 2.0), (0.999, 1e-6)] {
            let value = |q: f64| 0.5 * (1.0 - c + c / q).ln() + m * q;
            let least = (-4000..4000).map(|k| value((f64::from(k) * 0.01).exp())).fold(f64::INFINITY, f64::min);
            let found = infimum(c, m);
            assert!(found <= least + 1e-14 && least - found < 1e-4 * least.abs().max(1e-3), "{c} {m}: {found} {least}");
        }
    }
}
