//! The least directed information against pinned numbers: Tanaka's plant, and what cvxpy finds for random horizons.

use crate::common::bound::{horizon_of, matrix, tanaka, tanaka_horizon};
use serde_json::Value as Json;
use supple::bound::{BoundSettings, Stationary, minimum_information, stationary_minimum};

/// Nats in a bit.
const BITS: f64 = std::f64::consts::LN_2;

#[test]
fn tanaka_stationary() {
    let (system, known) = tanaka();
    assert!((system.base_cost + known - 31.48334).abs() < 1e-5, "{}", system.base_cost + known);
    let pinned = [
        (33.0, 6.1727, 3),
        (35.0, 4.5742, 2),
        (40.0, 3.2719, 2),
        (50.0, 2.3595, 2),
        (60.0, 1.9437, 1),
        (80.0, 1.6031, 1),
        (100.0, 1.4631, 1),
        (200.0, 1.2770, 1),
        (1000.0, 1.1861, 1),
    ];
    for (cost, bits, rank) in pinned {
        let found = stationary_minimum(&system, cost - known, &BoundSettings::default()).unwrap();
        assert!((found.nats / BITS - bits).abs() < 2e-4, "{cost}: {} bits", found.nats / BITS);
        assert!(found.nats - found.lower_nats < 1e-6 * BITS && found.cost <= cost - known);
        assert_eq!(found.virtual_sensor().rank, rank, "{cost}");
    }
}

/// `x+ = a x + u + w`, unit noise, with the cost `x+^2 + u^2` per step.
#[test]
fn scalar_stationary() {
    for (a, cost, bits) in [(1.5, 3.1562392, 1.6893249), (0.8, 1.6439429, 0.6580039)] {
        let joint = matrix(1, 2, |_, j| [a, 1.0][j]);
        let price = matrix(2, 2, |i, j| 2.0 * [[a * a, a], [a, 2.0]][i][j]);
        let system = Stationary::new(&joint, &matrix(1, 1, |_, _| 1.0), &price).unwrap();
        let found = stationary_minimum(&system, cost - 1.0, &BoundSettings::default()).unwrap();
        assert!((found.nats / BITS - bits).abs() < 1e-6, "{a}: {} bits", found.nats / BITS);
    }
}

#[test]
fn tanaka_finite() {
    for (steps, cost, bits) in
        [(10, 40.0, 2.61241), (20, 40.0, 2.93752), (10, 80.0, 1.11315), (20, 80.0, 1.35806), (2, 80.0, 0.0)]
    {
        let found =
            minimum_information(&tanaka_horizon(steps).0, cost * steps as f64, &BoundSettings::default()).unwrap();
        let gap = (found.nats - found.lower_nats) / BITS / steps as f64;
        assert!((found.nats / BITS / steps as f64 - bits).abs() < 2e-4 && gap < 1e-6);
    }
}

#[test]
fn random_horizons_against_cvxpy() {
    let golden: Vec<Json> = serde_json::from_str(include_str!("../golden/bound.json")).unwrap();
    assert!(golden.len() >= 50);
    let mut differences = Vec::new();
    for case in &golden {
        let horizon = horizon_of(case);
        let (seed, budget, nats) = (&case["seed"], case["budget"].as_f64().unwrap(), case["nats"].as_f64().unwrap());
        let found = minimum_information(&horizon, budget, &BoundSettings::default()).unwrap();
        let gap = found.nats - found.lower_nats;
        assert!(gap <= 1e-7 * horizon.steps() as f64, "seed {seed}: gap {gap:e}");
        // Its covariances are feasible to 1e-6, and close to the best.
        assert!(found.lower_nats <= nats + 2e-6 * nats.max(1.0), "seed {seed}: {} above {nats}", found.lower_nats);
        let difference = (found.nats - nats).abs() / nats.max(1.0);
        assert!(difference < 1e-4, "seed {seed}: {} against {nats}", found.nats);
        differences.push(difference);
    }
    differences.sort_by(f64::total_cmp);
    assert!(differences[differences.len() * 8 / 10] < 1e-6, "{differences:?}");
}
