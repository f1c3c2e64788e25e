//! The search: a primal-dual interior-point method that stays strictly feasible and certifies its iterates.

use super::certificate::gap;
use super::local::{Local, Place, Scaling, nats, scaling, slack_change, slack_of_budget};
use super::newton::Newton;
use super::reduce::Chain;
use super::settings::{BoundSettings, BoundStatus};
use crate::dense::{Dense, cholesky, least_eigenvalue, log_determinant, solve_lower, symmetric};
use supple_kernels::{halt, math};

/// The fraction of the distance to the boundary that a step may cover.
const FRACTION_TO_BOUNDARY: f64 = 0.95;
/// The least barrier weight, as a share of the one at which the target gap is reached.
const LAST_BARRIER: f64 = 0.2;

/// An iterate counts as central when its stationarity residual is at most this share of the barrier weight.
const CENTRED: f64 = 0.1;
/// Centring steps allowed once the gap is reached.
const MOST_CENTRING: usize = 4;

/// The barrier weight at iterates from which searches of nearby problems are warm-started, nats.
const EARLY: f64 = 1e-4;

/// Where the search ended.
pub(super) struct Found {
    /// The best certified iterate.
    pub place: Place,
    /// The same iterate in its own coordinates.
    pub local: Vec<Local>,
    /// Upper bound on the nats above the dual value; infinite if nothing is certified.
    pub gap: f64,
    /// The stationarity residual relative to the barrier weight: proofs need it well below 1.
    pub off_centre: f64,
    /// A well-centred iterate on the way, from which a search of a nearby problem can be warm-started.
    pub early: Option<Place>,
    /// Newton steps taken.
    pub iterations: usize,
    /// How it ended.
    pub status: BoundStatus,
}

/// A Newton step that was taken.
struct Step {
    /// Step lengths for covariances and multipliers, at most 1.
    primal: f64,
    dual: f64,
    /// The new iterate in its own coordinates.
    local: Vec<Local>,
}

/// A direction of the search.
struct Direction {
    covariances: Vec<Dense>,
    slacks: Vec<Dense>,
    multipliers: Vec<Dense>,
    /// Change of the unused budget, as a share of it.
    budget: f64,
    price: f64,
}

/// Searches from a strictly feasible point until the gap is at most `target` nats.
pub(super) fn search(chain: &Chain, mut place: Place, target: f64, settings: &BoundSettings) -> Option<Found> {
    let mut local = place.localise(chain)?;
    let mut newton = Newton::new(chain);
    let mut best = Found {
        gap: gap(chain, &place, &local),
        place: place.clone(),
        local: local.clone(),
        off_centre: f64::INFINITY,
        early: None,
        iterations: 0,
        status: BoundStatus::MaxIterations,
    };
    let count = chain.stages.iter().map(|s| 2 * s.price.nrows()).sum::<usize>() + 1;
    let least = LAST_BARRIER * target / count as f64;
    let mut barrier = (0.5 * place.barrier).max(least);
    let mut centring = 0;
    for iteration in 0..settings.max_iterations {
        if halt::is_requested() {
            return Some(best);
        }
        if best.gap <= target && (best.off_centre <= CENTRED || centring >= MOST_CENTRING) {
            best.status = BoundStatus::Converged;
            return Some(best);
        }
        let taken = iterate(chain, &mut place, &local, &mut newton, barrier);
        let Some(step) = taken else {
            best.status = if best.gap <= target { BoundStatus::Converged } else { BoundStatus::Stalled };
            return Some(best);
        };
        local = step.local;
        let far = residual(chain, &place, &local) / barrier;
        best.iterations = iteration + 1;
        if best.early.is_none() && place.barrier <= EARLY && far <= 1.0 {
            best.early = Some(place.clone());
        }
        let now = gap(chain, &place, &local);
        let centred = now <= target && far < best.off_centre;
        if now < best.gap && best.gap > target || !best.gap.is_finite() || centred {
            (best.gap, best.place, best.local, best.off_centre) = (now, place.clone(), local.clone(), far);
        }
        if best.gap <= target {
            centring += 1;
        } else {
            barrier = (barrier * reduction(step.primal.min(step.dual), far)).max(least);
        }
    }
    if best.gap <= target {
        best.status = BoundStatus::Converged;
    }
    Some(best)
}

/// The factor applied to the barrier weight after a step of this length that leaves a residual of `far` times it.
fn reduction(length: f64, far: f64) -> f64 {
    match far {
        _ if length < 0.5 => 1.0,
        ..0.1 => 0.05,
        ..0.3 => 0.1,
        ..0.7 => 0.2,
        ..1.5 => 0.4,
        ..4.0 => 0.7,
        _ => 1.0,
    }
}

/// How far the covariances are from stationarity with these multipliers: root mean square over coordinates in
/// which `p_t` is the identity.
fn residual(chain: &Chain, place: &Place, local: &[Local]) -> f64 {
    let (mut squares, mut count) = (0.0, 0);
    for (t, at) in local.iter().enumerate() {
        let n = at.price.nrows();
        let mut sum = &at.price * place.price + &place.multipliers[t] - Dense::identity(n, n) * (0.5 + place.barrier);
        if let Some(next) = chain.next(t) {
            let half = solve_lower(&local[next].predicted_factor, at.dynamics.clone());
            sum += half.transpose() * half * 0.5;
            sum -= at.dynamics.transpose() * &place.multipliers[next] * &at.dynamics;
        }
        squares += sum.norm_squared();
        count += n;
    }
    (squares / count.max(1) as f64).sqrt()
}

/// One Newton step towards the minimum at this barrier weight; `None` if rounding prevents any step, and once a stop
/// is requested.
fn iterate(chain: &Chain, place: &mut Place, local: &[Local], newton: &mut Newton, barrier: f64) -> Option<Step> {
    let scaling = |(at, multiplier): (&Local, &Dense)| match halt::is_requested() {
        true => None,
        false => scaling(&at.slack_factor, multiplier),
    };
    let scalings: Vec<Scaling> = local.iter().zip(&place.multipliers).map(scaling).collect::<Option<_>>()?;
    let left = slack_of_budget(local);
    let gradients = gradients(chain, local, &scalings, barrier, left);
    let solved = newton.solve(chain, local, &scalings, &gradients, barrier, place.price / left);
    let (covariances, cost) = solved.ok()?;
    let direction = complete(chain, place, local, &scalings, covariances, cost, barrier);
    let (primal, dual) = longest_steps(&scalings, &direction, left, place.price);
    let slope = slope(&gradients, &direction.covariances);
    let before = merit(place, local, barrier)?;
    let mut length = primal;
    for _ in 0..40 {
        let mut candidate = place.clone();
        if advance(&mut candidate, &direction, length, dual.min(1.0))
            && let Some(next) = candidate.localise(chain)
            && let Some(after) = merit(&candidate, &next, barrier)
            && after <= before + 1e-4 * length * slope.min(0.0) + 1e-12 * before.abs().max(1.0)
        {
            *place = candidate;
            place.barrier = barrier;
            return Some(Step { primal: length, dual, local: next });
        }
        length *= 0.5;
    }
    None
}

/// Gradients with respect to `p_t` of the information with the barriers (theory, equation L.5).
fn gradients(chain: &Chain, local: &[Local], scalings: &[Scaling], barrier: f64, left: f64) -> Vec<Dense> {
    let of = |t: usize| {
        let at = &local[t];
        let n = at.price.nrows();
        let mut sum = &scalings[t].slack_inverse * barrier + &at.price * (barrier / left);
        if let Some(next) = chain.next(t) {
            let half = solve_lower(&local[next].predicted_factor, at.dynamics.clone());
            sum += half.transpose() * half * 0.5;
            sum -= at.dynamics.transpose() * &scalings[next].slack_inverse * &at.dynamics * barrier;
        }
        symmetric(sum - Dense::identity(n, n) * (0.5 + barrier))
    };
    (0..local.len()).map(of).collect()
}

/// The changes of slacks and multipliers that follow from those of the covariances.
fn complete(
    chain: &Chain,
    place: &Place,
    local: &[Local],
    scalings: &[Scaling],
    covariances: Vec<Dense>,
    cost: f64,
    barrier: f64,
) -> Direction {
    let slacks: Vec<Dense> = (0..local.len()).map(|t| slack_change(chain, local, &covariances, t)).collect();
    let multipliers = slacks
        .iter()
        .zip(scalings)
        .zip(&place.multipliers)
        .map(|((change, s), l)| symmetric(&s.slack_inverse * barrier - l - &s.metric * change * &s.metric));
    let (left, budget) = (slack_of_budget(local), -cost);
    let price = barrier / left - place.price - place.price / left * budget;
    Direction { multipliers: multipliers.collect(), covariances, slacks, budget, price }
}

/// The longest steps, at most 1, that stay strictly feasible, where `left` is the unused budget.
fn longest_steps(scalings: &[Scaling], direction: &Direction, left: f64, price: f64) -> (f64, f64) {
    let (mut primal, mut dual) = (-direction.budget / left, -direction.price / price);
    for (t, s) in scalings.iter().enumerate() {
        let scaled = |m: Dense| {
            let n = m.nrows();
            symmetric(Dense::from_fn(n, n, |i, j| m[(i, j)] / (s.values[i] * s.values[j]).sqrt()))
        };
        primal = primal.max(decrease(scaled(&s.inverse_root * &direction.slacks[t] * s.inverse_root.transpose())));
        dual = dual.max(decrease(scaled(s.root.transpose() * &direction.multipliers[t] * &s.root)));
        primal = primal.max(decrease(direction.covariances[t].clone()));
    }
    let length = |most: f64| if most > FRACTION_TO_BOUNDARY { FRACTION_TO_BOUNDARY / most } else { 1.0 };
    (length(primal), length(dual))
}

/// How much a step lowers the least eigenvalue of the identity; 0 if the full step stays feasible.
fn decrease(step: Dense) -> f64 {
    let n = step.nrows();
    let inside = cholesky(&(Dense::identity(n, n) * FRACTION_TO_BOUNDARY + &step)).is_some();
    if inside { 0.0 } else { -least_eigenvalue(step) }
}

fn slope(gradients: &[Dense], covariances: &[Dense]) -> f64 {
    gradients.iter().zip(covariances).map(|(g, d)| g.dot(d)).sum()
}

/// The merit function: information plus barriers on slacks, covariances and budget (theory, equation L.5).
fn merit(place: &Place, local: &[Local], barrier: f64) -> Option<f64> {
    let left = slack_of_budget(local);
    // Slacks are in coordinates where p_t is the identity: log |Z_t| = log |local slack| + log |p_t|.
    let logs = |(at, g): (&Local, &Dense)| log_determinant(&at.slack_factor) + 2.0 * log_determinant(g);
    let barriers: f64 = local.iter().zip(&place.factors).map(logs).sum();
    let sum = local.iter().map(nats).sum::<f64>() - barrier * (barriers + math::ln(left));
    (left > 0.0 && sum.is_finite()).then_some(sum)
}

/// Takes a step; returns false if it leaves the feasible set.
fn advance(place: &mut Place, direction: &Direction, primal: f64, dual: f64) -> bool {
    for t in 0..place.factors.len() {
        let n = place.factors[t].nrows();
        let Some(c) = cholesky(&(Dense::identity(n, n) + &direction.covariances[t] * primal)) else { return false };
        let multiplier = &place.multipliers[t] + &direction.multipliers[t] * dual;
        place.multipliers[t] = symmetric(c.transpose() * multiplier * &c);
        place.factors[t] = &place.factors[t] * c;
    }
    place.price += dual * direction.price;
    true
}
