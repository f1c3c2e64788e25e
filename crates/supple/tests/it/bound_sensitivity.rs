//! Derivatives of the least information against differences of problems solved again.

use crate::common::bound::{tanaka, tanaka_horizon};
use supple::Matrices;
use supple::bound::{BoundSettings, Horizon, Stationary, minimum_information, stationary_minimum};

const SETTINGS: BoundSettings = BoundSettings { gap: 2e-9, max_iterations: 200 };

/// The central difference of `value` by a step of one number.
fn difference(step: f64, value: impl Fn(f64) -> f64) -> f64 {
    // Richardson's, of the fourth order.
    let central = |h: f64| (value(h) - value(-h)) / (2.0 * h);
    (4.0 * central(step) - central(2.0 * step)) / 3.0
}

fn assert_close(found: f64, expected: f64, scale: f64, what: &str) {
    assert!((found - expected).abs() < 1e-5 * scale, "{what}: {found} and {expected}, of {scale}");
}

fn largest(of: &Matrices) -> f64 {
    (0..of.count()).flat_map(|t| of.at(t).to_vec()).fold(0.0, |a: f64, b| a.max(b.abs()))
}

/// A matrix with two entries moved, or one on the diagonal: symmetric ones stay so.
fn moved(of: &Matrices, t: usize, places: &[(usize, usize)], by: f64) -> Matrices {
    let mut out = of.clone();
    places.iter().for_each(|&(i, j)| out.set(t, i, j, of.get(t, i, j) + by));
    out
}

#[test]
fn of_a_steady_state() {
    let (system, known) = tanaka();
    let cost = 50.0 - known;
    let minimum = |system: &Stationary, cost: f64| stationary_minimum(system, cost, &SETTINGS).unwrap();
    let found = minimum(&system, cost).sensitivity(&system);
    let by_cost = difference(1e-3, |h| minimum(&system, cost + h).nats);
    assert_close(found.cost, by_cost, by_cost.abs(), "cost");
    for (i, j) in [(0, 0), (1, 2), (3, 1)] {
        let by = difference(2e-4, |h| {
            let dynamics = moved(&system.dynamics, 0, &[(i, j)], h);
            minimum(&Stationary { dynamics, ..system.clone() }, cost).nats
        });
        assert_close(found.dynamics.get(0, i, j), by, largest(&found.dynamics), "dynamics");
        let both: &[(usize, usize)] = if i == j { &[(i, j)] } else { &[(i, j), (j, i)] };
        let times = both.len() as f64;
        let by = difference(1e-3, |h| {
            minimum(&Stationary { process: moved(&system.process, 0, both, h), ..system.clone() }, cost).nats
        });
        assert_close(times * found.process.get(0, i, j), by, largest(&found.process), "process");
        let by = difference(1e-3, |h| {
            minimum(&Stationary { price: moved(&system.price, 0, both, h), ..system.clone() }, cost).nats
        });
        assert_close(times * found.prices.get(0, i, j), by, largest(&found.prices), "price");
    }
}

#[test]
fn of_a_horizon_by_step() {
    let (horizon, _) = tanaka_horizon(5);
    let cost = 48.0 * 5.0;
    let steps = |m: &Matrices| {
        let mut out = Matrices::zeros(5, 4, 4);
        for (t, i, j) in (0..5).flat_map(|t| (0..4).flat_map(move |i| (0..4).map(move |j| (t, i, j)))) {
            out.set(t, i, j, m.get(t, i, j));
        }
        out
    };
    let horizon = Horizon { dynamics: steps(&horizon.dynamics), process: steps(&horizon.process), ..horizon };
    let minimum = |horizon: &Horizon, cost: f64| minimum_information(horizon, cost, &SETTINGS).unwrap();
    let found = minimum(&horizon, cost).sensitivity(&horizon);
    let by_cost = difference(1e-2, |h| minimum(&horizon, cost + h).nats);
    assert_close(found.cost, by_cost, by_cost.abs(), "cost");
    let by = difference(1e-2, |h| minimum(&Horizon { base_cost: horizon.base_cost + h, ..horizon.clone() }, cost).nats);
    assert_close(-found.cost, by, by_cost.abs(), "least cost");
    for (t, i, j) in [(0, 1, 1), (2, 0, 3), (3, 2, 1)] {
        let by = difference(2e-4, |h| {
            minimum(&Horizon { dynamics: moved(&horizon.dynamics, t, &[(i, j)], h), ..horizon.clone() }, cost).nats
        });
        assert_close(found.dynamics.get(t, i, j), by, largest(&found.dynamics), "dynamics");
        let by = difference(1e-3, |h| {
            minimum(&Horizon { process: moved(&horizon.process, t, &[(i, i)], h), ..horizon.clone() }, cost).nats
        });
        assert_close(found.process.get(t, i, i), by, largest(&found.process), "process");
        let by = difference(1e-3, |h| {
            minimum(&Horizon { prices: moved(&horizon.prices, t, &[(i, i)], h), ..horizon.clone() }, cost).nats
        });
        assert_close(found.prices.get(t, i, i), by, largest(&found.prices), "prices");
        let by = difference(1e-3, |h| {
            minimum(&Horizon { initial: moved(&horizon.initial, 0, &[(j, j)], h), ..horizon.clone() }, cost).nats
        });
        assert_close(found.initial.get(0, j, j), by, largest(&found.initial).max(0.1), "initial");
    }
}
