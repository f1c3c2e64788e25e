//! What does not fit is refused, with its name, what was found and what is valid.
#![allow(clippy::unwrap_used)]

use supple_lqg::bound::{BoundSettings, Horizon, Needed, Stationary, minimum_information, stationary_minimum};
use supple_lqg::sensors::{Candidate, Plant, Selection};
use supple_lqg::{
    Belief, Dimensions, Error, Information, Knots, LinearQuadratic, Matrices, Noise, Policy, Regularisation, constant,
    control_information, information, kalman, sequence, solve_riccati, spectral_radius,
};

const STEPS: usize = 10;

fn plant() -> (Knots, Noise) {
    let (a, b, c) = ([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]], [[1.0, 0.0]]);
    let plant = LinearQuadratic { a: &a, b: &b, c: &c, q: &[[1.0, 0.0], [0.0, 0.1]], r: &[[0.01]] };
    let noise =
        Noise { initial: diagonal(0.01, 0.01), process: diagonal(1e-6, 1e-4), measurement: constant(&[[1e-4]]) };
    (Knots::linear(STEPS, plant).unwrap(), noise)
}

fn diagonal(first: f64, second: f64) -> Matrices {
    constant(&[[first, 0.0], [0.0, second]])
}

fn solved(knots: &Knots) -> Policy {
    let mut policy = Policy::zeros(knots.dimensions, knots.steps());
    solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy).unwrap();
    policy
}

fn filtered(knots: &Knots, noise: &Noise) -> Result<Belief, Error> {
    let Dimensions { states, measurements, .. } = knots.dimensions;
    let mut belief = Belief::zeros(states, measurements, knots.steps());
    kalman(knots, noise, &mut belief).map(|()| belief)
}

fn refused<T>(found: Result<T, Error>) -> String {
    found.err().map_or_else(|| "accepted".into(), |error| error.to_string())
}

#[test]
fn noise_that_is_none_is_refused() {
    let (knots, valid) = plant();
    let what = "must be symmetric and positive semidefinite; at step 0 entry";
    let of = |noise: Noise| refused(filtered(&knots, &noise));
    for (matrix, why) in [
        (diagonal(-1.0, 1.0), format!("{what} [0][0] is -1.0, below 0")),
        (constant(&[[1.0, 2.0], [2.0, 1.0]]), format!("{what} [1][0] is 2.0, greater than the diagonal")),
        (constant(&[[1.0, 0.5], [0.0, 1.0]]), format!("{what} [1][0] is 0.0, and [0][1] is 0.5")),
        (diagonal(f64::NAN, 1.0), "is not finite at step 0".into()),
        (diagonal(1.0, f64::INFINITY), "is not finite at step 0".into()),
        (constant(&[[1.0]]), "has length 1, not 2".into()),
        (sequence(&[[[1.0, 0.0], [0.0, 1.0]]; 5]), "has length 5, not 10".into()),
    ] {
        let process = of(Noise { process: matrix.clone(), ..valid.clone() });
        assert!(process.contains("process covariance") && process.contains(&why), "{process}; not: {why}");
        if matrix.is_constant() {
            let initial = of(Noise { initial: matrix, ..valid.clone() });
            assert!(
                initial.contains("covariance of the first state") && initial.contains(&why),
                "{initial}; not: {why}"
            );
        }
    }
    let last = sequence(&(0..STEPS).map(|t| [[1.0, if t == 7 { 2.0 } else { 0.5 }]; 2]).collect::<Vec<_>>());
    assert!(of(Noise { process: last, ..valid.clone() }).contains("at step"));
    for variance in [0.0, -1.0] {
        let found = of(Noise { measurement: constant(&[[variance]]), ..valid.clone() });
        assert_eq!(found, "the measurement covariance is not positive definite at step 0");
    }
    for measurement in [diagonal(1.0, 1.0), sequence(&[[[1.0]]; STEPS])] {
        assert!(of(Noise { measurement, ..valid.clone() }).contains("the measurement covariance has length"));
    }
    // Singular ones and those of rounding are valid.
    for process in
        [diagonal(0.0, 0.0), constant(&[[1.0, 1.0], [1.0, 1.0]]), constant(&[[4.0, 2.0 + 1e-12], [2.0, 1.0]])]
    {
        assert!(filtered(&knots, &Noise { process, ..valid.clone() }).is_ok());
    }
}

#[test]
fn arrays_that_do_not_fit_are_refused() {
    let (knots, noise) = plant();
    let (belief, policy) = (filtered(&knots, &noise).unwrap(), solved(&knots));
    let filter = |mut belief: Belief| refused(kalman(&knots, &noise, &mut belief));
    assert_eq!(filter(Belief::zeros(2, 1, 5)), "the belief has length 6, not 11");
    assert_eq!(filter(Belief::zeros(2, 1, 20)), "the belief has length 21, not 11");
    assert_eq!(filter(Belief::zeros(1, 2, STEPS)), "a column of the belief's gain has length 2, not 1");
    let riccati = |knots: &Knots, mut policy: Policy| {
        refused(solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy))
    };
    assert_eq!(riccati(&knots, Policy::zeros(knots.dimensions, 20)), "the policy has length 20, not 10");
    let other = Dimensions { states: 1, controls: 2, measurements: 1 };
    assert_eq!(riccati(&knots, Policy::zeros(other, STEPS)), "a column of the policy's feedback has length 2, not 1");
    let still = Dimensions { controls: 0, ..knots.dimensions };
    assert_eq!(riccati(&Knots::zeros(still, 3), Policy::zeros(still, 3)), "the control has length 0, not 1");
    let none = Dimensions { states: 0, ..knots.dimensions };
    assert_eq!(riccati(&Knots::zeros(none, 3), Policy::zeros(none, 3)), "the state has length 0, not 1");
    assert_eq!(refused(filtered(&Knots::zeros(none, 3), &Noise::zeros(0, 1))), "the state has length 0, not 1");
    let picks = Knots { picks: Some(vec![2]), ..knots.clone() };
    assert_eq!(refused(filtered(&picks, &noise)), "the index of a picked state must be at most 1; found 2");

    // A filter needs no controls.
    let watched =
        Knots::linear(STEPS, LinearQuadratic { a: &[[0.9]], b: &[[]], c: &[[1.0]], q: &[[1.0]], r: &[[0.0; 0]; 0] });
    let one = constant(&[[1.0]]);
    let alone = Noise { initial: one.clone(), process: one.clone(), measurement: one.clone() };
    assert!(filtered(&watched.unwrap(), &alone).is_ok());

    assert!(refused(information(&belief, &alone, &mut Information::default())) == "accepted", "V of the same size");
    let two = Noise { measurement: diagonal(1.0, 1.0), ..noise.clone() };
    let why = "a column of the measurement covariance has length 2, not 1";
    assert_eq!(refused(information(&belief, &two, &mut Information::default())), why);
    assert_eq!(refused(control_information(&knots, &policy, &belief, &two)), why);
    let short = Policy::zeros(knots.dimensions, 3);
    assert_eq!(refused(control_information(&knots, &short, &belief, &noise)), "the policy has length 3, not 10");
}

/// Of a quadratic form only the symmetric part matters.
#[test]
fn costs_are_symmetrised() {
    let form = |q: [[f64; 2]; 2]| {
        let (a, b, c) = ([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]], [[1.0, 0.0]]);
        let plant = LinearQuadratic { a: &a, b: &b, c: &c, q: &q, r: &[[0.01]] };
        solved(&Knots::linear(STEPS, plant).unwrap()).curvature
    };
    let [upper, lower, both] = [[[1.0, 0.6], [0.0, 1.0]], [[1.0, 0.0], [0.6, 1.0]], [[1.0, 0.3], [0.3, 1.0]]].map(form);
    assert!(upper == both && lower == both);
}

#[test]
fn bounds_refuse_what_they_cannot_use() {
    let (knots, noise) = plant();
    let horizon = Horizon::along(&knots, &solved(&knots), &noise, 0.0);
    let limit = 1.5 * horizon.base_cost;
    let with =
        |gap, max_iterations| refused(minimum_information(&horizon, limit, &BoundSettings { gap, max_iterations }));
    for gap in [f64::NAN, -1.0, f64::INFINITY] {
        assert!(with(gap, 200).contains("the requested gap is"), "{gap}");
    }
    assert_eq!(with(1e-7, 0), "no certified bound: no Newton step is allowed; allow more");
    assert!(with(1e-7, 1).contains("the Newton steps allowed end before any gap can be certified; allow more"));
    for growth in [1e100, 1e200] {
        let one = constant(&[[1.0]]);
        let found = Stationary::new(&constant(&[[growth, 1.0]]), &one, &diagonal(1.0, 0.0));
        assert!(refused(found).contains("beyond 1e60"), "{growth}");
    }
    // What can be had at 16 digits' growth is proved.
    let large = Stationary::new(&constant(&[[1e16, 1.0]]), &constant(&[[1.0]]), &diagonal(1.0, 0.0)).unwrap();
    let found = stationary_minimum(&large, 0.75, &BoundSettings::default()).unwrap();
    assert!(found.lower_nats > 16.0 * 10f64.ln() && found.nats < found.lower_nats + 1e-6);
    assert!((spectral_radius(nalgebra::DMatrix::from_element(2, 2, 1e300)) / 2e300 - 1.0).abs() < 1e-9);
}

/// The least cost of a plant without noise of its own is the cost itself, which rounding may put on either side of it.
#[test]
fn the_least_cost_needs_nothing_where_nothing_is_uncertain() {
    let (knots, mut noise) = plant();
    noise.initial.clear();
    noise.process.clear();
    let horizon = Horizon::along(&knots, &solved(&knots), &noise, 3.3);
    for cost in [horizon.base_cost.next_down(), horizon.base_cost, horizon.base_cost.next_up()] {
        assert_eq!(Needed::of(&horizon, cost, &mut None).map(|found| found.nats), Ok(0.0));
        assert_eq!(minimum_information(&horizon, cost, &BoundSettings::default()).map(|found| found.nats), Ok(0.0));
    }
    assert!(
        refused(Needed::of(&horizon, 3.29, &mut None)).contains("with the state known exactly the least cost is 3.3")
    );
}

#[test]
fn candidates_that_no_purchase_has_are_refused() {
    let (knots, noise) = plant();
    let policy = solved(&knots);
    let plant = Plant { knots: &knots, noise: &noise, value: &policy.value_of_information, fixed: 0.0, weight: 1.0 };
    let of = |prices: &[f64]| {
        let candidate = |(index, &price)| Candidate { name: format!("s{index}"), price, rows: vec![0] };
        refused(Selection::new(prices.iter().enumerate().map(candidate).collect(), &[plant]))
    };
    assert_eq!(of(&[1.0]), "accepted");
    assert_eq!(of(&[1.0, 1.0]), "measurement 0 belongs to sensor `s0` and again to `s1`; it may belong to one");
    for price in [-1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(of(&[price]), format!("sensor `s0` has the price {price:?}; valid: 0 or more"));
    }
}

/// Precision `1 / sqrt(V)` of a sensor: where the squares of its gain underflow, information is refused, not 0.
#[test]
fn information_of_measurements_beyond_the_range_of_numbers_is_refused() {
    let used = |gain: f64| {
        let plant = LinearQuadratic { a: &[[1.0]], b: &[[1.0]], c: &[[gain]], q: &[[1.0]], r: &[[1.0]] };
        let one = || constant(&[[1.0]]);
        let noise = Noise { initial: one(), process: one(), measurement: one() };
        let knots = Knots::linear(STEPS, plant).unwrap();
        let belief = filtered(&knots, &noise).unwrap();
        control_information(&knots, &solved(&knots), &belief, &noise).map(|steps| steps.iter().sum::<f64>())
    };
    // Ten steps, each of which tells one state with relative precision `1 / gain`.
    let [some, more] = [1e50, 1e150].map(|gain| used(gain).unwrap());
    assert!((more - some - 10.0 * 100.0 * std::f64::consts::LN_10).abs() < 1e-6 * more, "{some}, {more}");
    for gain in [1e155, 1e165, 1e200, 1e300] {
        let told = refused(used(gain));
        assert!(told.contains("not finite") || told.contains("positive definite"), "{gain:e}: {told}");
    }
}

/// The lower triangle alone is factorised: the upper one must be refused where it differs.
#[test]
fn measurement_covariances_that_are_asymmetric_or_not_positive_are_refused() {
    let (a, b, c) = ([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]], [[1.0, 0.0], [0.0, 1.0]]);
    let plant = LinearQuadratic { a: &a, b: &b, c: &c, q: &[[1.0, 0.0], [0.0, 0.1]], r: &[[0.01]] };
    let alone = Knots::linear(STEPS, plant).unwrap();
    let policy = solved(&alone);
    let of = |measurement: Matrices| Noise { measurement, initial: diagonal(0.01, 0.01), process: diagonal(0.0, 0.0) };
    let valid = of(diagonal(1e-4, 1e-2));
    let belief = filtered(&alone, &valid).unwrap();
    let asymmetric = "the measurement covariance must be symmetric and positive semidefinite; at step 0 entry [1][0] is 0.0, \
                      and [0][1] is 0.001";
    let indefinite = "the measurement covariance is not positive definite at step 0";
    let correlated = constant(&[[1e-4, 1e-1], [1e-1, 1e-2]]);
    for knots in [alone.clone(), Knots { picks: Some(vec![0, 1]), ..alone.clone() }] {
        for (measurement, why) in [
            (constant(&[[1e-4, 1e-3], [0.0, 1e-2]]), asymmetric),
            (diagonal(-1e-9, 1e-2), indefinite),
            (diagonal(0.0, 1e-2), indefinite),
            (diagonal(1e-4, 0.0), indefinite),
            (correlated.clone(), indefinite),
        ] {
            let noise = of(measurement);
            assert_eq!(refused(filtered(&knots, &noise)), why);
            assert_eq!(refused(information(&belief, &noise, &mut Information::default())), why);
            assert_eq!(refused(control_information(&knots, &policy, &belief, &noise)), why);
        }
    }
    // Also where nothing is uncertain, so that the innovation covariance is `V` itself.
    let known = Noise { initial: diagonal(0.0, 0.0), ..of(correlated) };
    assert_eq!(refused(filtered(&alone, &known)), indefinite);
    let rounded = of(constant(&[[1e-4, 1e-4], [1e-4 + 1e-15, 1e-2]]));
    assert!(filtered(&alone, &rounded).is_ok());
    let late = sequence(&(0..=STEPS).map(|t| [[1.0, if t == 7 { 0.1 } else { 0.0 }], [0.0, 1.0]]).collect::<Vec<_>>());
    assert!(refused(filtered(&alone, &of(late))).contains("at step 7 entry [1][0] is 0.0, and [0][1] is 0.1"));
}

/// Whichever number it is, it is found and named: no result is NaN, and nothing else is blamed.
#[test]
fn numbers_that_are_not_finite_are_named_by_sweeps() {
    let (knots, noise) = plant();
    let lq = |knots: &Knots, regularisation: Regularisation| {
        let mut policy = Policy::zeros(knots.dimensions, knots.steps());
        refused(solve_riccati(&knots.dynamics, &knots.cost, regularisation, &mut policy))
    };
    let regularised = Regularisation { control: 1e-3, state: 1e-3 };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for step in [0, 3, STEPS - 1] {
            for (row, col) in (0..2).flat_map(|i| (0..3).map(move |j| (i, j))) {
                let mut of = knots.clone();
                of.dynamics.set(step, row, col, bad);
                let why = format!("the dynamics [A B] is not finite at step {step}");
                for regularisation in [Regularisation::default(), regularised] {
                    assert_eq!(lq(&of, regularisation), why, "{bad} {row} {col}");
                }
                let is_read = col < 2;
                assert_eq!(refused(filtered(&of, &noise)), if is_read { &*why } else { "accepted" });
                let picks = Knots { picks: Some(vec![0]), ..of.clone() };
                assert_eq!(refused(filtered(&picks, &noise)), if is_read { &*why } else { "accepted" });
                let unmeasured = Knots {
                    dimensions: Dimensions { measurements: 0, ..of.dimensions },
                    measurement: Matrices::zeros(STEPS + 1, 0, 2),
                    ..of.clone()
                };
                let silent = Noise { measurement: constant(&[[0.0; 0]; 0]), ..noise.clone() };
                assert_eq!(refused(filtered(&unmeasured, &silent)), if is_read { &*why } else { "accepted" });
            }
            // The lower triangle, and the slope.
            for (row, col) in (0..3).flat_map(|i| (0..=i).chain([3]).map(move |j| (i, j))) {
                let mut of = knots.clone();
                of.cost.set(step, row, col, bad);
                for regularisation in [Regularisation::default(), regularised] {
                    let why = format!("the cost [l_zz l_z] is not finite at step {step}");
                    assert_eq!(lq(&of, regularisation), why, "{bad} {row} {col}");
                }
            }
            let mut of = knots.clone();
            of.measurement.set(step, 0, 1, bad);
            assert_eq!(refused(filtered(&of, &noise)), format!("the measurement matrix C is not finite at step {step}"));
            assert_eq!(refused(filtered(&Knots { picks: Some(vec![0]), ..of }, &noise)), "accepted");
        }
        let mut of = knots.clone();
        of.cost.set(STEPS, 1, 0, bad);
        assert_eq!(lq(&of, Regularisation::default()), "the cost [l_zz l_z] is not finite at step 10");
    }
    // Finite numbers whose products are not.
    let mut large = knots.clone();
    large.cost.set(4, 0, 3, 1e300);
    large.dynamics.set(3, 0, 0, 1e100);
    assert_eq!(lq(&large, Regularisation::default()), "the cost-to-go is not finite at step 3");
    let growing = LinearQuadratic { a: &[[1e20]], b: &[[1.0]], c: &[[0.0]], q: &[[1.0]], r: &[[1.0]] };
    let one = constant(&[[1.0]]);
    let noise = Noise { initial: one.clone(), process: one.clone(), measurement: one };
    let found = refused(filtered(&Knots::linear(STEPS, growing).unwrap(), &noise));
    assert!(found.contains("finite") || found.contains("positive definite"), "{found}");
}
