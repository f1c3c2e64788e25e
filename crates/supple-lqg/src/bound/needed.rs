//! The minimum information for use in design searches: value and sensitivity, without a proof and without sensors.

use super::horizon::Horizon;
use super::local::nats;
use super::minimum::{covariances, open_loop, place};
use super::nearby::Nearby;
use super::sensitivity::{Sensitivity, Worth};
use super::settings::BoundSettings;
use super::size::Size;
use crate::Error;

/// The precision that searches need: for some horizons rounding allows no better.
const SETTINGS: BoundSettings = BoundSettings { gap: 1e-8, max_iterations: 60 };

/// The minimum information over a horizon at an expected cost, as precisely as searches need it.
///
/// ```
/// use supple_lqg::bound::{Horizon, Needed};
/// use supple_lqg::{constant, sequence};
///
/// // A state of variance 4, and a cost of 1 per unit of variance: 1/2 ln(4 / D) at the cost limit D.
/// let (dynamics, process, initial) = (constant(&[[1.0]]), constant(&[[1.0]]), constant(&[[4.0]]));
/// let horizon = Horizon { dynamics, process, initial, prices: sequence(&[[[1.0]]]), base_cost: 0.0 };
/// let mut nearby = None;
/// for limit in [1.0, 1.1] {
///     // The second search is warm-started from the first.
///     let needed = Needed::of(&horizon, limit, &mut nearby)?;
///     assert!((needed.nats - 0.5 * (4_f64 / limit).ln()).abs() < 1e-4);
/// }
/// # Ok::<(), supple_lqg::Error>(())
/// ```
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Needed {
    /// Nats over the whole horizon.
    pub nats: f64,
    /// A lower bound up to rounding: the dual value.
    pub lower_nats: f64,
    /// Its sensitivity; `None` if no information is needed.
    pub sensitivity: Option<Sensitivity>,
}

impl Needed {
    /// Like [`Needed::of`]; `None` if that would take longer than an evaluation should.
    ///
    /// # Errors
    /// Same as for that function.
    pub fn soon(horizon: &Horizon, cost: f64, nearby: &mut Option<Nearby>) -> Result<Option<Self>, Error> {
        if Size::of(horizon).is_long() {
            return Ok(open_loop(horizon, cost).map(|_| Self::default()));
        }
        Self::of(horizon, cost, nearby).map(Some)
    }

    /// At an expected cost; warm-started from `nearby` if that is set, and replaces it with a new iterate.
    ///
    /// # Errors
    /// As [`minimum_information`](super::minimum_information).
    pub fn of(horizon: &Horizon, cost: f64, nearby: &mut Option<Nearby>) -> Result<Self, Error> {
        if open_loop(horizon, cost).is_some() {
            return Ok(Self::default());
        }
        let (chain, found, budget) = place(horizon, cost, &SETTINGS, nearby.as_ref())?;
        let (_, posterior) = covariances(horizon, &chain, &found);
        let sensitivity =
            Sensitivity::over_horizon(horizon, &Worth::of(&chain, &found), &posterior, -found.place.price / budget);
        let nats = found.local.iter().map(nats).sum();
        if let Some(left) = Nearby::of(&chain, &found, budget) {
            *nearby = Some(left);
        }
        Ok(Self { nats, lower_nats: (nats - found.gap).max(0.0), sensitivity: Some(sensitivity) })
    }
}
