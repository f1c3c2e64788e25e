//! Starting points of searches: every coordinate measured just well enough to use about half of the budget.

use super::interior::{Found, search};
use super::local::{Place, slack_of_budget};
use super::reduce::Chain;
use super::settings::BoundSettings;
use crate::dense::{Dense, cholesky, congruence, inverse_lower, solve_lower, symmetric};
use supple_kernels::{halt, math};

/// Complementarities at the start, nats: the first, and alternatives if the search from the first finds no bound,
/// for example because the minimum is far smaller.
pub(super) const COMPLEMENTARITIES: [f64; 4] = [0.3, 3e-3, 3e-5, 3e-8];

/// The largest logarithm of a variance to try, in absolute value, and the step between logarithms.
const VARIANCES: (f64, f64) = (80.0, 2.0);

/// Covariances, with multipliers that make every complementarity equal; `None` if they are not strictly feasible.
pub(super) fn begin(chain: &Chain, factors: Vec<Dense>, complementarity: f64) -> Option<Place> {
    let mut place = Place { factors, multipliers: Vec::new(), price: 1.0, barrier: complementarity };
    let local = place.localise(chain)?;
    for at in &local {
        let half = inverse_lower(&at.slack_factor);
        place.multipliers.push(symmetric(half.transpose() * half) * complementarity);
    }
    let left = slack_of_budget(&local);
    place.price = complementarity / left;
    (left > 0.0).then_some(place)
}

/// A strictly feasible start: all coordinates measured just well enough to use about half of the budget.
pub(super) fn start(chain: &Chain) -> Option<Vec<Dense>> {
    inside(|variance| {
        measured(chain, variance).filter(|(factors, _)| begin(chain, factors.clone(), COMPLEMENTARITIES[0]).is_some())
    })
}

/// Factors `g_t` of the covariances `p_t = g_t g_t'` once every reduced coordinate has been measured with a noise of
/// variance `variance`, and their cost as a share of the budget.
fn measured(chain: &Chain, variance: f64) -> Option<(Vec<Dense>, f64)> {
    let mut predicted = Dense::identity(chain.order(0), chain.order(0));
    let (mut factors, mut cost) = (Vec::with_capacity(chain.stages.len()), 0.0);
    for stage in &chain.stages {
        let posterior = once_measured(&predicted, variance)?;
        cost += stage.price.dot(&posterior);
        cholesky(&(&predicted - &posterior))?;
        predicted = congruence(&stage.dynamics, &posterior) + &stage.process;
        factors.push(cholesky(&posterior)?);
    }
    cost.is_finite().then_some((factors, cost))
}

/// `(P^-1 + I / variance)^-1`.
pub(super) fn once_measured(predicted: &Dense, variance: f64) -> Option<Dense> {
    let c = cholesky(predicted)?;
    let n = c.nrows();
    let innovation = cholesky(&symmetric(Dense::identity(n, n) + c.transpose() * &c / variance))?;
    let root = solve_lower(&innovation, c.transpose());
    Some(symmetric(root.transpose() * root))
}

/// A search from a strictly feasible start, with the first complementarity that leads to a bound.
pub(super) fn search_from(
    chain: &Chain,
    factors: &[Dense],
    complementarities: &[f64],
    target: f64,
    settings: &BoundSettings,
) -> Option<Found> {
    let mut found = None;
    for &complementarity in complementarities {
        found =
            begin(chain, factors.to_vec(), complementarity).and_then(|first| search(chain, first, target, settings));
        if found.as_ref().is_some_and(|found: &Found| found.gap.is_finite()) || halt::is_requested() {
            break;
        }
    }
    found
}

/// The result of `measured` at a variance for which the share of the budget that it returns is about one half, or else at
/// one for which it is below 1. `measured` may return `None` if the variance is so large that covariances diverge,
/// or so small that they are lost in rounding.
pub(super) fn inside<T>(measured: impl Fn(f64) -> Option<(T, f64)>) -> Option<T> {
    let (most, step) = VARIANCES;
    let kept = |log: f64| {
        if halt::is_requested() { None } else { measured(math::exp(log)).filter(|(_, cost)| *cost <= 0.7) }
    };
    let mut low = 0.0;
    let mut best = kept(low);
    while best.is_none() && low > -most {
        low -= step;
        best = kept(low);
    }
    let mut high = low + step;
    if low == 0.0 {
        while let Some(more) = kept(high).filter(|_| best.is_some() && high < most) {
            (best, low) = (Some(more), high);
            high += step;
        }
    }
    while high - low > 1e-3 && best.as_ref().is_some_and(|(_, cost)| *cost <= 0.3) {
        let middle = 0.5 * (low + high);
        match kept(middle) {
            Some(more) => (best, low) = (Some(more), middle),
            None => high = middle,
        }
    }
    best.map(|(found, _)| found)
}
