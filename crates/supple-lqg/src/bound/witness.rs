//! A dual point, in the form in which the proof of the lower bound uses it.

use super::interior::Found;
use super::reduce::Chain;
use crate::dense::{Dense, cholesky, congruence, eigen, solve_lower, symmetric};

/// A dual point and its covariances, from which [`super::verify`] proves a lower bound.
#[derive(Clone, Debug)]
pub(super) struct Witness {
    /// At each decision.
    pub steps: Vec<WitnessStep>,
    /// The multiplier of the budget, nats per cost.
    price: f64,
    /// Whether the only decision is its own successor.
    wraps: bool,
}

/// One decision.
#[derive(Clone, Debug)]
pub(super) struct WitnessStep {
    /// `E`, n x n_t: `P = E E'`.
    pub basis: Dense,
    /// States that never affect the cost, n x k.
    pub unseen: Dense,
    /// The multiplier of `P <= Pbar` in these coordinates, n_t x n_t.
    multiplier: Dense,
    /// `A` from these coordinates to those of the next decision.
    dynamics: Dense,
    /// `Pbar - P`.
    slack: Dense,
}

/// Directions that are measured with at least this signal-to-noise ratio keep their multipliers.
const MEASURED: f64 = 1e-3;

/// The relative increase of the budget's price for each nat of margin.
const DEARER: f64 = 10.0;

/// Maximum number of steps towards the covariances that minimise the Lagrangian, and the largest change in one step.
const STEPS: usize = 3;
const LONGEST: f64 = 0.3;

/// If noise hardly drives a pair of directions, the Lagrangian is flat along them, and no step is taken there.
const FLAT: f64 = 1e-6;

impl Witness {
    /// That of a place.
    pub fn new(chain: &Chain, found: &Found, budget: f64) -> Self {
        let step = |t: usize| WitnessStep {
            basis: &chain.stages[t].basis * &found.place.factors[t],
            unseen: chain.stages[t].unseen.clone(),
            multiplier: symmetric(found.place.multipliers[t].clone()),
            dynamics: found.local[t].dynamics.clone(),
            slack: found.local[t].slack.clone(),
        };
        let steps = (0..chain.stages.len()).map(step).collect();
        Self { steps, price: found.place.price / budget, wraps: chain.wraps }
    }

    /// The same with the covariances that minimise the Lagrangian of its multipliers: it may be provable where the iterate
    /// itself is not.
    pub fn settled(chain: &Chain, found: &Found, budget: f64) -> Self {
        let changes: Vec<Dense> = (0..chain.stages.len()).map(|t| least(chain, found, t)).collect();
        let step = |t: usize| {
            let change = &changes[t];
            let slack = solve_lower(change, found.local[t].slack.clone());
            let slack = symmetric(solve_lower(change, slack.transpose()));
            // In the directions of the slack the multiplier is nearly diagonal: its small entries are not rounding of the
            // large.
            let turned =
                eigen(slack.clone()).map_or_else(|| Dense::identity(slack.nrows(), slack.nrows()), |e| e.eigenvectors);
            (change * &turned, congruence(&turned.transpose(), &slack))
        };
        let (bases, slacks): (Vec<Dense>, Vec<Dense>) = (0..chain.stages.len()).map(step).unzip();
        let steps = bases.iter().zip(slacks).enumerate().map(|(t, (basis, slack))| {
            // A decision at which nothing is uncertain has no coordinates, and an empty matrix has no inverse.
            let next = chain.next(t).map(|next| &bases[next]).filter(|next| !next.is_empty());
            let dynamics = next.map(|next| next.clone().lu().solve(&(&found.local[t].dynamics * basis)));
            WitnessStep {
                basis: &chain.stages[t].basis * &found.place.factors[t] * basis,
                unseen: chain.stages[t].unseen.clone(),
                multiplier: raised(congruence(&basis.transpose(), &found.place.multipliers[t])),
                dynamics: dynamics.flatten().unwrap_or_else(|| Dense::zeros(0, basis.ncols())),
                slack,
            }
        });
        Self { steps: steps.collect(), price: found.place.price / budget, wraps: chain.wraps }
    }

    /// The price of the budget and the multipliers, with `margin` accumulated in all unmeasured directions, to make up
    /// for rounding in the slope of the Lagrangian; costs hardly anything, because the multiplier's slack is small there.
    pub fn with_margin(&self, margin: f64) -> Option<(f64, Vec<Dense>)> {
        let mut multipliers: Vec<Dense> = self.steps.iter().map(|step| step.multiplier.clone()).collect();
        if margin > 0.0 {
            let more = if self.wraps { self.steady_margin()? } else { self.margins()? };
            multipliers.iter_mut().zip(more).for_each(|(multiplier, more)| *multiplier += more * margin);
        }
        Some((self.price * (1.0 + DEARER * margin), multipliers))
    }

    /// `X_t = Pi_t (I + A_t' X_{t+1} A_t) Pi_t`.
    fn margins(&self) -> Option<Vec<Dense>> {
        let mut out: Vec<Dense> = Vec::with_capacity(self.steps.len());
        for step in self.steps.iter().rev() {
            let kept = step.unmeasured()?;
            let carried = match out.last() {
                None => kept,
                Some(next) => symmetric(&kept + congruence(&(&step.dynamics * &kept).transpose(), next)),
            };
            out.push(carried);
        }
        out.reverse();
        out.iter().all(|more| more.norm().is_finite()).then_some(out)
    }

    /// The same if the only decision is its own successor, by doubling.
    fn steady_margin(&self) -> Option<Vec<Dense>> {
        let kept = self.steps.first()?.unmeasured()?;
        let (mut a, mut sum) = (&self.steps[0].dynamics * &kept, kept);
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
}

impl WitnessStep {
    /// The projector onto the directions that are not measured.
    fn unmeasured(&self) -> Option<Dense> {
        let eigen = eigen(self.slack.clone())?;
        let kept: Vec<usize> = (0..eigen.eigenvalues.len()).filter(|&k| eigen.eigenvalues[k] < MEASURED).collect();
        let basis = eigen.eigenvectors.select_columns(&kept);
        Some(&basis * basis.transpose())
    }
}

/// A lower factor, in coordinates where the covariance of the iterate is the identity, of the covariance that minimises
/// `1/2 log |A P A' + W| - 1/2 log |P| + Tr(M P)`, by Newton's steps: at the iterate itself the slope is as large
/// as the residual of the search.
fn least(chain: &Chain, found: &Found, t: usize) -> Dense {
    let (at, place) = (&found.local[t], &found.place);
    let n = at.price.nrows();
    let identity = Dense::identity(n, n);
    let Some(next) = chain.next(t) else { return identity };
    let of_next = &place.multipliers[next];
    let m = symmetric(&at.price * place.price + &place.multipliers[t] - congruence(&at.dynamics.transpose(), of_next));
    let process = &found.local[next].predicted - &at.dynamics * at.dynamics.transpose();
    let mut factor = identity.clone();
    for _ in 0..STEPS {
        let a = &at.dynamics * &factor;
        let Some(predicted) = cholesky(&symmetric(&a * a.transpose() + &process)) else { break };
        let half = solve_lower(&predicted, a);
        let Some(known) = eigen(symmetric(half.transpose() * &half)) else { break };
        let (y, q) = (known.eigenvalues, known.eigenvectors);
        let slope = q.transpose() * congruence(&factor.transpose(), &m) * &q;
        let step = Dense::from_fn(n, n, |i, j| {
            let curvature = 0.5 * (1.0 - y[i] * y[j]);
            let diagonal = if i == j { 0.5 * (y[i] - 1.0) } else { 0.0 };
            if curvature > FLAT { -(slope[(i, j)] + diagonal) / curvature } else { 0.0 }
        });
        if !step.iter().all(|entry| entry.is_finite()) || step.amax() > LONGEST {
            break;
        }
        let Some(change) = cholesky(&symmetric(&identity + &q * step * q.transpose())) else { break };
        factor *= change;
    }
    factor
}

/// A multiplier with its diagonal raised so that it is positive definite despite rounding.
fn raised(mut multiplier: Dense) -> Dense {
    let n = multiplier.nrows();
    let size = (0..n).map(|i| multiplier[(i, i)].abs()).fold(0.0, f64::max);
    (0..n).for_each(|i| multiplier[(i, i)] += 4.0 * n as f64 * f64::EPSILON * size);
    multiplier
}
