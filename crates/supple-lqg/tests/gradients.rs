//! Adjoints of every sweep against differences of the sweeps themselves, in every form and for rows of every length.
#![allow(clippy::unwrap_used)]

#[path = "common/directions.rs"]
mod directions;
#[path = "common/random_problem.rs"]
mod random_problem;

use directions::slope;
use random_problem::{Problem, Random};
use supple_lqg::dense::{Dense, dense, store};
use supple_lqg::{
    Belief, BeliefAdjoint, BeliefSeeds, Dimensions, Information, KnotAdjoints, Matrices, Noise, Partials, Policy,
    Regularisation, RiccatiAdjoint, RiccatiSeeds, add_control_partials, control_information, information, kalman,
    reverse_kalman, reverse_riccati, solve_riccati,
};

/// Weights of the parts of a number: information that is measured, that is used, and the costs of Riccati sweeps.
#[derive(Clone, Copy, Default)]
struct Weights {
    measured: f64,
    used: f64,
    belief: f64,
    process: f64,
    initial: f64,
}

const ALL: Weights = Weights { measured: 0.7, used: 0.9, belief: 1.1, process: 0.6, initial: 0.8 };

fn swept(problem: &Problem) -> (supple_lqg::Knots, Noise, Policy, Belief) {
    let (knots, noise, steps) = (problem.knots(), problem.noise(), problem.steps());
    let Dimensions { states: n, measurements: p, .. } = problem.dimensions;
    let mut policy = Policy::zeros(problem.dimensions, steps);
    solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy).unwrap();
    let mut belief = Belief::zeros(n, p, steps);
    kalman(&knots, &noise, &mut belief).unwrap();
    (knots, noise, policy, belief)
}

/// The traces of products of two lists of matrices, added up.
fn traces<'a>(
    count: usize,
    a: impl Fn(usize) -> (&'a Matrices, usize),
    b: impl Fn(usize) -> (&'a Matrices, usize),
) -> f64 {
    let of = |(list, t): (&Matrices, usize)| dense(list, t);
    (0..count).map(|t| of(a(t)).dot(&of(b(t)))).sum()
}

/// Derivatives of another number by `P`, `Sigma`, `K` and `Xi`.
type Others = [Matrices; 4];

/// The number that [`gradient`] differentiates, with another that is linear beside it.
fn value(problem: &Problem, weights: Weights, others: &Others) -> f64 {
    let (knots, noise, policy, belief) = swept(problem);
    let steps = problem.steps();
    let mut measured = Information::default();
    information(&belief, &noise, &mut measured).unwrap();
    let used: f64 = if weights.used == 0.0 {
        0.0
    } else {
        control_information(&knots, &policy, &belief, &noise).unwrap().iter().sum()
    };
    let value = traces(steps, |t| (&policy.value_of_information, t), |t| (&belief.corrected, t));
    let process = traces(steps, |t| (&policy.curvature, t + 1), |t| (&noise.process, t));
    let initial = traces(1, |_| (&policy.curvature, 0), |_| (&noise.initial, 0));
    let predicted = traces(steps + 1, |t| (&others[0], t), |t| (&belief.predicted, t));
    let corrected = traces(steps + 1, |t| (&others[1], t), |t| (&belief.corrected, t));
    let feedback = traces(steps, |t| (&others[2], t), |t| (&policy.feedback, t));
    let told = traces(steps, |t| (&others[3], t), |t| (&policy.value_of_information, t));
    let costs = weights.belief * value + weights.process * process + weights.initial * initial;
    weights.measured * measured.total + weights.used * used + 0.5 * costs + predicted + corrected + feedback + told
}

/// Its derivatives by all knots and all noise.
fn gradient(problem: &Problem, weights: Weights, others: &Others) -> (KnotAdjoints, Noise) {
    let (knots, noise, policy, belief) = swept(problem);
    let (steps, Dimensions { states: n, measurements: p, .. }) = (problem.steps(), problem.dimensions);
    let mut partials = Partials::zeros(problem.dimensions, steps);
    let ends = [&partials.measurement, &partials.measurement_noise, &partials.predicted, &partials.corrected];
    assert!(ends.iter().all(|list| list.count() == steps + 1));
    (partials.predicted, partials.corrected) = (others[0].clone(), others[1].clone());
    (partials.feedback, partials.value_of_information) = (others[2].clone(), others[3].clone());
    if weights.used != 0.0 {
        let nats = add_control_partials(&knots, &policy, &belief, &noise, weights.used, &mut partials).unwrap();
        let of_each = control_information(&knots, &policy, &belief, &noise).unwrap();
        assert!(
            (nats - of_each.iter().sum::<f64>()).abs() < 1e-12 * nats.max(1.0),
            "the information itself is returned"
        );
    }
    // Stale numbers must not survive where a sweep writes.
    let mut adjoints = KnotAdjoints::zeros(problem.dimensions, steps);
    (0..steps).for_each(|t| adjoints.dynamics.set(t, 0, 0, 7.0));
    let mut by_noise = problem.no_noise();
    let seeds = BeliefSeeds {
        information: weights.measured,
        weights: Some((&policy.value_of_information, weights.belief)),
        covariances: Some((&partials.predicted, &partials.corrected)),
    };
    let mut work = BeliefAdjoint::new(n, p);
    reverse_kalman(&knots, &noise, &belief, seeds, &mut work, &mut adjoints, &mut by_noise);
    partials.add_to(&knots, &mut adjoints, &mut by_noise);
    let seeds = RiccatiSeeds {
        belief: weights.belief,
        process: weights.process,
        initial: weights.initial,
        partials: Some(&partials),
    };
    let mut work = RiccatiAdjoint::new(n, problem.dimensions.joint());
    reverse_riccati(&knots, &policy, &belief, &noise, seeds, &mut work, &mut adjoints);
    for t in 0..steps {
        let sum = dense(&by_noise.process, t) + dense(&policy.curvature, t + 1) * (0.5 * weights.process);
        store(&mut by_noise.process, t, &sum);
    }
    let sum = dense(&by_noise.initial, 0) + dense(&policy.curvature, 0) * (0.5 * weights.initial);
    store(&mut by_noise.initial, 0, &sum);
    (adjoints, by_noise)
}

fn assert_gradient(name: &str, problem: &Problem, weights: Weights, within: f64) {
    let (Dimensions { states: n, controls: m, .. }, steps, mut random) =
        (problem.dimensions, problem.steps(), Random(99));
    let mut list = |count: usize, next: &dyn Fn(&mut Random) -> Dense| {
        let first = next(&mut random);
        let mut list = Matrices::zeros(count, first.nrows(), first.ncols());
        (0..count).for_each(|t| store(&mut list, t, &(next(&mut random) * 0.3)));
        list
    };
    let symmetric = |random: &mut Random| random.symmetric(n);
    let others = [
        list(steps + 1, &symmetric),
        list(steps + 1, &symmetric),
        list(steps, &|random| random.matrix(m, n)),
        list(steps, &symmetric),
    ];
    let (adjoints, by_noise) = gradient(problem, weights, &others);
    for seed in 0..4 {
        let along = problem.direction(seed);
        let found = along.inner(&adjoints, &by_noise);
        let expected = slope(|h| value(&problem.moved(&along, h), weights, &others));
        assert!((found - expected).abs() < within * expected.abs().max(1.0), "{name}, {seed}: {found} {expected}");
    }
}

/// Rows of one set of lanes, of two, and of more; as many controls and measurements as these allow.
const SHAPES: [(usize, usize, usize); 6] = [(1, 1, 1), (3, 2, 2), (5, 1, 4), (8, 3, 3), (9, 2, 6), (17, 3, 9)];

#[test]
fn of_measurements_taken_together() {
    for (seed, shape) in SHAPES.into_iter().enumerate() {
        let problem = Problem::random(shape, 4, 11 + seed as u64);
        assert_gradient(&format!("{shape:?}"), &problem, Weights { used: 0.0, ..ALL }, 1e-8);
    }
}

#[test]
fn of_measurements_that_are_states() {
    let twice = [0, 4, 2, 4, 1, 0, 3, 5, 8, 7, 6, 8];
    for (seed, (shape, picks)) in
        [((3, 1, 1), &[2_usize][..]), ((5, 2, 3), &[4, 0, 4]), ((9, 2, 12), &twice), ((18, 2, 12), &twice)]
            .into_iter()
            .enumerate()
    {
        let problem = Problem::random(shape, 4, 31 + seed as u64).picking(picks, 3);
        assert_gradient(&format!("{shape:?}"), &problem, Weights { used: 0.0, ..ALL }, 1e-8);
    }
}

/// Two sensors of the same that are far more precise than what is known before: the filter takes square roots. Both turn
/// together, as what they say apart is below their noise.
#[test]
fn of_sensors_so_precise_that_roots_are_taken() {
    for (shape, information) in [((3, 1, 2), 0.7), ((6, 2, 3), 0.7), ((6, 2, 3), 0.0)] {
        let mut problem = Problem::random(shape, 3, 5);
        problem.v.iter_mut().for_each(|v| *v *= 1e-10);
        problem.c.iter_mut().for_each(|c| c.set_row(1, &c.row(0).into_owned()));
        let weights = Weights { used: 0.0, measured: information, ..ALL };
        assert_gradient(&format!("{shape:?}"), &problem, weights, 1e-6);
    }
}

#[test]
fn of_positions_that_follow_rates() {
    for (shape, steps) in [((24, 3, 2), 4), ((14, 4, 1), 3)] {
        let problem = Problem::random(shape, steps, 8).carried(0.05);
        assert_gradient(&format!("{shape:?}"), &problem, Weights { used: 0.0, ..ALL }, 1e-8);
    }
}

#[test]
fn of_information_that_reaches_the_controls() {
    for (seed, shape) in [(2, 1, 1), (3, 2, 2), (4, 1, 3), (5, 2, 1), (4, 3, 2)].into_iter().enumerate() {
        let problem = Problem::random(shape, 4, 51 + seed as u64);
        assert_gradient(&format!("{shape:?}"), &problem, Weights { used: 1.0, ..Weights::default() }, 1e-6);
        assert_gradient(&format!("{shape:?}"), &problem, ALL, 1e-6);
    }
    let picking = Problem::random((4, 2, 3), 4, 77).picking(&[3, 1, 0], 4);
    assert_gradient("states", &picking, ALL, 1e-6);
}

/// Two robots side by side, one with a sensor for each state, one with a single sensor: past controls tell all that the
/// second one measures, but not all that the first one does, and the way back from controls to measurements is unstable.
/// Derivatives by what cannot vary grew from step to step, to 1e111 for a gripper with two fingers.
#[test]
fn of_controls_that_tell_all_that_one_of_two_robots_measures() {
    let steps = 40;
    let (robot, sensor) = (|i: usize| usize::from(matches!(i, 3..=5 | 7)), |i: usize| usize::from(i == 3));
    let apart = |matrix: &Dense, row: &dyn Fn(usize) -> usize, column: &dyn Fn(usize) -> usize| {
        Dense::from_fn(matrix.nrows(), matrix.ncols(), |i, j| if row(i) == column(j) { matrix[(i, j)] } else { 0.0 })
    };
    let mut problem = Problem::random((6, 2, 4), steps, 200);
    problem.f = vec![apart(&problem.f[0], &robot, &robot); steps];
    problem.c = vec![apart(&problem.c[0], &sensor, &robot); steps + 1];
    problem.x0 = apart(&problem.x0, &robot, &robot);
    problem.w = vec![apart(&problem.w[0], &robot, &robot); steps];
    problem.v = vec![apart(&problem.v[0], &sensor, &sensor); steps + 1];
    let (knots, noise, mut policy, belief) = swept(&problem);
    // The less of the correction feeds back at once, the more unstable is the way back.
    let mut feedback = apart(&Random(0).matrix(2, 6), &|i| i, &robot);
    let correction = dense(&belief.gain_transposed, steps).row(3).into_owned();
    let along = feedback.row(1).dot(&correction) / correction.norm_squared();
    feedback.set_row(1, &(feedback.row(1) - correction * (0.9 * along)));
    (0..steps).for_each(|t| store(&mut policy.feedback, t, &feedback));
    let mut partials = Partials::zeros(problem.dimensions, steps);
    add_control_partials(&knots, &policy, &belief, &noise, 1.0, &mut partials).unwrap();
    let change = apart(&Random(77).matrix(2, 6), &|i| i, &robot);
    for t in [0, 1, 5, 20, steps - 1] {
        let used = |h: f64| {
            let mut moved = policy.clone();
            store(&mut moved.feedback, t, &(&feedback + &change * h));
            control_information(&knots, &moved, &belief, &noise).unwrap().iter().sum()
        };
        let (found, expected) = (dense(&partials.feedback, t).dot(&change), slope(used));
        assert!((found - expected).abs() < 1e-8, "{t}: {found} {expected}");
    }
}

/// Noise that is the same at every step receives the sum of the derivatives of all steps.
#[test]
fn of_noise_that_does_not_change() {
    let problem = Problem::random((4, 2, 2), 5, 3);
    let (knots, steps) = (problem.knots(), problem.steps());
    let mut constant = Noise::zeros(4, 2);
    store(&mut constant.initial, 0, &problem.x0);
    store(&mut constant.process, 0, &problem.w[0]);
    store(&mut constant.measurement, 0, &problem.v[0]);
    let same = Problem { w: vec![problem.w[0].clone(); steps], v: vec![problem.v[0].clone(); steps + 1], ..problem };
    let each = same.noise();
    let by = |noise: &Noise, mut out: Noise| {
        let mut belief = Belief::zeros(4, 2, steps);
        kalman(&knots, noise, &mut belief).unwrap();
        let mut adjoints = KnotAdjoints::zeros(same.dimensions, steps);
        let seeds = BeliefSeeds { information: 1.0, ..BeliefSeeds::default() };
        reverse_kalman(&knots, noise, &belief, seeds, &mut BeliefAdjoint::new(4, 2), &mut adjoints, &mut out);
        out
    };
    let sums = [by(&constant, Noise::zeros(4, 2)), by(&each, Noise::zeros(4, 2)), by(&constant, same.no_noise())];
    let expected = by(&each, same.no_noise());
    for t in 0..=steps {
        // The same at each step where only the derivatives are kept apart.
        let (found, expected) = (dense(&sums[2].measurement, t), dense(&expected.measurement, t));
        assert!((&found - &expected).norm() < 1e-12 * expected.norm(), "{t}: {found} {expected}");
    }
    let total = |list: &Matrices| (0..list.count()).map(|t| dense(list, t)).reduce(|a, b| a + b).unwrap();
    for found in &sums {
        let parts = [
            (&found.measurement, &expected.measurement),
            (&found.process, &expected.process),
            (&found.initial, &expected.initial),
        ];
        for (found, expected) in parts {
            let (found, expected) = (total(found), total(expected));
            assert!((&found - &expected).norm() < 1e-12 * expected.norm(), "{found} {expected}");
        }
    }
}
