//! What it costs to measure nothing, its derivatives, and the information needed around that cost.
#![allow(clippy::unwrap_used, missing_docs)]

use supple_lqg::Matrices;
use supple_lqg::bound::{BoundSettings, Horizon, minimum_information};

/// A cart whose position is priced.
fn cart(steps: usize) -> Horizon {
    let filled = |count: usize, entries: &dyn Fn(usize) -> [f64; 4]| {
        let mut out = Matrices::zeros(count, 2, 2);
        for t in 0..count {
            (0..4).for_each(|k| out.set(t, k / 2, k % 2, entries(t)[k]));
        }
        out
    };
    Horizon {
        dynamics: filled(steps, &|_| [1.0, 0.1, -0.3, 0.9]),
        process: filled(steps, &|_| [0.01, 0.002, 0.002, 0.03]),
        initial: filled(1, &|_| [0.5, 0.1, 0.1, 0.2]),
        prices: filled(steps, &|t| [1.0 + 0.1 * t as f64, 0.1, 0.1, 0.2]),
        base_cost: 3.0,
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    let horizon = cart(6);
    let found = horizon.unmeasured();
    let near = |change: &dyn Fn(&mut Horizon, f64)| {
        let at = |h: f64| {
            let mut moved = horizon.clone();
            change(&mut moved, h);
            moved.unmeasured().cost
        };
        (at(1e-4) - at(-1e-4)) / 2e-4
    };
    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let add = |to: &mut Matrices, t: usize, h: f64| to.set(t, i, j, to.get(t, i, j) + h);
        for t in 0..6 {
            let pairs = [
                (found.dynamics.get(t, i, j), near(&|at, h| add(&mut at.dynamics, t, h))),
                (found.process.get(t, i, j), near(&|at, h| add(&mut at.process, t, h))),
                (found.prices.get(t, i, j), near(&|at, h| add(&mut at.prices, t, h))),
            ];
            for (exact, difference) in pairs {
                assert!((exact - difference).abs() < 1e-6, "{t}, {i}, {j}: {exact} {difference}");
            }
        }
        let difference = near(&|at, h| add(&mut at.initial, 0, h));
        assert!((found.initial.get(0, i, j) - difference).abs() < 1e-6, "{difference}");
    }
}

/// At this cost and above nothing is needed, below it something is.
#[test]
fn nothing_is_needed_at_this_cost() {
    let horizon = cart(20);
    let cost = horizon.unmeasured().cost;
    let needed = |share: f64| {
        let at = 3.0 + share * (cost - 3.0);
        minimum_information(&horizon, at, &BoundSettings::default()).unwrap().nats
    };
    assert!(needed(1.001) < 1e-9, "{}", needed(1.001));
    assert!(needed(0.98) > 1e-4, "{}", needed(0.98));
    assert!(needed(0.5) > needed(0.9));
}
