//! Proof of a lower bound on the minimum information from a dual point (theory, equation L.30).

use super::frame::Frames;
use super::given::{Dual, Given, next};
use super::interval::Interval;
use super::law::STOPPED;
use super::matrix::{Enclosure, Matrix, enclosed};

/// A proved bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Proved {
    /// Nats, over all decisions, that any sensors and any controller need at least.
    pub nats: f64,
    /// Relative distance of the numbers for which it is proved from those given: 0 if no coordinate is left out.
    pub distance: f64,
}

/// Shares by which the covariance is enlarged so that slopes are positive despite rounding.
const ENLARGED: [f64; 8] = [0.0, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2];

/// The problem in coordinates shared by several dual points, each of which may prove a bound.
pub(crate) struct Proving<'a> {
    given: &'a Given,
    frames: Frames,
}

impl<'a> Proving<'a> {
    /// In the coordinates of a dual point; otherwise the reason why that failed.
    pub fn new(given: &'a Given, dual: &Dual) -> Result<Self, String> {
        if given.stages.len() != dual.steps.len() || given.stages.is_empty() {
            return Err("the dual point has the wrong number of decisions".into());
        }
        Ok(Self { given, frames: Frames::new(given, dual)? })
    }

    /// The best bound that the dual point with this price and these multipliers proves, or the reason why it proves none.
    pub fn information(
        &self,
        price: f64,
        multipliers: &[Matrix],
        is_stopped: &dyn Fn() -> bool,
    ) -> Result<Proved, String> {
        if !(price >= 0.0 && price.is_finite()) {
            return Err("the multiplier of the cost is negative".into());
        }
        let multipliers: Vec<Enclosure> = multipliers.iter().map(enclosed).collect();
        if let Some(t) = multipliers.iter().position(|multiplier| !multiplier.is_positive_semidefinite()) {
            return Err(format!("the multiplier at decision {t} is not proved to be positive semidefinite"));
        }
        let mut best: Option<f64> = None;
        for share in ENLARGED {
            if is_stopped() {
                return Err(STOPPED.into());
            }
            match self.value(price, &multipliers, share) {
                Ok(nats) if best.is_none_or(|best| nats > best) => best = Some(nats),
                Ok(_) => break,
                Err(_) if best.is_some() => break,
                Err(_) => {}
            }
        }
        let distance = self.frames.distance;
        match best {
            Some(nats) => Ok(Proved { nats: nats.max(0.0), distance }),
            None => self.value(price, &multipliers, 0.0).map(|nats| Proved { nats, distance }),
        }
    }

    /// The dual value at the covariances `(1 + share) E E'`; otherwise the reason why it proves nothing.
    fn value(&self, price: f64, multipliers: &[Enclosure], share: f64) -> Result<f64, String> {
        let Frames { locals, initial, .. } = &self.frames;
        let given = self.given;
        let count = locals.len();
        let (half, lambda) = (Interval::point(0.5), Interval::point(price));
        let enlarged = Interval::point(1.0) + Interval::point(share);
        let mut sum = -(lambda * given.budget);
        if let Some(initial) = initial {
            let first = Factored::new(initial).ok_or("the first covariance is not proved to be positive definite")?;
            sum = sum + half * first.log_least - multipliers[0].dot(initial);
        }
        for (t, local) in locals.iter().enumerate() {
            let r = local.price.rows;
            let order = Interval::point(r as f64);
            let shrunk = half * enlarged.recip();
            let mut slope = local.price.scaled(lambda).plus(&multipliers[t]);
            for i in 0..r {
                slope.entries[i * r + i] = slope.entries[i * r + i] - shrunk;
            }
            sum = sum - half * order * enlarged.ln() + half * order;
            if let Some(to) = next(count, given.initial.is_none(), t) {
                let a = &local.dynamics;
                let predicted = a.times(&a.transpose()).scaled(enlarged).plus(&local.process);
                let factored = Factored::new(&predicted).ok_or_else(|| {
                    format!("the covariance before decision {to} is not proved to be positive definite")
                })?;
                let whitened = factored.inverse_root.times(a);
                let known = whitened.transpose().times(&whitened).scaled(half * factored.least_share);
                slope = slope.plus(&known).minus(&a.transpose().around(&multipliers[to]));
                let noise = factored.trace_of_inverse(&local.process);
                sum = sum + half * (factored.log_least + noise)
                    - half * Interval::point(predicted.rows as f64)
                    - multipliers[to].dot(&local.process);
            }
            if !slope.is_positive_semidefinite() {
                return Err(format!(
                    "the slope of the Lagrangian at decision {t} is not proved to be positive semidefinite"
                ));
            }
        }
        if sum.low.is_nan() { Err("numbers overflow".into()) } else { Ok(sum.low) }
    }
}

/// A positive definite matrix `M` with `X M X' = I + R`, `X` a rounded inverse of its Cholesky factor.
struct Factored {
    inverse_root: Enclosure,
    /// A lower bound on `log |M|`.
    log_least: Interval,
    /// A factor `c` for which `M^-1 - c X'X` is positive semidefinite.
    least_share: Interval,
}

impl Factored {
    fn new(m: &Enclosure) -> Option<Self> {
        let n = m.rows;
        let g = m.middle().cholesky()?;
        // Forward substitution.
        let mut x = Matrix::from_fn(n, n, |_, _| 0.0);
        for j in 0..n {
            for i in j..n {
                let known: f64 = (j..i).map(|k| g.at(i, k) * x.at(k, j)).sum();
                let unit = f64::from(u8::from(i == j));
                x.set(i, j, (unit - known) / g.at(i, i));
            }
        }
        let inverse_root = enclosed(&x);
        let rest = inverse_root.around(m).minus(&enclosed(&Matrix::identity(n))).row_sum();
        if rest.is_nan() || rest >= 0.5 {
            return None;
        }
        let (one, order) = (Interval::point(1.0), Interval::point(n as f64));
        let spread = order * (one - Interval::point(rest)).ln();
        let root = (0..n).fold(Interval::ZERO, |sum, i| sum + Interval::point(x.at(i, i)).ln());
        let log_least = spread - root - root;
        let least_share = (one + Interval::point(rest)).recip();
        Some(Self { inverse_root, log_least, least_share: Interval::point(least_share.low) })
    }

    /// A lower bound on `Tr(M^-1 w)` for a positive semidefinite `w`.
    fn trace_of_inverse(&self, w: &Enclosure) -> Interval {
        let whitened = self.inverse_root.around(w);
        let trace = (0..whitened.rows).fold(Interval::ZERO, |sum, i| sum + whitened.at(i, i));
        trace * self.least_share
    }
}
