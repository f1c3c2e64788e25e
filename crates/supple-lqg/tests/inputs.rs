//! What does not fit is refused, with its name, what was found and what is valid.
#![allow(clippy::unwrap_used)]

use supple_lqg::bound::{BoundSettings, Horizon, Needed, Stationary, minimum_information, stationary_minimum};
use supple_lqg::sensors::{Candidate, Goal, Limits, Plant, Selection};
use supple_lqg::{
    Belief, BeliefAdjoint, BeliefSeeds, Dimensions, Error, Information, KnotAdjoints, Knots, LinearQuadratic, Matrices,
    Noise, Policy, Regularisation, TimeVarying, constant, control_information, cost_parts, information, kalman, matrix,
    noise_cost, reverse_kalman, sequence, solve_riccati, spectral_radius,
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
    assert_eq!(refused(noise_cost(&knots, &short, &belief, &knots.cost)), "the policy has length 3, not 10");
    assert_eq!(refused(Horizon::along(&knots, &short, &noise, 0.0)), "the policy has length 3, not 10");
    let few = Belief::zeros(2, 1, 3);
    assert_eq!(refused(noise_cost(&knots, &policy, &few, &knots.cost)), "the belief has length 4, not 11");
    assert_eq!(refused(cost_parts(0.0, &policy, &few, &noise)), "the sequence of the belief has length 4, not 10");
    assert_eq!(
        refused(cost_parts(0.0, &policy, &belief, &alone)),
        "a column of the process covariance has length 1, not 2"
    );
    assert_eq!(
        refused(noise_cost(&knots, &policy, &belief, &Matrices::zeros(STEPS, 3, 4))),
        "the sequence of the second derivatives of the cost has length 10, not 11"
    );
}

#[test]
#[should_panic(expected = "the belief")]
fn reverse_sweeps_say_which_array_does_not_fit() {
    let (knots, noise) = plant();
    let (mut adjoints, mut by_noise) = (KnotAdjoints::zeros(knots.dimensions, STEPS), Noise::zeros(2, 1));
    let (belief, mut memory) = (Belief::zeros(2, 1, 5), BeliefAdjoint::new(2, 1));
    reverse_kalman(&knots, &noise, &belief, BeliefSeeds::default(), &mut memory, &mut adjoints, &mut by_noise);
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
    let horizon = Horizon::along(&knots, &solved(&knots), &noise, 0.0).unwrap();
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
    let horizon = Horizon::along(&knots, &solved(&knots), &noise, 3.3).unwrap();
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
    let candidate = |row| vec![Candidate { name: "wrist".into(), price: 1.0, rows: vec![row] }];
    let missing = "sensor `wrist` has the measurement 7, counted from 0, but the plant has 1";
    assert_eq!(refused(Selection::new(candidate(7), &[plant])), missing);
    for (value, why) in [
        (Matrices::zeros(STEPS, 1, 1), "a column of the value of information has length 1, not 2"),
        (Matrices::zeros(3, 2, 2), "the sequence of the value of information has length 3, not 10"),
        (sequence(&[[[f64::NAN; 2]; 2]; STEPS]), "the value of information is not finite at step 0"),
    ] {
        assert_eq!(refused(Selection::new(candidate(0), &[Plant { value: &value, ..plant }])), why);
    }
    for (measurement, why) in [
        (sequence(&[[[1.0]]; 3]), "the sequence of the measurement covariance has length 3, not 11"),
        (constant(&[[0.0]]), "the measurement covariance is not positive definite at step 0"),
    ] {
        let noise = Noise { measurement, ..noise.clone() };
        assert_eq!(refused(Selection::new(candidate(0), &[Plant { noise: &noise, ..plant }])), why);
    }
}

fn one_candidate() -> Selection {
    let (knots, noise) = plant();
    let policy = solved(&knots);
    let plant = Plant { knots: &knots, noise: &noise, value: &policy.value_of_information, fixed: 0.0, weight: 1.0 };
    Selection::new(vec![Candidate { name: "position".into(), price: 1.0, rows: vec![0] }], &[plant]).unwrap()
}

/// Within a negative budget there is no set, not even the empty one.
#[test]
fn budgets_and_goals_that_are_none_are_refused() {
    let selection = one_candidate();
    let each = |goal: Goal, limits: Limits| {
        [
            refused(selection.greedy(goal, limits)),
            refused(selection.exhaustive(goal, limits, &mut || true)),
            refused(selection.branch_and_bound(goal, limits, 10, &mut || true)),
            refused(selection.bound(goal, limits)),
        ]
    };
    for goal in [Goal::LeastCost, Goal::MostInformation, Goal::LeastPrice { cost: 1e9 }] {
        for budget in [f64::NAN, -1.0, f64::INFINITY] {
            let why = format!("the budget is {budget:?}; valid: 0 or more, or no budget");
            assert_eq!(each(goal, Limits { budget: Some(budget), count: None }), [(); 4].map(|()| why.clone()));
        }
        assert_eq!(each(goal, Limits { budget: Some(0.0), count: None }), ["accepted"; 4]);
    }
    let why = "the bound on the expected cost is NaN; valid: any number";
    assert_eq!(each(Goal::LeastPrice { cost: f64::NAN }, Limits::default()), [why; 4]);
    let stopped = selection.exhaustive(Goal::LeastCost, Limits::default(), &mut || false);
    assert_eq!(stopped, Err(Error::Stopped));
}

#[test]
#[should_panic(expected = "there must be one entry per candidate: 1, not 0")]
fn sets_with_too_few_entries_are_no_sets() {
    let _ = one_candidate().worth(&[]);
}

#[test]
#[should_panic(expected = "there must be one entry per candidate: 1, not 2")]
fn weights_of_too_many_candidates_are_none() {
    let _ = one_candidate().relaxed(&[0.5, 0.5]);
}

/// Given to threads, stored in structures that derive `Clone` and `Debug`.
#[test]
fn inputs_can_be_shared_copied_and_shown() {
    fn shared<T: Send + Sync + Clone + std::fmt::Debug>(of: &T) -> String {
        format!("{of:?}")
    }
    let plant = LinearQuadratic { a: &[[0.5]], b: &[[1.0]], c: &[[1.0]], q: &[[2.0]], r: &[[3.0]] };
    assert_eq!(shared(&plant), "LinearQuadratic { a: [[0.5]], b: [[1.0]], c: [[1.0]], q: [[2.0]], r: [[3.0]] }");
    assert!(shared(&one_candidate()).contains("position"));
    let (knots, noise) = self::plant();
    let value = solved(&knots).value_of_information;
    assert!(shared(&Plant { knots: &knots, noise: &noise, value: &value, fixed: 0.0, weight: 1.0 }).contains("weight"));
}

/// From sequences as from entries set one by one; and constant sequences are the time-invariant plant.
#[test]
fn knots_of_varying_systems_are_those_assembled_by_index() {
    const N: usize = 3;
    let number = |seed: usize, t: usize, i: usize, j: usize| ((7 * seed + 5 * t + 3 * i + 2 * j) % 11) as f64 - 4.0;
    let two = |seed: usize, t: usize| [0, 1].map(|i| [0, 1].map(|j| number(seed, t, i, j)));
    let a = sequence(&(0..N).map(|t| two(1, t)).collect::<Vec<_>>());
    let b = sequence(&(0..N).map(|t| [0, 1].map(|i| [number(2, t, i, 0)])).collect::<Vec<_>>());
    let c = sequence(&(0..=N).map(|t| [[0, 1].map(|j| number(3, t, 0, j))]).collect::<Vec<_>>());
    let q = sequence(&(0..=N).map(|t| two(4, t)).collect::<Vec<_>>());
    let r = sequence(&(0..N).map(|t| [[number(5, t, 0, 0)]]).collect::<Vec<_>>());
    let plant = TimeVarying { a: &a, b: &b, c: &c, q: &q, r: &r };
    let found = Knots::varying(N, plant).unwrap();
    let mut expected = Knots::zeros(Dimensions { states: 2, controls: 1, measurements: 1 }, N);
    for (t, i) in (0..=N).flat_map(|t| [0, 1].map(|i| (t, i))) {
        for j in 0..2 {
            expected.cost.set(t, i, j, 0.5 * (number(4, t, i, j) + number(4, t, j, i)));
        }
        expected.measurement.set(t, 0, i, number(3, t, 0, i));
        if t < N {
            (0..2).for_each(|j| expected.dynamics.set(t, i, j, number(1, t, i, j)));
            expected.dynamics.set(t, i, 2, number(2, t, i, 0));
            expected.cost.set(t, 2, 2, number(5, t, 0, 0));
        }
    }
    let same = |one: &Knots, other: &Knots| {
        (&one.dynamics, &one.measurement, &one.cost) == (&other.dynamics, &other.measurement, &other.cost)
            && (one.dimensions, &one.picks) == (other.dimensions, &other.picks)
    };
    assert!(same(&found, &expected), "{found:?}");
    for (plant, why) in [
        (TimeVarying { q: &r, ..plant }, "a column of Q has length 1, not 2"),
        (TimeVarying { a: &sequence(&[two(1, 0)]), ..plant }, "the sequence of A has length 1, not 3"),
        (TimeVarying { c: &b, ..plant }, "a row of C has length 1, not 2"),
    ] {
        assert_eq!(refused(Knots::varying(N, plant)), why);
    }

    let (a, b, c, q, r) = ([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]], [[1.0, 0.0]], [[1.0, 0.2], [0.2, 3.0]], [[0.5]]);
    let still = Knots::linear(N, LinearQuadratic { a: &a, b: &b, c: &c, q: &q, r: &r }).unwrap();
    let end = [[9.0, 1.0], [3.0, 8.0]];
    let weighed = still.clone().with_final_weight(&end).unwrap();
    let [at, bt, ct, rt] = [constant(&a), constant(&b), constant(&c), constant(&r)];
    let qs = sequence(&[q, q, q, end]);
    let varying = TimeVarying { a: &at, b: &bt, c: &ct, q: &constant(&q), r: &rt };
    assert!(same(&Knots::varying(N, varying).unwrap(), &still));
    assert!(same(&Knots::varying(N, TimeVarying { q: &qs, ..varying }).unwrap(), &weighed));
    assert_eq!(weighed.cost.get(N, 0, 1), 2.0, "the symmetric part");
    assert_eq!(refused(still.with_final_weight(&[[1.0, 2.0]])), "a column of Q has length 1, not 2");
}

/// Gains and covariances at a step, as rows, none transposed.
#[test]
fn results_are_plain_rows() {
    let (knots, noise) = plant();
    let (belief, policy) = (filtered(&knots, &noise).unwrap(), solved(&knots));
    let feedback: Vec<Vec<f64>> = matrix(&policy.feedback, 3);
    assert_eq!(feedback, [[policy.feedback.get(3, 0, 0), policy.feedback.get(3, 0, 1)]]);
    let gain: Vec<Vec<f64>> = belief.gain(3);
    let p = |i: usize| belief.predicted.get(3, i, 0);
    assert_eq!((gain.len(), gain[0].len()), (2, 1));
    assert!((0..2).all(|i| (gain[i][0] - p(i) / (p(0) + 1e-4)).abs() < 1e-12), "{gain:?}");
    let sigma: Vec<Vec<f64>> = matrix(&belief.corrected, 3);
    assert!(belief.corrected.rows_of(3).eq(sigma.iter()));
    assert_eq!(sigma[0][1], belief.corrected.get(3, 0, 1));
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
            assert_eq!(
                refused(filtered(&of, &noise)),
                format!("the measurement matrix C is not finite at step {step}")
            );
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
