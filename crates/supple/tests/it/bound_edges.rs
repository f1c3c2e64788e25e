//! The least directed information where problems are at their limits: right answers, or errors that say what to change.

use crate::common::bound::{dense, finite, horizon_of, matrix, sequence, tanaka_horizon};
use nalgebra::DMatrix;
use serde_json::Value as Json;
use supple::Matrices;
use supple::bound::{BoundSettings, Horizon, Stationary, minimum_information, stationary_minimum};
use supple::lqg;

fn minimum(horizon: &Horizon, cost: f64) -> f64 {
    let found = minimum_information(horizon, cost, &BoundSettings::default()).unwrap();
    assert!(found.nats - found.lower_nats < 1e-6 * horizon.steps() as f64, "{} {}", found.nats, found.lower_nats);
    assert!(found.cost <= cost * (1.0 + 1e-12));
    found.nats
}

fn scalar(dynamics: f64, process: f64, initial: f64, price: f64, steps: usize) -> Horizon {
    let one = |v: f64| matrix(1, 1, |_, _| v);
    let prices = sequence(&vec![DMatrix::from_element(1, 1, price); steps]);
    Horizon { dynamics: one(dynamics), process: one(process), initial: one(initial), prices, base_cost: 0.0 }
}

fn rescaled(horizon: &Horizon, by: &[f64], cost: f64) -> Horizon {
    let all = |m: &Matrices, entry: &dyn Fn(f64, usize, usize) -> f64| {
        let parts: Vec<DMatrix<f64>> = (0..m.count())
            .map(|t| {
                let a = dense(m, t);
                DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| entry(a[(i, j)], i, j))
            })
            .collect();
        if m.is_constant() { matrix(m.rows(), m.cols(), |i, j| parts[0][(i, j)]) } else { sequence(&parts) }
    };
    Horizon {
        dynamics: all(&horizon.dynamics, &|v, i, j| v * by[i] / by[j]),
        process: all(&horizon.process, &|v, i, j| v * by[i] * by[j]),
        initial: all(&horizon.initial, &|v, i, j| v * by[i] * by[j]),
        prices: all(&horizon.prices, &|v, i, j| v * cost / by[i] / by[j]),
        base_cost: horizon.base_cost * cost,
    }
}

#[test]
fn one_decision_is_water_filling() {
    let h = Horizon {
        initial: matrix(2, 2, |i, j| [[4.0, 0.0], [0.0, 0.01]][i][j]),
        prices: sequence(&[DMatrix::identity(2, 2)]),
        dynamics: matrix(2, 2, |i, j| f64::from(u8::from(i == j))),
        process: matrix(2, 2, |_, _| 0.0),
        base_cost: 1.0,
    };
    // Only the first is measured: 4 down to 0.09.
    assert!((minimum(&h, 1.1) - 0.5 * (4.0f64 / 0.09).ln()).abs() < 1e-6);
    // Both are: down to 0.005 each.
    assert!((minimum(&h, 1.01) - 0.5 * (800.0f64 * 2.0).ln()).abs() < 1e-6);
    assert_eq!(minimum(&h, 5.02), 0.0);
}

#[test]
fn costs_below_the_least_are_refused() {
    let (h, _) = tanaka_horizon(5);
    for cost in [h.base_cost * 0.9, h.base_cost, f64::NEG_INFINITY] {
        let error = minimum_information(&h, cost, &BoundSettings::default()).unwrap_err();
        assert!(matches!(error, lqg::Error::CostBelowLeast { .. } | lqg::Error::NoBound { .. }), "{error}");
    }
    let near = minimum(&h, h.base_cost * (1.0 + 1e-6));
    assert!(near > 5.0 * 4.0 * 0.5 * 1e4f64.ln(), "{near}");
}

#[test]
fn what_is_not_a_number_or_not_a_covariance_is_refused() {
    let (good, _) = tanaka_horizon(3);
    let spoilt = |change: &dyn Fn(&mut Horizon)| {
        let mut h = good.clone();
        change(&mut h);
        minimum_information(&h, 1e3, &BoundSettings::default()).unwrap_err().to_string()
    };
    assert!(spoilt(&|h| h.dynamics.set(0, 1, 2, f64::NAN)).contains("dynamics is not finite"));
    assert!(spoilt(&|h| h.prices.set(2, 0, 0, f64::INFINITY)).contains("prices"));
    assert!(spoilt(&|h| h.base_cost = f64::NAN).contains("least expected cost"));
    assert!(spoilt(&|h| h.process.set(0, 0, 0, -1.0)).contains("process covariance"));
    assert!(spoilt(&|h| h.initial.set(0, 0, 1, 0.5)).contains("first state"));
    assert!(spoilt(&|h| h.prices.set(1, 3, 3, -1.0)).contains("state uncertainty"));
    assert!(spoilt(&|h| h.process = Matrices::constant(3, 3)).contains("not 4"));
    assert!(
        spoilt(&|h| h.dynamics = Matrices::zeros(1, 4, 4)).contains("the sequence of the dynamics has length 1, not 2")
    );
    assert!(minimum_information(&good, f64::NAN, &BoundSettings::default()).is_err());
}

#[test]
fn units_do_not_matter() {
    let golden: Vec<Json> = serde_json::from_str(include_str!("../golden/bound.json")).unwrap();
    for case in golden.iter().step_by(3) {
        let h = horizon_of(case);
        let (n, budget) = (h.prices.rows(), case["budget"].as_f64().unwrap());
        let expected = minimum(&h, budget);
        for (first, ratio, cost) in [(1e12, 1.0, 1.0), (1e-12, 1.0, 1e12), (1e6, 1e-4, 1e-12), (1e-12, 1e8, 1.0)] {
            let by: Vec<f64> = (0..n).map(|i| first * f64::powi(ratio, i as i32)).collect();
            let found = minimum(&rescaled(&h, &by, cost), budget * cost);
            assert!((found - expected).abs() < 1e-5 * expected.max(1.0), "{} {by:?}: {found} {expected}", case["seed"]);
        }
    }
}

#[test]
fn nothing_to_know_needs_nothing() {
    // No covariance at all, no price, no budget used.
    assert_eq!(minimum(&scalar(2.0, 0.0, 0.0, 1.0, 4), 1e-9), 0.0);
    assert_eq!(minimum(&scalar(2.0, 1.0, 1.0, 0.0, 600), 1e-9), 0.0);
    assert_eq!(minimum(&scalar(0.5, 1.0, 0.0, 1.0, 1), 1e-9), 0.0);
}

/// Without noise all is learnt once: 1/2 log of what the first covariance must shrink by.
#[test]
fn without_noise_all_is_learnt_once() {
    // P_t = 4^t p while nothing more is measured; the price is on the last only.
    let mut h = scalar(2.0, 0.0, 3.0, 0.0, 6);
    h.prices.set(5, 0, 0, 1.0);
    assert!((minimum(&h, 0.1) - 0.5 * (3.0 * 1024.0f64 / 0.1).ln()).abs() < 1e-5);
    // A first covariance of 0 that noise fills.
    let mut h = scalar(0.0, 2.0, 0.0, 0.0, 2);
    h.prices.set(1, 0, 0, 1.0);
    assert!((minimum(&h, 0.1) - 0.5 * 20.0f64.ln()).abs() < 1e-6);
}

#[test]
fn long_unstable_horizons_do_not_overflow() {
    let h = scalar(5.0, 1.0, 1.0, 1.0, 500);
    let rate = minimum(&h, 500.0 * 0.5) / 500.0;
    // Stationary: 1/2 log(25 + 1 / p) at p = 1/2; the first decision differs.
    assert!((rate - 0.5 * 27.0f64.ln()).abs() < 5e-3, "{rate}");
}

#[test]
fn states_without_a_price_need_nothing() {
    let (plain, _) = tanaka_horizon(12);
    // A fifth state that grows and is driven, sees the others, and costs nothing.
    let wide = |m: &Matrices, entry: &dyn Fn(usize, usize) -> f64| {
        let of = |t: usize| DMatrix::from_fn(5, 5, |i, j| if i < 4 && j < 4 { m.get(t, i, j) } else { entry(i, j) });
        if m.is_constant() {
            matrix(5, 5, |i, j| of(0)[(i, j)])
        } else {
            sequence(&(0..m.count()).map(of).collect::<Vec<_>>())
        }
    };
    let h = Horizon {
        dynamics: wide(&plain.dynamics, &|i, j| {
            if (i, j) == (4, 4) {
                1.7
            } else if i == 4 {
                0.3
            } else {
                0.0
            }
        }),
        process: wide(&plain.process, &|i, j| f64::from(u8::from(i == j))),
        initial: wide(&plain.initial, &|i, j| f64::from(u8::from(i == j))),
        prices: wide(&plain.prices, &|_, _| 0.0),
        base_cost: plain.base_cost,
    };
    let cost = 45.0 * 12.0;
    assert!((minimum(&h, cost) - minimum(&plain, cost)).abs() < 1e-5);
}

fn stationary(a: &[[f64; 2]; 2], w: [f64; 2], price: [f64; 2]) -> Stationary {
    let diagonal = |v: [f64; 2]| matrix(2, 2, |i, j| if i == j { v[i] } else { 0.0 });
    let dynamics = matrix(2, 2, |i, j| a[i][j]);
    let unpriced = Matrices::constant(2, 0);
    Stationary {
        dynamics,
        process: diagonal(w),
        price: diagonal(price),
        base_cost: 0.0,
        unpriced,
        costly: Matrices::constant(0, 2),
    }
}

#[test]
fn stationary_modes_at_their_limits() {
    let settings = BoundSettings::default();
    let rate = |s: &Stationary, cost: f64| {
        let found = stationary_minimum(s, cost, &settings).unwrap();
        assert!(found.nats - found.lower_nats < 1e-6, "{} {}", found.nats, found.lower_nats);
        found.nats
    };
    // One driven state: p = cost, 1/2 log(a^2 + w / p).
    let of_one = |a: f64, w: f64, p: f64| 0.5 * (a * a + w / p).ln();
    // The other is driven and grows and costs nothing: it needs nothing.
    let free = stationary(&[[1.5, 0.0], [0.4, 2.0]], [1.0, 1.0], [1.0, 0.0]);
    assert!((rate(&free, 0.5) - of_one(1.5, 1.0, 0.5)).abs() < 1e-6);
    // The other is not driven and shrinks, or stays: it is known in the end.
    for mode in [0.5, 1.0] {
        let known = stationary(&[[1.5, 0.0], [0.0, mode]], [1.0, 0.0], [1.0, 1.0]);
        assert!((rate(&known, 0.5) - of_one(1.5, 1.0, 0.5)).abs() < 1e-6);
    }
    // The other is not driven and grows: its rate is log|lambda|, at no cost.
    let grows = stationary(&[[1.5, 0.0], [0.0, 3.0]], [1.0, 0.0], [1.0, 1.0]);
    assert!((rate(&grows, 0.5) - of_one(1.5, 1.0, 0.5) - 3.0f64.ln()).abs() < 1e-5);
    // Nothing grows and the cost is that of no sensor.
    let calm = stationary(&[[0.5, 0.0], [0.0, 0.5]], [1.0, 1.0], [1.0, 1.0]);
    assert_eq!(rate(&calm, 8.0 / 3.0 + 1e-9), 0.0);
    assert!((rate(&calm, 1.0) - 2.0 * of_one(0.5, 1.0, 0.5)).abs() < 1e-6);
    // No noise at all.
    assert_eq!(rate(&stationary(&[[0.5, 0.0], [0.0, 0.5]], [0.0; 2], [1.0; 2]), 1.0), 0.0);
    // Scales of states and costs.
    for by in [1e-12, 1e-6, 1e6, 1e12] {
        let mut s = stationary(&[[1.5, 0.3 * by], [0.0, 0.7]], [1.0, 1.0 / by / by], [1.0, 0.2 * by * by]);
        let expected = rate(&stationary(&[[1.5, 0.3], [0.0, 0.7]], [1.0, 1.0], [1.0, 0.2]), 0.8);
        assert!((rate(&s, 0.8) - expected).abs() < 1e-6, "{by}");
        s.price = matrix(2, 2, |i, j| s.price.get(0, i, j) * by);
        assert!((rate(&s, 0.8 * by) - expected).abs() < 1e-6, "{by}");
    }
}

#[test]
fn regulators_at_their_limits() {
    let one = matrix(1, 1, |_, _| 1.0);
    // No control reaches a state that grows and costs.
    let lost =
        Stationary::new(&matrix(1, 2, |_, j| [2.0, 0.0][j]), &one, &matrix(2, 2, |i, j| f64::from(u8::from(i == j))));
    assert!(lost.unwrap_err().to_string().contains("no regulator"));
    // Controls without a price of their own: S = Q, Xi = A'QA.
    let cheap = Stationary::new(
        &matrix(1, 2, |_, j| [2.0, 1.0][j]),
        &one,
        &matrix(2, 2, |i, j| if i + j == 0 { 2.0 } else { 0.0 }),
    );
    let cheap = cheap.unwrap();
    assert!((cheap.base_cost - 1.0).abs() < 1e-9 && (cheap.price.get(0, 0, 0) - 4.0).abs() < 1e-8, "{cheap:?}");
    // A state that grows and costs nothing has no price.
    let joint = matrix(2, 3, |i, j| [[1.2, 0.0, 1.0], [0.0, 3.0, 1.0]][i][j]);
    let cost = matrix(3, 3, |i, j| if i == j && i != 1 { 1.0 } else { 0.0 });
    let unseen = Stationary::new(&joint, &matrix(2, 2, |i, j| f64::from(u8::from(i == j))), &cost).unwrap();
    assert_eq!(unseen.price.get(0, 1, 1), 0.0);
    let broken = Stationary::new(&joint, &matrix(2, 2, |_, _| f64::NAN), &cost);
    assert!(broken.is_err());
}

/// Certificates against points that are feasible: no lower bound is above what any of them needs.
#[test]
fn no_feasible_point_is_below_the_lower_bound() {
    let a = DMatrix::from_row_slice(3, 3, &[0.9, 0.5, 0.0, -0.2, 1.2, 0.3, 0.1, 0.0, 0.7]);
    let (h, _) = finite(&a, &DMatrix::identity(3, 3), &(DMatrix::identity(3, 3) * 0.2), 6);
    for loose in [1.02, 1.1, 1.3, 2.0] {
        // Ended early: the bounds must hold all the same.
        for max_iterations in [6, 10, 14, 100] {
            let settings = BoundSettings { max_iterations, ..Default::default() };
            let Ok(found) = minimum_information(&h, h.base_cost * loose, &settings) else { continue };
            let best = minimum(&h, h.base_cost * loose);
            assert!(found.lower_nats <= best + 1e-12 && found.nats >= best - 1e-6, "{loose} {max_iterations}");
            for seed in 0..200u32 {
                let Some(nats) = feasible(&h, &found.posterior, h.base_cost * loose, seed) else { continue };
                assert!(found.lower_nats <= nats, "{loose} {max_iterations} {seed}");
            }
        }
    }
}

/// What covariances near those given, pushed about and inside of all limits, need; none where they cost too much.
fn feasible(h: &Horizon, near: &Matrices, cost: f64, seed: u32) -> Option<f64> {
    let (n, mut state) = (near.rows(), seed);
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24) - 0.5
    };
    let (mut predicted, mut nats, mut spent) = (dense(&h.initial, 0), 0.0, h.base_cost);
    let size = [1e-4, 1e-2, 0.3][seed as usize % 3];
    for t in 0..h.steps() {
        let push = DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) + size * next());
        // (P^-1 + Pbar^-1 / 10^6)^-1 stays below the prediction once the prediction's share is large enough.
        let wished = &push * dense(near, t) * push.transpose();
        let mut p = wished.clone();
        while (&predicted - &p).symmetric_eigenvalues().min() < 0.0 {
            p *= 0.98;
        }
        nats += 0.5 * (predicted.determinant() / p.determinant()).ln();
        spent += (dense(&h.prices, t) * &p).trace();
        predicted = dense(&h.dynamics, t) * &p * dense(&h.dynamics, t).transpose() + dense(&h.process, t);
    }
    (spent <= cost).then_some(nats)
}
