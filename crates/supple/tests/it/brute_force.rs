//! The library against joint covariances of whole trajectories, for linear systems that vary with time.

use crate::common::reference::time_varying::{Shape, TimeVarying};
use crate::common::reference::{
    assert_matrix_near, assert_near, cases, dense, evaluated, random, random_covariance, random_matrix,
};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use supple::cost_parts;
use supple::lqg::{control_information, entropy_form, paper_form};

/// Sizes on both sides of the width of a vector register.
const SHAPES: [Shape; 8] =
    [(4, 2, 2, 12), (1, 1, 1, 5), (5, 1, 2, 20), (7, 1, 4, 6), (7, 2, 3, 9), (8, 1, 9, 8), (9, 3, 1, 7), (16, 2, 2, 5)];

/// All states and measurements without control, as linear functions of independent sources of variance 1: first those
/// of `x_0`, then those of `w_0`, `w_1`..., then those of all `v`. There are as few sources as the covariances' ranks.
struct Joint {
    n: usize,
    p: usize,
    steps: usize,
    /// How many sources `x_t` and all states before it depend on.
    sources: Vec<usize>,
    states: DMatrix<f64>,
    measurements: DMatrix<f64>,
}

/// `G` with `G G' = covariance` and as many columns as its rank.
fn factor(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = covariance.clone().symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let kept: Vec<usize> = (0..covariance.nrows()).filter(|&i| eigen.eigenvalues[i] > 1e-12 * largest).collect();
    DMatrix::from_fn(covariance.nrows(), kept.len(), |i, j| {
        eigen.eigenvectors[(i, kept[j])] * eigen.eigenvalues[kept[j]].sqrt()
    })
}

fn log_determinant(covariance: &DMatrix<f64>) -> f64 {
    let factor = covariance.clone().cholesky().unwrap().unpack();
    2.0 * factor.diagonal().map(f64::ln).sum()
}

fn stack(above: &DMatrix<f64>, below: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(above.nrows() + below.nrows(), above.ncols(), |i, j| {
        if i < above.nrows() { above[(i, j)] } else { below[(i - above.nrows(), j)] }
    })
}

impl Joint {
    fn of(system: &TimeVarying) -> Self {
        let (n, p, steps) = (system.start.len(), system.v[0].nrows(), system.steps());
        let factors = |list: &[DMatrix<f64>]| list.iter().map(factor).collect::<Vec<_>>();
        let (x0, w, v) = (factor(&system.x0), factors(&system.w), factors(&system.v));
        let ranks = w.iter().map(DMatrix::ncols);
        let ends = ranks.scan(x0.ncols(), |end, rank| {
            *end += rank;
            Some(*end)
        });
        let sources: Vec<usize> = std::iter::once(x0.ncols()).chain(ends).collect();
        let total = sources[steps] + (steps + 1) * p;
        let mut states = DMatrix::zeros((steps + 1) * n, total);
        let mut measurements = DMatrix::zeros((steps + 1) * p, total);
        let mut x = DMatrix::zeros(n, total);
        x.columns_mut(0, x0.ncols()).copy_from(&x0);
        for t in 0..=steps {
            states.rows_mut(t * n, n).copy_from(&x);
            let mut y = &system.c[t] * &x;
            y.columns_mut(sources[steps] + t * p, p).copy_from(&v[t]);
            measurements.rows_mut(t * p, p).copy_from(&y);
            if t < steps {
                x = &system.a[t] * x;
                x.columns_mut(sources[t], w[t].ncols()).copy_from(&w[t]);
            }
        }
        Self { n, p, steps, sources, states, measurements }
    }

    /// The map to `y_0` up to and without `y_end`.
    fn y(&self, end: usize) -> DMatrix<f64> {
        self.measurements.rows(0, end * self.p).into_owned()
    }

    /// `I(x^t; y_t | y^{t-1})` from log-determinants of the joint covariance of what `past` gives for `x^t` and of `y`.
    fn information_given(&self, past: impl Fn(usize) -> DMatrix<f64>) -> Vec<f64> {
        let entropy = |map: &DMatrix<f64>| 0.5 * log_determinant(&(map * map.transpose()));
        let step = |t: usize| {
            let (before, now, past) = (self.y(t), self.y(t + 1), past(t));
            entropy(&now) - entropy(&before) - entropy(&stack(&past, &now)) + entropy(&stack(&past, &before))
        };
        (0..=self.steps).map(step).collect()
    }

    /// The information per step, from covariances of states and measurements.
    fn information(&self) -> Vec<f64> {
        self.information_given(|t| self.states.rows(0, (t + 1) * self.n).into_owned())
    }

    /// The same with the sources of `x^t` in place of `x^t`: to know one is to know the other, and unlike states that
    /// are functions of one another, sources have a regular covariance.
    fn information_of_sources(&self) -> Vec<f64> {
        self.information_given(|t| DMatrix::identity(self.sources[t], self.states.ncols()))
    }

    /// The covariance of `x_t` given all `y` before `y_end`.
    fn conditional(&self, t: usize, end: usize) -> DMatrix<f64> {
        let (x, y) = (self.states.rows(t * self.n, self.n), self.y(end));
        let cross = x * y.transpose();
        let solved = (&y * y.transpose()).cholesky().unwrap().solve(&cross.transpose());
        x * x.transpose() - cross * solved
    }
}

/// Expected costs of `u = ubar + K dmu` over what the mean costs, by the covariance of `(dx, dmu)` in closed loop.
struct ClosedLoop<'a> {
    system: &'a TimeVarying,
    feedback: &'a [DMatrix<f64>],
    /// Filter gains; with none of them the state is known exactly.
    gains: Option<&'a [DMatrix<f64>]>,
}

impl ClosedLoop<'_> {
    fn cost(&self, x0: &DMatrix<f64>, w: &[DMatrix<f64>]) -> f64 {
        let TimeVarying { a, b, c, q, r, v, .. } = self.system;
        let n = x0.nrows();
        let (one, zero) = (DMatrix::identity(n, n), DMatrix::zeros(n, n));
        let block = |[[p11, p12], [p21, p22]]: [[&DMatrix<f64>; 2]; 2]| {
            let rows = [[p11, p12], [p21, p22]].map(|[left, right]| {
                DMatrix::from_fn(n, 2 * n, |i, j| if j < n { left[(i, j)] } else { right[(i, j - n)] })
            });
            stack(&rows[0], &rows[1])
        };
        let mut covariance = block([[x0, &zero], [&zero, &zero]]);
        let mut sum = 0.0;
        for t in 0..=self.system.steps() {
            covariance = match self.gains {
                // dmu += L (C dx + v - C dmu)
                Some(gains) => {
                    let through = &gains[t] * &c[t];
                    let map = block([[&one, &zero], [&through, &(&one - &through)]]);
                    let noise = &gains[t] * &v[t] * gains[t].transpose();
                    &map * &covariance * map.transpose() + block([[&zero, &zero], [&zero, &noise]])
                }
                None => {
                    let map = block([[&one, &zero], [&one, &zero]]);
                    &map * &covariance * map.transpose()
                }
            };
            sum += (&q[t] * covariance.view((0, 0), (n, n))).trace();
            if t < self.system.steps() {
                let k = &self.feedback[t];
                sum += (&r[t] * k * covariance.view((n, n), (n, n)) * k.transpose()).trace();
                let input = &b[t] * k;
                let map = block([[&a[t], &input], [&zero, &(&a[t] + &input)]]);
                covariance = &map * covariance * map.transpose() + block([[&w[t], &zero], [&zero, &zero]]);
            }
        }
        sum
    }
}

fn list(matrices: &supple::Matrices) -> Vec<DMatrix<f64>> {
    (0..matrices.count()).map(|t| dense(matrices, t)).collect()
}

#[test]
fn both_forms_of_the_information_equal_that_of_the_joint_covariance() {
    for (seed, shape) in SHAPES.into_iter().enumerate() {
        let system = TimeVarying::random(shape, seed as u64);
        let state = evaluated(&system.task(), &[]);
        let expected = Joint::of(&system).information();
        for (t, expected) in expected.iter().enumerate() {
            assert_near("information of a step", state.information.per_step[t], *expected, 1e-9);
        }
        let total: f64 = expected.iter().sum();
        assert_near("innovation form", state.information.total, total, 1e-10);
        assert_near("entropy form", entropy_form(&state.belief).unwrap(), total, 1e-10);
    }
}

#[test]
fn paper_form_is_off_by_the_last_posterior_against_the_first_prior() {
    for (seed, shape) in SHAPES.into_iter().enumerate() {
        let system = TimeVarying::random(shape, 10 + seed as u64);
        let state = evaluated(&system.task(), &[]);
        let joint = Joint::of(&system);
        let (steps, total) = (system.steps(), joint.information().iter().sum::<f64>());
        let last = log_determinant(&joint.conditional(steps, steps + 1));
        let offset = 0.5 * last - 0.5 * log_determinant(&system.x0);
        assert!(offset.abs() > 1e-2, "the two forms differ here");
        assert_near("paper's form", paper_form(&state.belief).unwrap(), total + offset, 1e-10);
    }
}

#[test]
fn belief_is_the_covariance_given_the_measurements() {
    for (seed, shape) in SHAPES.into_iter().enumerate() {
        let system = TimeVarying::random(shape, 20 + seed as u64);
        let belief = evaluated(&system.task(), &[]).belief;
        let joint = Joint::of(&system);
        for t in 0..=system.steps() {
            assert_matrix_near("P", &dense(&belief.predicted, t), &joint.conditional(t, t), 1e-11);
            assert_matrix_near("Sigma", &dense(&belief.corrected, t), &joint.conditional(t, t + 1), 1e-11);
        }
    }
}

#[test]
fn information_of_a_singular_system_equals_that_of_its_sources() {
    let shape = (4, 2, 2, 12);
    let regular = TimeVarying::random(shape, 30);
    let held = regular.clone().hold(1);
    let mut known = held.clone();
    known.x0.row_mut(1).fill(0.0);
    known.x0.column_mut(1).fill(0.0);
    let mut exact = held.clone();
    exact.x0.fill(0.0);
    let mut low_rank = held.clone();
    let thin = DMatrix::from_fn(4, 1, |i, _| if i == 1 { 0.0 } else { 0.3 + i as f64 });
    low_rank.w = (0..12).map(|t| &thin * thin.transpose() * (1.0 + t as f64)).collect();
    let mut quiet = held.clone();
    quiet.w.iter_mut().for_each(|w| w.fill(0.0));

    for (number, system) in [regular, held, known, exact, low_rank, quiet].into_iter().enumerate() {
        let state = evaluated(&system.task(), &[]);
        let expected = Joint::of(&system).information_of_sources();
        for (t, expected) in expected.iter().enumerate() {
            let found = state.information.per_step[t];
            assert!(
                (found - expected).abs() < 1e-11 * (1.0 + expected),
                "system {number}, step {t}: {found} {expected}"
            );
        }
        assert_near("total", state.information.total, expected.iter().sum(), 1e-11);
    }
}

#[test]
fn constant_state_has_an_entropy_form_unless_it_is_known() {
    let mut system = TimeVarying::random((3, 2, 2, 12), 31).hold(2);
    let state = evaluated(&system.task(), &[]);
    assert_near("by entropies", entropy_form(&state.belief).unwrap(), state.information.total, 1e-10);
    system.x0.row_mut(2).fill(0.0);
    system.x0.column_mut(2).fill(0.0);
    let belief = evaluated(&system.task(), &[]).belief;
    assert_eq!((entropy_form(&belief), paper_form(&belief)), (None, None));
}

#[test]
fn every_part_of_the_expected_cost_equals_that_of_the_closed_loop() {
    for (seed, shape) in SHAPES.into_iter().enumerate() {
        for held in [false, true] {
            let mut system = TimeVarying::random(shape, 40 + seed as u64);
            if held {
                system = system.hold(0);
            }
            let state = evaluated(&system.task(), &[]);
            let feedback = list(&state.plan.policy.feedback);
            let gains: Vec<_> = list(&state.belief.gain_transposed).iter().map(DMatrix::transpose).collect();
            let nothing = DMatrix::zeros(system.x0.nrows(), system.x0.nrows());
            let quiet = vec![nothing.clone(); system.steps()];
            let exact = ClosedLoop { system: &system, feedback: &feedback, gains: None };
            let filtered = ClosedLoop { gains: Some(&gains), ..exact };

            let initial = exact.cost(&system.x0, &quiet);
            let process = exact.cost(&nothing, &system.w);
            let over_nominal = filtered.cost(&system.x0, &system.w);
            let cost = state.cost;
            assert_near("initial cost", cost.initial, initial, 1e-11);
            assert_near("process cost", cost.process, process, 1e-11);
            assert_near("belief cost", cost.belief, over_nominal - initial - process, 1e-9);
            assert_near("expected cost", cost.expected() - cost.nominal, over_nominal, 1e-11);
            let again = cost_parts(state.plan.nominal_cost, &state.plan.policy, &state.belief, &state.noise).unwrap();
            assert_eq!(again, cost, "the parts depend on plan, belief and noise alone");
        }
    }
}

#[test]
fn nominal_plan_solves_the_stacked_least_squares_problem() {
    for (seed, shape) in SHAPES.into_iter().enumerate() {
        let system = TimeVarying::random(shape, 50 + seed as u64);
        let (n, m, steps) = (system.start.len(), shape.1, shape.3);
        // x_t = free + forced u, so the cost is quadratic in all controls at once.
        let mut forced = DMatrix::zeros(n, steps * m);
        let mut free = system.start.clone();
        let (mut hessian, mut slope) = (DMatrix::zeros(steps * m, steps * m), DVector::zeros(steps * m));
        let mut constant = 0.0;
        for t in 0..=steps {
            let weighted = forced.transpose() * &system.q[t];
            hessian += &weighted * &forced;
            slope += weighted * &free;
            constant += free.dot(&(&system.q[t] * &free));
            if t < steps {
                let mut own = hessian.view_mut((t * m, t * m), (m, m));
                own += &system.r[t];
                forced = &system.a[t] * forced;
                forced.columns_mut(t * m, m).copy_from(&system.b[t]);
                free = &system.a[t] * free;
            }
        }
        let controls = -hessian.cholesky().unwrap().solve(&slope);
        let state = evaluated(&system.task(), &[]);
        let found = DMatrix::from_fn(steps * m, 1, |i, _| state.plan.trajectory.controls.vector(i / m)[i % m]);
        assert_matrix_near("controls", &found, &DMatrix::from_column_slice(steps * m, 1, controls.as_slice()), 1e-10);
        assert_near("nominal cost", state.cost.nominal, constant + slope.dot(&controls), 1e-11);
    }
}

#[test]
fn no_other_feedback_or_filter_is_cheaper() {
    let system = TimeVarying::random((3, 2, 2, 12), 60);
    let state = evaluated(&system.task(), &[]);
    let feedback = list(&state.plan.policy.feedback);
    let gains: Vec<_> = list(&state.belief.gain_transposed).iter().map(DMatrix::transpose).collect();
    let cost = |feedback: &[DMatrix<f64>], gains: &[DMatrix<f64>]| {
        ClosedLoop { system: &system, feedback, gains: Some(gains) }.cost(&system.x0, &system.w)
    };
    let best = cost(&feedback, &gains);
    let rng = &mut ChaCha8Rng::seed_from_u64(61);
    for _ in 0..20 {
        let mut moved = |list: &[DMatrix<f64>], size: f64| -> Vec<_> {
            list.iter().map(|gain| gain + random_matrix(rng, gain.nrows(), gain.ncols()) * size).collect()
        };
        let rises = [1e-2, 1e-4].map(|size| (cost(&moved(&feedback, size), &gains) - best) / (size * size));
        assert!(rises.iter().all(|&rise| rise > 0.0), "feedback: {rises:?}");
        let rises = [1e-2, 1e-4].map(|size| (cost(&feedback, &moved(&gains, size)) - best) / (size * size));
        assert!(rises.iter().all(|&rise| rise > 0.0), "filter: {rises:?}");
    }
}

/// Smallest eigenvalue over the largest.
fn definiteness(matrix: &DMatrix<f64>) -> f64 {
    let eigenvalues = matrix.clone().symmetric_eigenvalues();
    eigenvalues.min() / eigenvalues.max().max(f64::MIN_POSITIVE)
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn information_is_never_negative_and_a_sensor_never_lowers_it(
        shape in (1usize..6, 1usize..3, 1usize..4, 1usize..20),
        held in any::<bool>(),
        seed in any::<u64>(),
    ) {
        let (n, m, p, steps) = shape;
        let mut more = TimeVarying::random((n, m, p + 1, steps), seed);
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        more.v = (0..=steps).map(|_| random_covariance(rng, p + 1, 1e-3)).collect();
        if held {
            more = more.hold(0);
        }
        let mut fewer = more.clone();
        fewer.v = more.v.iter().map(|v| v.view((0, 0), (p, p)).into_owned()).collect();
        fewer.c = more.c.iter().map(|c| c.rows(0, p).into_owned()).collect();
        let [fewer, more] = [fewer, more].map(|system| evaluated(&system.task(), &[]).information.per_step);
        let (mut before, mut after) = (0.0, 0.0);
        for (t, (fewer, more)) in fewer.iter().zip(&more).enumerate() {
            prop_assert!(*fewer >= 0.0 && *more >= 0.0, "step {t}: {fewer} and {more}");
            before += fewer;
            after += more;
            prop_assert!(after >= before * (1.0 - 1e-13), "to step {t}: {after} with one sensor more than {before}");
        }
    }

    #[test]
    fn covariances_are_symmetric_and_semidefinite_and_measuring_never_adds_to_them(
        shape in (1usize..8, 1usize..3, 1usize..9, 1usize..20),
        held in any::<bool>(),
        seed in any::<u64>(),
    ) {
        let mut system = TimeVarying::random(shape, seed);
        if held {
            system = system.hold(shape.0 - 1);
        }
        let belief = evaluated(&system.task(), &[]).belief;
        for t in 0..=shape.3 {
            let (p, sigma) = (dense(&belief.predicted, t), dense(&belief.corrected, t));
            prop_assert_eq!(&sigma, &sigma.transpose());
            prop_assert_eq!(&p, &p.transpose());
            prop_assert!(definiteness(&sigma) >= -1e-14, "Sigma at {}: {}", t, definiteness(&sigma));
            let lost = (&p - &sigma).symmetric_eigenvalues().min();
            prop_assert!(lost >= -1e-13 * p.norm(), "P - Sigma at {}: {}", t, lost);
        }
    }
}

/// Everything in closed loop, `u = K mu`, as linear functions of the same sources as in `Joint`.
struct Loop {
    n: usize,
    m: usize,
    states: DMatrix<f64>,
    controls: DMatrix<f64>,
}

impl Loop {
    fn of(system: &TimeVarying, feedback: &[DMatrix<f64>], gains: &[DMatrix<f64>]) -> Self {
        let TimeVarying { a, b, c, x0, w, v, .. } = system;
        let (n, m, p, steps) = (x0.nrows(), b[0].ncols(), v[0].nrows(), system.steps());
        let total = n + steps * n + (steps + 1) * p;
        let mut states = DMatrix::zeros((steps + 1) * n, total);
        let mut controls = DMatrix::zeros(steps * m, total);
        let mut x = DMatrix::zeros(n, total);
        x.columns_mut(0, n).copy_from(&factor(x0));
        let mut predicted = DMatrix::zeros(n, total);
        for t in 0..=steps {
            states.rows_mut(t * n, n).copy_from(&x);
            if t == steps {
                break;
            }
            let mut y = &c[t] * &x;
            y.columns_mut(n + steps * n + t * p, p).copy_from(&factor(&v[t]));
            let mean = &predicted + &gains[t] * (y - &c[t] * &predicted);
            let u = &feedback[t] * &mean;
            controls.rows_mut(t * m, m).copy_from(&u);
            x = &a[t] * x + &b[t] * &u;
            let mut noise = x.columns_mut(n + t * n, n);
            noise += factor(&w[t]);
            predicted = &a[t] * mean + &b[t] * u;
        }
        Self { n, m, states, controls }
    }

    /// `I(x^t; u_t | u^{t-1})` at every control, from log-determinants of joint covariances.
    fn information(&self) -> Vec<f64> {
        let entropy = |map: &DMatrix<f64>| {
            if map.nrows() == 0 { 0.0 } else { 0.5 * log_determinant(&(map * map.transpose())) }
        };
        let controls = |end: usize| self.controls.rows(0, end * self.m).into_owned();
        let step = |t: usize| {
            let past = self.states.rows(0, (t + 1) * self.n).into_owned();
            let (before, now) = (controls(t), controls(t + 1));
            entropy(&now) - entropy(&before) - entropy(&stack(&past, &now)) + entropy(&stack(&past, &before))
        };
        (0..self.controls.nrows() / self.m).map(step).collect()
    }
}

/// What reaches the controls, by the library, and by joint covariances of the closed loop.
fn control_informations(system: &TimeVarying) -> (Vec<f64>, Vec<f64>) {
    let state = evaluated(&system.task(), &[]);
    let (knots, policy) = (&state.plan.knots, &state.plan.policy);
    let gains: Vec<_> = list(&state.belief.gain_transposed).iter().map(DMatrix::transpose).collect();
    let expected = Loop::of(system, &list(&policy.feedback), &gains).information();
    (control_information(knots, policy, &state.belief, &state.noise).unwrap(), expected)
}

#[test]
fn information_that_reaches_the_controls_equals_that_of_the_joint_covariance() {
    let shapes = [(4, 2, 2, 8), (1, 1, 1, 5), (5, 1, 2, 10), (7, 1, 4, 6), (7, 2, 3, 7), (3, 2, 5, 6), (6, 3, 3, 4)];
    for (seed, shape) in shapes.into_iter().enumerate() {
        let (found, expected) = control_informations(&TimeVarying::random(shape, 70 + seed as u64));
        for (t, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert!((found - expected).abs() < 1e-9, "shape {shape:?}, step {t}: {found} {expected}");
        }
    }
}

#[test]
fn controls_that_tell_all_measurements_carry_all_their_information() {
    for (seed, shape) in [(9, 3, 1, 7), (5, 4, 2, 9), (16, 3, 3, 6)].into_iter().enumerate() {
        let system = TimeVarying::random(shape, 80 + seed as u64);
        let state = evaluated(&system.task(), &[]);
        let found = control_information(&state.plan.knots, &state.plan.policy, &state.belief, &state.noise).unwrap();
        for (t, (found, measured)) in found.iter().zip(&state.information.per_step).enumerate() {
            assert!((found - measured).abs() < 1e-9 * (1.0 + measured), "{shape:?}, step {t}: {found} {measured}");
        }
    }
}

#[test]
fn controls_never_carry_more_than_the_measurements() {
    let mut strict = 0;
    for seed in 0..1000 {
        let rng = &mut ChaCha8Rng::seed_from_u64(1000 + seed);
        let mut up_to = |most: usize| 1 + (random(rng).abs() * most as f64) as usize % most;
        let shape = (up_to(7), up_to(4), up_to(5), up_to(20));
        let mut system = TimeVarying::random(shape, 1000 + seed);
        if seed % 4 == 0 {
            system = system.hold(0);
        }
        let state = evaluated(&system.task(), &[]);
        let carried = control_information(&state.plan.knots, &state.plan.policy, &state.belief, &state.noise).unwrap();
        let (mut u, mut y) = (0.0, 0.0);
        for (t, (carried, measured)) in carried.iter().zip(&state.information.per_step).enumerate() {
            (u, y) = (u + carried, y + measured);
            assert!(*carried >= 0.0 && u <= y * (1.0 + 1e-9) + 1e-12, "{shape:?}, to step {t}: {u} and {y}");
        }
        strict += usize::from(u < 0.99 * y);
    }
    assert!(strict > 200, "controls lose information in most systems: {strict}");
}
