//! Linear problems from arrays: against the same problem as a task file, and against linear algebra.

use crate::common::reference;

use crate::common::reference::time_varying::{TimeVarying, sequence};
use crate::common::reference::{
    assert_matrix_near, assert_near, evaluated, full, numbers, random_matrix, relative_error,
};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use supple::check::check;
use supple::noise::{Covariance, NoiseModel};
use supple::parameters::{Parameter, Parameters};
use supple::pipeline::TaskState;
use supple::system::{Arrays, Sequence, System};
use supple::{EvaluateOptions, Matrices, Problem, Task, Value};

const STEPS: usize = 20;

/// Two states, one control, one measurement; the first state is measured.
const FILE: &str = r#"
    [model]
    kind = "linear"
    A = [[1.0, 0.1], [-0.2, 0.9]]
    B = [[0.0], [0.3]]
    C = [[1.0, 0.0]]
    [[tasks]]
    name = "hold"
    steps = 20
    time_step = 1.0
    initial_state = [1.0, -0.5]
    initial_control = [0.0]
    noise = { initial = [0.1, 0.2], process = [[0.02, 0.01], [0.01, 0.03]], measurement = [0.05] }
    [[tasks.costs]]
    kind = "quadratic"
    Q = [[1.0, 0.3], [0.3, 0.7]]
    R = [[0.2]]
    final = [[5.0, 0.0], [0.0, 1.0]]
"#;

/// The arrays of that file, with as many matrices as a function makes of one.
fn arrays_of_file(fill: impl Fn(&DMatrix<f64>, usize) -> Matrices) -> Arrays {
    let square = |entries: [f64; 4]| DMatrix::from_row_slice(2, 2, &entries);
    let (b, c) = (DMatrix::from_row_slice(2, 1, &[0.0, 0.3]), DMatrix::from_row_slice(1, 2, &[1.0, 0.0]));
    let r = DMatrix::from_element(1, 1, 0.2);
    let last = square([5.0, 0.0, 0.0, 1.0]);
    Arrays {
        QN: Some(sequence(&[last])),
        ..Arrays::new([
            fill(&square([1.0, 0.1, -0.2, 0.9]), STEPS),
            fill(&b, STEPS),
            fill(&c, STEPS + 1),
            fill(&square([1.0, 0.3, 0.3, 0.7]), STEPS),
            fill(&r, STEPS),
        ])
    }
}

fn repeated(matrix: &DMatrix<f64>, count: usize) -> Matrices {
    sequence(&vec![matrix.clone(); count])
}

fn constant(matrix: &DMatrix<f64>, _: usize) -> Matrices {
    let mut out = Matrices::constant(matrix.nrows(), matrix.ncols());
    out.copy_from(&sequence(std::slice::from_ref(matrix)));
    out
}

/// Everything that does not depend on the rounding of the reference trajectory.
fn whole(state: &TaskState) -> Vec<f64> {
    let parts = [state.information.total, state.cost.belief, state.cost.process, state.cost.initial];
    let matrices = [&state.plan.policy.feedback, &state.belief.corrected, &state.belief.predicted];
    let entries = matrices.into_iter().flat_map(|matrices| matrices.as_slice().iter().copied());
    state.information.per_step.iter().copied().chain(parts).chain(entries).collect()
}

#[test]
fn numbers_are_those_of_the_same_problem_as_a_task_file() {
    let from_file = &supple_file::parse(FILE, "test").unwrap().tasks[0];
    let expected = evaluated(from_file, &[]);
    for arrays in [arrays_of_file(constant), arrays_of_file(repeated)] {
        let system = std::sync::Arc::new(Sequence::new(STEPS, &arrays).unwrap());
        let task = Task { system, ..from_file.clone() };
        let found = evaluated(&task, &[]);
        assert!(found.plan.knots.picks.is_some(), "the measurement is a state");
        assert_eq!(whole(&found), whole(&expected), "bit for bit");
        assert_near("nominal cost", found.cost.nominal, expected.cost.nominal, 1e-14);
        let (found, expected) = (&found.plan.trajectory, &expected.plan.trajectory);
        assert!(relative_error(found.states.as_slice(), expected.states.as_slice()) < 1e-13);
        assert!(relative_error(found.controls.as_slice(), expected.controls.as_slice()) < 1e-13);
    }
}

#[test]
fn noise_that_is_the_same_at_every_step_may_be_given_once() {
    for seed in 0..4 {
        let system = TimeVarying::random((5, 2, 3, 12), 100 + seed).with_equal_noise();
        let once = NoiseModel {
            initial: full(&system.x0),
            process: full(&system.w[0]),
            measurement: full(&system.v[0]),
            varying: Vec::new(),
        };
        let (each, once) = (evaluated(&system.task(), &[]), evaluated(&system.task_with(once), &[]));
        assert_eq!(whole(&each), whole(&once), "bit for bit");
    }
}

/// Independent measurements of single states are taken one at a time: that way has to know the step too.
#[test]
fn noise_of_each_step_is_that_of_its_step_when_measurements_are_taken_one_at_a_time() {
    let mut system = TimeVarying::random((4, 1, 2, 10), 110);
    let pick = DMatrix::from_row_slice(2, 4, &[0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    system.c.fill(pick);
    system.v = (0..=10).map(|t| DMatrix::from_diagonal(&DVector::from_vec(vec![0.1 + t as f64, 2.0]))).collect();
    let picked = evaluated(&system.task(), &[]);
    assert_eq!(picked.plan.knots.picks.as_deref(), Some(&[2, 0][..]));
    // A little of another state keeps measurements from being single states.
    let mut mixed = system.clone();
    mixed.c.iter_mut().for_each(|c| c[(0, 0)] = 1e-14);
    let mixed = evaluated(&mixed.task(), &[]);
    assert!(mixed.plan.knots.picks.is_none());
    for (name, found, expected) in [
        ("information", &picked.information.per_step, &mixed.information.per_step),
        ("covariance", &picked.belief.corrected.as_slice().to_vec(), &mixed.belief.corrected.as_slice().to_vec()),
    ] {
        assert!(relative_error(found, expected) < 1e-11, "{name}");
    }
}

/// A system with all terms, and a linear cost that pulls it away from 0.
fn affine(seed: u64) -> (TimeVarying, Arrays) {
    let shape @ (n, m, p, steps) = (4, 2, 3, 9);
    let mut system = TimeVarying::random(shape, seed);
    // `x'Qx + 2x'Su + u'Ru` has to stay convex.
    system.r.iter_mut().for_each(|r| *r += DMatrix::identity(m, m) * 4.0);
    system.q.iter_mut().for_each(|q| *q += DMatrix::identity(n, n) * 2.0);
    let rng = &mut ChaCha8Rng::seed_from_u64(seed + 1000);
    let mut list = |count: usize, rows: usize, cols: usize| {
        sequence(&(0..count).map(|_| random_matrix(rng, rows, cols)).collect::<Vec<_>>())
    };
    let arrays = Arrays {
        c: Some(list(steps, 1, n)),
        d: Some(list(steps + 1, 1, p)),
        S: Some(list(steps, n, m)),
        q: Some(list(steps, 1, n)),
        r: Some(list(steps, 1, m)),
        qN: Some(list(1, 1, n)),
        ..system.arrays()
    };
    (system, arrays)
}

fn column(vectors: &Option<Matrices>, t: usize) -> DVector<f64> {
    DVector::from_column_slice(vectors.as_ref().unwrap().vector(t))
}

fn affine_task(seed: u64) -> (TimeVarying, Arrays, Task) {
    let (system, arrays) = affine(seed);
    let from_arrays = std::sync::Arc::new(Sequence::new(system.steps(), &arrays).unwrap());
    let task = Task { system: from_arrays, ..system.task() };
    (system, arrays, task)
}

#[test]
fn nominal_plan_solves_the_stacked_quadratic_with_all_terms() {
    for seed in 120..124 {
        let (system, arrays, task) = affine_task(seed);
        let (n, m, steps) = (system.start.len(), system.r[0].nrows(), system.steps());
        // x_t = free + forced u, with all controls in one vector.
        let mut forced = DMatrix::zeros(n, steps * m);
        let mut free = system.start.clone();
        let (mut hessian, mut slope) = (DMatrix::zeros(steps * m, steps * m), DVector::zeros(steps * m));
        let mut constant = 0.0;
        for t in 0..=steps {
            let linear = if t < steps { column(&arrays.q, t) } else { column(&arrays.qN, 0) };
            hessian += forced.transpose() * &system.q[t] * &forced * 2.0;
            slope += forced.transpose() * (&system.q[t] * &free * 2.0 + &linear);
            constant += free.dot(&(&system.q[t] * &free)) + free.dot(&linear);
            if t < steps {
                let cross = reference::dense(arrays.S.as_ref().unwrap(), t);
                let mut own = hessian.view_mut((t * m, t * m), (m, m));
                own += &system.r[t] * 2.0;
                let mixed = forced.transpose() * &cross * 2.0;
                let mut columns = hessian.columns_mut(t * m, m);
                columns += &mixed;
                let mut rows = hessian.rows_mut(t * m, m);
                rows += mixed.transpose();
                let mut part = slope.rows_mut(t * m, m);
                part += cross.transpose() * &free * 2.0 + column(&arrays.r, t);
                forced = &system.a[t] * forced;
                forced.columns_mut(t * m, m).copy_from(&system.b[t]);
                free = &system.a[t] * free + column(&arrays.c, t);
            }
        }
        let controls = -hessian.cholesky().unwrap().solve(&slope);
        let state = evaluated(&task, &[]);
        let found = DMatrix::from_fn(steps * m, 1, |i, _| state.plan.trajectory.controls.vector(i / m)[i % m]);
        assert_matrix_near("controls", &found, &DMatrix::from_column_slice(steps * m, 1, controls.as_slice()), 1e-10);
        assert_near("nominal cost", state.cost.nominal, constant + 0.5 * slope.dot(&controls), 1e-11);
    }
}

fn problem(task: Task) -> Problem {
    Problem { tasks: vec![task], ..supple_file::parse(FILE, "test").unwrap() }
}

#[test]
fn every_derivative_is_that_of_its_function() {
    let report = check(&problem(affine_task(130).2), &[]).unwrap();
    for row in &report.tasks[0].rows {
        assert!(row.passed, "{row:?}");
    }
    assert!(report.passed && report.tasks[0].rows.len() >= 6);
}

/// All is linear and the cost quadratic, so the prediction is exact: also what is added to state and measurement, and
/// the noise of each step, have to be right in plan, filter and simulation for that.
#[test]
fn closed_loop_costs_what_is_predicted() {
    let (_, _, task) = affine_task(140);
    let options = EvaluateOptions { rollouts: 20_000, seed: 1, ..Default::default() };
    let found = problem(task).evaluate(&[], &options).unwrap();
    let sampled = found.tasks[0].monte_carlo.as_ref().unwrap();
    assert!(sampled.cost_standard_error < 0.01 * sampled.cost_mean.abs(), "{sampled:?}");
    let off = sampled.difference / sampled.cost_standard_error;
    assert!(off.abs() < 4.0, "{off} standard errors off");
}

#[test]
fn a_part_of_the_steps_is_not_a_task() {
    let system = TimeVarying::random((3, 1, 1, 8), 150);
    let task = system.task();
    let message = |task: Task| task.check(&Parameters::default()).unwrap_err().to_string();
    let shorter = Task { steps: 7, ..task.clone() };
    assert_eq!(message(shorter), "steps: must be 8, as many as the system has; found 7");
    let list = |count: usize, order: usize| Covariance::Sequence(repeated(&DMatrix::identity(order, order), count));
    let with = |process: Covariance, measurement: Covariance| {
        message(Task {
            noise: NoiseModel { initial: full(&system.x0), process, measurement, varying: Vec::new() },
            ..task.clone()
        })
    };
    assert_eq!(with(list(9, 3), list(9, 1)), "noise.process: must be 8 matrices of 3 x 3; found 9 of 3 x 3");
    assert_eq!(with(list(8, 3), list(8, 1)), "noise.measurement: must be 9 matrices of 1 x 1; found 8 of 1 x 1");
    assert_eq!(with(list(8, 2), list(9, 1)), "noise.process: must be 8 matrices of 3 x 3; found 8 of 2 x 2");
    let uneven = |i: usize, j: usize| Value::Number(if i == j { 1.0 } else { 0.25 * i as f64 });
    let uneven = Covariance::Full((0..3).map(|i| (0..3).map(|j| uneven(i, j)).collect()).collect());
    let expected = "noise.process[1][0]: must be symmetric up to rounding: [1][0] is 0.25, and [0][1] is 0";
    assert_eq!(with(uneven, list(9, 1)), expected);
    let mut indefinite = repeated(&DMatrix::identity(3, 3), 8);
    [(0, 2), (2, 0)].into_iter().for_each(|(i, j)| indefinite.set(5, i, j, 2.0));
    let expected = "noise.process[5]: must be positive semidefinite; its leading 3 x 3 block is not";
    assert_eq!(with(Covariance::Sequence(indefinite), list(9, 1)), expected);
    let initial = NoiseModel { initial: list(8, 3), process: list(8, 3), measurement: list(9, 1), varying: Vec::new() };
    let expected = "noise.initial: must be 1 matrix of 3 x 3; found 8 of 3 x 3";
    assert_eq!(message(Task { noise: initial, ..task.clone() }), expected);
    let elsewhere = Parameters::default().declare(Parameter::new("p", 1.0, [0.0, 2.0]));
    let expected = "initial_state[1]: uses a parameter that the problem does not have";
    let strange = task.clone().starting_at([Value::Number(0.0), elsewhere.into(), Value::Number(0.0)]);
    assert_eq!(message(strange.clone()), expected);
    let problem = Problem::new("", Parameters::default(), vec![strange]);
    let error = problem.evaluate(&[], &EvaluateOptions::default()).unwrap_err().to_string();
    assert!(error.ends_with(expected), "{error}");
    let process = Covariance::diagonal([Value::Number(0.1), elsewhere.into(), Value::Number(0.1)]);
    let noise = NoiseModel { process, ..task.noise.clone() };
    let problem = Problem::new("", Parameters::default(), vec![Task { noise, ..task.clone() }]);
    let error = problem.evaluate(&[], &EvaluateOptions::default()).unwrap_err().to_string();
    assert!(error.ends_with("noise.process[1]: uses a parameter that the problem does not have"), "{error}");
    assert_eq!(message(task.starting_at([0.0])), "initial_state: must have 3 numbers, one for each state; found 1");
}

#[test]
fn arrays_that_do_not_fit_say_which_and_how() {
    let system = TimeVarying::random((3, 2, 1, 4), 160);
    let good = system.arrays();
    let message = |arrays: Arrays| Sequence::new(4, &arrays).unwrap_err().to_string();
    let zeros = |count: usize, rows: usize, cols: usize| Matrices::zeros(count, rows, cols);
    let wrong = [
        (Arrays { A: zeros(4, 3, 2), ..good.clone() }, "each row of A has length 2, not 3"),
        (Arrays { A: zeros(5, 3, 3), ..good.clone() }, "the array A has length 5, not 4"),
        (Arrays { B: zeros(4, 2, 2), ..good.clone() }, "each column of B has length 2, not 3"),
        (Arrays { C: zeros(4, 1, 3), ..good.clone() }, "the array C has length 4, not 5"),
        (Arrays { R: zeros(4, 3, 3), ..good.clone() }, "each column of R has length 3, not 2"),
        (Arrays { S: Some(zeros(4, 2, 3)), ..good.clone() }, "each column of S has length 2, not 3"),
        (Arrays { QN: Some(zeros(2, 3, 3)), ..good.clone() }, "the array QN has length 2, not 1"),
        (Arrays { d: Some(zeros(5, 1, 2)), ..good.clone() }, "each row of d has length 2, not 1"),
        (Arrays { B: zeros(4, 3, 0), ..good.clone() }, "the list of controls has length 0, not 1"),
    ];
    for (arrays, expected) in wrong {
        assert_eq!(message(arrays), expected);
    }
    let mut infinite = good;
    infinite.Q.set(2, 0, 1, f64::NAN);
    assert_eq!(message(infinite), "the array Q is not finite at step 2");
}

/// Adjoints of each step by differences, and their sums where noise and adjoints are the same at every step.
#[test]
fn adjoints_of_the_noise_are_those_of_each_step() {
    use supple::lqg::KnotAdjoints;
    use supple::lqg::Noise;
    use supple::lqg::{Belief, BeliefAdjoint, BeliefSeeds, kalman, reverse_kalman};
    use supple::lqg::{Information, information};

    let (n, p, steps) = (3, 2, 6);
    let state = evaluated(&TimeVarying::random((n, 1, p, steps), 170).task(), &[]);
    let knots = &state.plan.knots;
    let total = |noise: &Noise| {
        let mut belief = Belief::zeros(n, p, steps);
        kalman(knots, noise, &mut belief).unwrap();
        let mut found = Information::default();
        information(&belief, noise, &mut found).unwrap();
        found.total
    };
    let reverse = |mut back: Noise| {
        let mut adjoints = KnotAdjoints::zeros(knots.dimensions, steps);
        let mut work = BeliefAdjoint::new(n, p);
        let seeds = BeliefSeeds { information: 1.0, weights: None, covariances: None };
        reverse_kalman(knots, &state.noise, &state.belief, seeds, &mut work, &mut adjoints, &mut back);
        back
    };
    let mut each = state.noise.clone();
    each.clear();
    let (each, sums) = (reverse(each), reverse(Noise::zeros(n, p)));
    type Part = fn(&mut Noise) -> &mut Matrices;
    let parts: [(&str, Part, &Matrices, &Matrices); 2] = [
        ("W", |noise| &mut noise.process, &each.process, &sums.process),
        ("V", |noise| &mut noise.measurement, &each.measurement, &sums.measurement),
    ];
    for (name, part, each, sums) in parts {
        for i in 0..each.rows() {
            for t in 0..each.count() {
                let moved = |h: f64| {
                    let mut noise = state.noise.clone();
                    let variance = part(&mut noise).get(t, i, i);
                    part(&mut noise).set(t, i, i, variance + h);
                    total(&noise)
                };
                let step = 1e-4;
                let numeric = (8.0 * (moved(step) - moved(-step)) - (moved(2.0 * step) - moved(-2.0 * step))) / 12.0;
                let (found, numeric) = (each.get(t, i, i), numeric / step);
                assert!(
                    (found - numeric).abs() < 1e-8 * (1.0 + numeric.abs()),
                    "{name} {i} at {t}: {found}, {numeric}"
                );
            }
            let sum: f64 = (0..each.count()).map(|t| each.get(t, i, i)).sum();
            assert_near(name, sums.get(0, i, i), sum, 1e-12);
        }
    }
}

#[test]
fn names_of_channels_are_those_given() {
    let system = TimeVarying::random((2, 1, 1, 3), 180);
    let sequence = Sequence::new(3, &system.arrays()).unwrap();
    assert_eq!(sequence.state_names(), ["x1", "x2"]);
    let mut channels = sequence.channels();
    channels.states[1].name = "speed".into();
    let named = sequence.clone().with_channels(channels.clone()).unwrap();
    assert_eq!(named.state_names(), ["x1", "speed"]);
    channels.controls.clear();
    let message = sequence.with_channels(channels).unwrap_err().to_string();
    assert_eq!(message, "the list of names of controls has length 0, not 1");
}

/// Constant noise and one matrix for all steps give a task of any length its own number of steps.
#[test]
fn constant_arrays_have_the_steps_that_are_asked_for() {
    let arrays = arrays_of_file(constant);
    let noise = || NoiseModel {
        initial: Covariance::diagonal([0.1, 0.2]),
        process: Covariance::diagonal([0.02, 0.03]),
        measurement: Covariance::diagonal([0.05]),
        varying: Vec::new(),
    };
    let nats = |steps: usize| {
        let system = Sequence::new(steps, &arrays).unwrap();
        evaluated(&reference::task(system, steps, numbers(&[1.0, 0.0]), &[0.0], noise()), &[]).information.total
    };
    let [few, many] = [nats(5), nats(50)];
    assert!(0.0 < few && few < many, "{few} and {many} nats");
}
