//! The least directed information over a horizon.

use supple_kernels::{Matrices, halt};

use super::along::Spread;
use super::horizon::Horizon;
use super::interior::{Found, search};
use super::local::nats;
use super::nearby::Nearby;
use super::proof::{Achieved, Attempt, Lower, Proof};
use super::reduce::Chain;
use super::sensitivity::Worth;
use super::sensor::sensors;
use super::settings::{BoundSettings, BoundStatus};
use super::size::Size;
use super::solution::{FINEST, MinimumInformation};
use super::start::{COMPLEMENTARITIES, search_from, start};
use super::virtual_sensor::VirtualSensor;
use super::witness::Witness;
use crate::Error;
use crate::dense::{Dense, congruence, dense, store};

/// The least margin of the requested cost above the least cost, as a share of the latter: below it the budget is rounding.
pub(super) const LEAST_MARGIN: f64 = 1e-12;

/// The gap, in units of the requested one, at which to prove a lower bound if the requested gap yields none.
const WIDER: f64 = 1000.0;

/// The share of the minimum that such a bound must reach to be useful.
const OF_USE: f64 = 0.5;

/// The share of the requested gap at which the search ends: the rest is reserved for the proof.
pub(super) const SHARE: f64 = 0.5;

/// The largest gap as a share of the minimum.
const FINE: f64 = 1e-3;

/// Why a bound of 0 counts as not proved.
pub(super) const LOST: &str = "it is lost to rounding";

/// Whether the requested gap is more than a small share of a minimum of so many nats per decision.
pub(super) fn is_coarse(nats: f64, settings: &BoundSettings) -> bool {
    settings.gap > FINE * nats && settings.gap > FINEST
}

/// The same settings with a gap that is a small share of the minimum.
pub(super) fn finer(nats: f64, settings: &BoundSettings) -> BoundSettings {
    BoundSettings { gap: settings.gap.min((0.1 * FINE * nats).max(FINEST)), ..*settings }
}

/// The minimum directed information from state to control that any sensors and any controller need over `horizon` to
/// keep the expected cost at `cost` (theory, equation L.2), with a proved lower bound that accounts for rounding.
///
/// The requested gap is that of `settings`, per decision; if it is not reached, the status reports this and both bounds
/// still hold.
///
/// # Errors
/// Where settings, arrays or their shapes are invalid, covariances or prices are not positive semidefinite, `cost` is not above
/// `base_cost`, or nothing could be certified.
///
/// Example: the [module](crate::bound).
pub fn minimum_information(
    horizon: &Horizon,
    cost: f64,
    settings: &BoundSettings,
) -> Result<MinimumInformation, Error> {
    minimum_information_within(horizon, &Spread::default(), cost, settings)
}

/// Like [`minimum_information`], for a horizon whose least cost and prices have the error `spread`: the bound holds for all
/// values within it.
///
/// # Errors
/// Same as for that function.
///
/// ```
/// use supple_lqg::bound::{BoundSettings, Horizon, minimum_information_within};
/// use supple_lqg::{Knots, LinearQuadratic, Noise, Policy, constant};
///
/// let plant = LinearQuadratic { a: &[[1.2]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let knots = Knots::linear(10, plant)?;
/// let one = constant(&[[1.0]]);
/// let noise = Noise { initial: one.clone(), process: one.clone(), measurement: one };
/// // A policy of zeros holds no control at a limit.
/// let (horizon, spread) = Horizon::proved(&knots, &Policy::zeros(knots.dimensions, 10), &noise, 0.0, 0.0)?;
/// let limit = 1.5 * horizon.base_cost;
/// let found = minimum_information_within(&horizon, &spread, limit, &BoundSettings::default())?;
/// assert!(0.0 < found.lower_nats && found.lower_nats <= found.nats);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn minimum_information_within(
    horizon: &Horizon,
    spread: &Spread,
    cost: f64,
    settings: &BoundSettings,
) -> Result<MinimumInformation, Error> {
    settings.check()?;
    horizon.check()?;
    horizon.check_covariances()?;
    // Without noise the least cost itself can be kept without information.
    if let Some(open) = open_loop(horizon, cost).filter(|_| cost.is_finite()) {
        return Ok(open);
    }
    let of = |settings: &BoundSettings| {
        let (chain, found, budget) = place(horizon, cost, settings, None)?;
        Ok::<_, Error>(solution(horizon, spread, &chain, found, cost, budget))
    };
    let mut best = of(settings)?;
    let rate = best.nats / horizon.steps() as f64;
    if is_coarse(rate, settings)
        && let Ok(again) = of(&finer(rate, settings))
    {
        best = best.beside(again);
    }
    if best.lower_nats <= OF_USE * best.nats {
        // Stay farther from the boundary, where rounding is smaller relative to the margins that the proof needs.
        let again = of(&BoundSettings { gap: WIDER * settings.gap, ..*settings });
        if let Ok(MinimumInformation { lower_nats, proof: proof @ Proof::Proved { .. }, .. }) = again
            && lower_nats > best.lower_nats.max(OF_USE * best.nats)
        {
            (best.lower_nats, best.proof) = (lower_nats, proof);
            best.nats = best.nats.max(lower_nats);
        }
    }
    if halt::is_requested() {
        return Err(Error::Stopped);
    }
    let finest = FINEST * horizon.steps() as f64;
    if best.lower_nats == 0.0 && best.nats > finest && matches!(best.proof, Proof::Proved { .. }) {
        best.proof = Proof::NotProved { reason: LOST.into() };
    }
    Ok(best)
}

/// The final iterate of the search, in reduced coordinates, and the budget of the covariances.
pub(super) fn place(
    horizon: &Horizon,
    cost: f64,
    settings: &BoundSettings,
    nearby: Option<&Nearby>,
) -> Result<(Chain, Found, f64), Error> {
    let budget = budget(cost, horizon.base_cost)?;
    Size::of(horizon).check()?;
    let chain = Chain::of_horizon(horizon, budget)?;
    let target = SHARE * settings.gap * chain.stages.len() as f64;
    let continued = nearby.and_then(|nearby| search(&chain, nearby.place(&chain, budget)?, target, settings));
    if let Some(found) = continued.filter(|found| found.status == BoundStatus::Converged) {
        return Ok((chain, found, budget));
    }
    let factors = start(&chain).ok_or_else(|| Error::NoBound {
        what: "no feasible covariances were found".into(),
        advice: "scale the states to similar sizes, shorten the horizon, or increase the cost limit",
    })?;
    let found = search_from(&chain, &factors, &COMPLEMENTARITIES, target, settings);
    if halt::is_requested() {
        return Err(Error::Stopped);
    }
    Ok((chain, certified(found, ADVICE)?, budget))
}

/// The budget: the highest cost that the covariances may incur.
pub(super) fn budget(cost: f64, least: f64) -> Result<f64, Error> {
    if !cost.is_finite() {
        let what = format!("the requested expected cost, {cost}, is not finite");
        return Err(Error::NoBound { what, advice: "give a finite number" });
    }
    let budget = cost - least;
    if budget <= 0.0 {
        return Err(Error::CostBelowLeast { cost, least });
    }
    if budget <= LEAST_MARGIN * least.abs() {
        return Err(Error::NoBound {
            what: format!("the margin above the minimum cost, {least:?}, is no more than rounding"),
            advice: "choose a larger cost",
        });
    }
    Ok(budget)
}

/// Advice for problems over a horizon.
const ADVICE: &str = "scale the states to similar sizes, shorten the horizon, or ask for a cost that is neither close to the \
                      least one nor far beyond that of the design";

/// A certified iterate, or why there is none.
pub(super) fn certified(found: Option<Found>, advice: &'static str) -> Result<Found, Error> {
    match found {
        Some(found) if found.gap.is_finite() => Ok(found),
        Some(Found { status: BoundStatus::MaxIterations, .. }) => {
            let what = "the Newton steps allowed end before any gap can be certified".into();
            Err(Error::NoBound { what, advice: "allow more of them" })
        }
        _ => Err(Error::NoBound { what: "rounding is larger than the gap that can be certified".into(), advice }),
    }
}

/// The solution without any information, if it keeps the cost limit.
pub(super) fn open_loop(horizon: &Horizon, cost: f64) -> Option<MinimumInformation> {
    let (steps, n) = (horizon.prices.count(), horizon.prices.rows());
    let mut predicted = Matrices::zeros(steps, n, n);
    let (mut covariance, mut total) = (dense(&horizon.initial, 0), horizon.base_cost);
    for t in 0..steps {
        store(&mut predicted, t, &covariance);
        let price = dense(&horizon.prices, t);
        // What grows without a price may have overflowed.
        if price.iter().any(|v| *v != 0.0) {
            total += price.dot(&covariance);
        }
        if t + 1 < steps {
            covariance = congruence(&dense(&horizon.dynamics, t), &covariance) + dense(&horizon.process, t);
        }
    }
    (total <= cost + LEAST_MARGIN * horizon.base_cost.abs()).then(|| MinimumInformation {
        nats: 0.0,
        lower_nats: 0.0,
        cost: total,
        slope: 0.0,
        posterior: predicted.clone(),
        predicted,
        per_step_nats: vec![0.0; steps],
        iterations: 0,
        status: BoundStatus::Converged,
        sensors: vec![VirtualSensor::none(n); steps],
        worth: Worth::default(),
        proof: Proof::Proved { distance: 0.0 },
        achieved: Some(Achieved { nats: 0.0, cost: total }),
    })
}

/// `A_t P_t A_t' + W_t` and `P_t` of the final iterate, in the coordinates of the horizon.
pub(super) fn covariances(horizon: &Horizon, chain: &Chain, found: &Found) -> (Matrices, Matrices) {
    let (steps, n) = (chain.stages.len(), horizon.prices.rows());
    let (mut predicted, mut posterior) = (Matrices::zeros(steps, n, n), Matrices::zeros(steps, n, n));
    for (t, at) in found.local.iter().enumerate() {
        let root = &chain.stages[t].basis * &found.place.factors[t];
        store(&mut posterior, t, &congruence(&root, &Dense::identity(root.ncols(), root.ncols())));
        store(&mut predicted, t, &congruence(&root, &at.predicted));
    }
    (predicted, posterior)
}

/// The result, in the coordinates of the horizon.
fn solution(
    horizon: &Horizon,
    spread: &Spread,
    chain: &Chain,
    found: Found,
    asked: f64,
    budget: f64,
) -> MinimumInformation {
    let (predicted, posterior) = covariances(horizon, chain, &found);
    let spent: f64 = found.local.iter().map(|at| at.price.trace()).sum();
    let mut per_step_nats: Vec<f64> = found.local.iter().map(nats).collect();
    let total: f64 = per_step_nats.iter().sum();
    let sensors = sensors(chain, &found);
    let achieved = Achieved::of_horizon(horizon, &sensors);
    let kept = achieved.filter(|achieved| achieved.keeps(asked, horizon.base_cost));
    let witnesses: [&dyn Fn() -> Witness; 2] =
        [&|| Witness::new(chain, &found, budget), &|| Witness::settled(chain, &found, budget)];
    let lower = Lower::of_horizon(horizon, spread, asked, &Attempt { nats: total, witnesses });
    let (lower, nats) = lower.beside(kept, total);
    per_step_nats.iter_mut().for_each(|of_step| *of_step *= nats / total);
    MinimumInformation {
        nats,
        lower_nats: lower.nats,
        worth: Worth::of(chain, &found),
        proof: lower.proof,
        achieved,
        cost: horizon.base_cost + spent * budget,
        slope: -found.place.price / budget,
        predicted,
        posterior,
        per_step_nats,
        iterations: found.iterations,
        status: found.status,
        sensors,
    }
}
