//! A point of the dual, as the proof of the lower bound reads it.

use super::interior::Found;
use super::reduce::Chain;
use crate::dense::{Dense, congruence, eigen, symmetric};

/// A point of the dual and the covariances beside it: what [`super::verify`] proves a lower bound from.
#[derive(Clone, Debug)]
pub(super) struct Witness {
    /// At each decision.
    pub steps: Vec<WitnessStep>,
    /// The multiplier of the budget, nats per cost.
    pub price: f64,
}

/// One decision.
#[derive(Clone, Debug)]
pub(super) struct WitnessStep {
    /// `E`, n x n_t: `P = E E'`.
    pub basis: Dense,
    /// States that no price sees, n x k.
    pub unseen: Dense,
    /// The multiplier of `P <= Pbar` in these coordinates, n_t x n_t.
    pub multiplier: Dense,
}

/// Directions that are measured with at least this signal-to-noise ratio keep their multipliers.
const MEASURED: f64 = 1e-3;

/// By how much more the price of the budget is raised, relatively, for each nat of margin.
const DEARER: f64 = 10.0;

impl Witness {
    /// The point found, with `margin` more by step in every direction that is not measured: what rounding took of the slope of
    /// the Lagrangian, at hardly any loss, as there the multiplier's slack is small.
    pub fn new(chain: &Chain, found: &Found, budget: f64, margin: f64) -> Option<Self> {
        let mut multipliers = found.place.multipliers.clone();
        if margin > 0.0 {
            let more = if chain.wraps { steady_margin(found)? } else { margins(found)? };
            multipliers.iter_mut().zip(more).for_each(|(multiplier, more)| *multiplier += more * margin);
        }
        let step = |(t, multiplier): (usize, Dense)| WitnessStep {
            basis: &chain.stages[t].basis * &found.place.factors[t],
            unseen: chain.stages[t].unseen.clone(),
            multiplier: symmetric(multiplier),
        };
        let steps = multipliers.into_iter().enumerate().map(step).collect();
        Some(Self { steps, price: found.place.price / budget * (1.0 + DEARER * margin) })
    }
}

/// A projector on what is not measured at a decision.
fn unmeasured(found: &Found, t: usize) -> Option<Dense> {
    let eigen = eigen(found.local[t].slack.clone())?;
    let kept: Vec<usize> = (0..eigen.eigenvalues.len()).filter(|&k| eigen.eigenvalues[k] < MEASURED).collect();
    let basis = eigen.eigenvectors.select_columns(&kept);
    Some(&basis * basis.transpose())
}

/// `X_t = Pi_t (I + A_t' X_{t+1} A_t) Pi_t`.
fn margins(found: &Found) -> Option<Vec<Dense>> {
    let mut out = Vec::with_capacity(found.local.len());
    let mut next: Option<Dense> = None;
    for (t, local) in found.local.iter().enumerate().rev() {
        let kept = unmeasured(found, t)?;
        let carried = next.map_or_else(
            || kept.clone(),
            |next| symmetric(&kept + congruence(&(&local.dynamics * &kept).transpose(), &next)),
        );
        next = Some(carried.clone());
        out.push(carried);
    }
    out.reverse();
    out.iter().all(|more| more.norm().is_finite()).then_some(out)
}

/// The same where the only decision follows itself, by doubling.
fn steady_margin(found: &Found) -> Option<Vec<Dense>> {
    let kept = unmeasured(found, 0)?;
    let (mut a, mut sum) = (&found.local[0].dynamics * &kept, kept);
    for _ in 0..60 {
        sum = symmetric(&sum + congruence(&a.transpose(), &sum));
        a = &a * &a;
        if !sum.norm().is_finite() {
            return None;
        }
        if a.norm() < 1e-20 {
            return Some(vec![sum]);
        }
    }
    None
}
