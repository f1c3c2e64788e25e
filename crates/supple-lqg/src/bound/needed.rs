//! The least information as searches need it: its value and how it changes, without a proof and without sensors.

use super::horizon::Horizon;
use super::local::nats;
use super::minimum::{covariances, open_loop, place};
use super::nearby::Nearby;
use super::sensitivity::{Sensitivity, Worth};
use super::settings::BoundSettings;
use super::size::Size;
use crate::Error;

/// How precisely searches need it: rounding leaves no more of some horizons.
const SETTINGS: BoundSettings = BoundSettings { gap: 1e-8, max_iterations: 60 };

/// The least information over a horizon at an expected cost, as far as searches need it.
#[derive(Clone, Debug, Default)]
pub struct Needed {
    /// Nats over the whole horizon.
    pub nats: f64,
    /// What it is certainly not below, but for rounding: the value of the dual.
    pub lower_nats: f64,
    /// How it changes; none where nothing need be known.
    pub sensitivity: Option<Sensitivity>,
}

impl Needed {
    /// As [`Needed::of`]; none where that would take longer than evaluations should.
    ///
    /// # Errors
    /// As that.
    pub fn soon(horizon: &Horizon, cost: f64, nearby: &mut Option<Nearby>) -> Result<Option<Self>, Error> {
        if Size::of(horizon).is_long() {
            return Ok(open_loop(horizon, cost).map(|_| Self::default()));
        }
        Self::of(horizon, cost, nearby).map(Some)
    }

    /// At an expected cost, from a place nearby where there is one, in whose stead another is left.
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
