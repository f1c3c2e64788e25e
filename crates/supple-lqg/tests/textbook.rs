//! What the sweeps find against the same formulas as textbooks write them, in dense matrices, and against joint
//! covariances of whole trajectories.
#![allow(clippy::unwrap_used)]

#[path = "common/random_problem.rs"]
mod random_problem;

use nalgebra::{DMatrix, DVector};
use random_problem::{Problem, Random};
use supple_lqg::dense::{Dense, dense, store};
use supple_lqg::{
    Belief, ControlBounds, Decrease, Dimensions, Error, Information, Innovation, Limits, Lq, Matrices, Policy,
    Regularisation, control_information, correct_each, entropy_form, information, kalman, mend, paper_form,
    predict_each, recursion_radius, solve_limited, solve_lq, solve_riccati, spectral_radius,
};

const SHAPES: [(usize, usize, usize); 6] = [(1, 1, 1), (3, 2, 2), (5, 1, 4), (8, 3, 3), (9, 2, 6), (17, 3, 9)];

fn assert_close(what: &str, found: &Dense, expected: &Dense, within: f64) {
    assert_eq!(found.shape(), expected.shape(), "{what}");
    let worst = (found - expected).amax();
    assert!(worst <= within * expected.amax().max(1e-300), "{what}: off by {worst:e}: {found} {expected}");
}

fn log_determinant(a: &Dense) -> f64 {
    2.0 * a.clone().cholesky().unwrap().l().diagonal().map(f64::ln).sum()
}

fn believed(problem: &Problem) -> Belief {
    let Dimensions { states: n, measurements: p, .. } = problem.dimensions;
    let mut belief = Belief::zeros(n, p, problem.steps());
    kalman(&problem.knots(), &problem.noise(), &mut belief).unwrap();
    belief
}

#[test]
fn filters_and_their_information() {
    for (seed, shape) in SHAPES.into_iter().enumerate() {
        let problem = Problem::random(shape, 5, 3 + seed as u64);
        let (belief, n) = (believed(&problem), shape.0);
        let mut found = Information::default();
        information(&belief, &problem.noise(), &mut found).unwrap();
        let (mut prior, mut posteriors, mut priors) = (problem.x0.clone(), Vec::new(), Vec::new());
        for t in 0..=5 {
            let (c, v) = (&problem.c[t], &problem.v[t]);
            let s = c * &prior * c.transpose() + v;
            let gain = &prior * c.transpose() * s.clone().try_inverse().unwrap();
            let posterior = (Dense::identity(n, n) - &gain * c) * &prior;
            assert_close("P", &dense(&belief.predicted, t), &prior, 1e-11);
            assert_close("Sigma", &dense(&belief.corrected, t), &posterior, 1e-10);
            assert_close("L", &dense(&belief.gain_transposed, t).transpose(), &gain, 1e-10);
            let y = dense(&belief.innovation_factor, t).lower_triangle();
            assert_close("S", &(&y * y.transpose()), &s, 1e-11);
            let nats = 0.5 * (log_determinant(&s) - log_determinant(v));
            assert!((found.per_step[t] - nats).abs() < 1e-11 * nats, "{t}: {} {nats}", found.per_step[t]);
            posteriors.push(log_determinant(&posterior));
            priors.push(log_determinant(&prior));
            if t < 5 {
                let a = problem.f[t].columns(0, n);
                prior = a * &posterior * a.transpose() + &problem.w[t];
            }
        }
        assert_eq!(belief.repairs, 0);
        assert!((found.total - found.per_step.iter().sum::<f64>()).abs() < 1e-12);
        assert!((entropy_form(&belief).unwrap() - found.total).abs() < 1e-9, "{shape:?}");
        let paper: f64 = (0..5).map(|t| 0.5 * (priors[t + 1] - posteriors[t])).sum();
        assert!((paper_form(&belief).unwrap() - paper).abs() < 1e-9, "{shape:?}");
    }
}

#[test]
fn information_needs_a_noise_that_is_positive_definite_at_every_step() {
    let problem = Problem::random((3, 1, 2), 4, 1);
    let belief = believed(&problem);
    let mut noise = problem.noise();
    store(&mut noise.measurement, 3, &Dense::zeros(2, 2));
    let refused = information(&belief, &noise, &mut Information::default()).unwrap_err();
    assert_eq!(refused, Error::NotPositiveDefinite { what: "the measurement covariance", step: 3 });
    let known = Problem { x0: Dense::zeros(3, 3), ..problem };
    assert_eq!(entropy_form(&believed(&known)), None, "a state that is known has no entropy");
}

/// Gains and cost-to-go of one step by (P.2), with the gains given or found by `gains` from `Q` and `Q_z`.
fn backwards(
    problem: &Problem,
    policy: &Policy,
    gains: impl Fn(usize, &Dense, &DVector<f64>, &Dense) -> (Dense, DVector<f64>),
) -> Decrease {
    let Dimensions { states: n, controls: m, .. } = problem.dimensions;
    let (joint, steps) = (n + m, problem.steps());
    let mut s = problem.cost[steps].view((0, 0), (n, n)).into_owned();
    let mut slope = problem.cost[steps].view((0, joint), (n, 1)).column(0).into_owned();
    let mut decrease = Decrease::default();
    for t in (0..steps).rev() {
        assert_close("S", &dense(&policy.curvature, t + 1), &s, 1e-10);
        let f = &problem.f[t];
        let q = problem.cost[t].columns(0, joint) + f.transpose() * &s * f;
        let q_z = problem.cost[t].column(joint) + f.transpose() * &slope;
        let (feedback, k) = gains(t, &q, &q_z, &s);
        assert_close("K", &dense(&policy.feedback, t), &feedback, 1e-9);
        let found = DVector::from_column_slice(&policy.feedforward.vector(t)[..m]);
        assert!((&found - &k).amax() <= 1e-9 * k.amax().max(1.0), "{t}: {found} {k}");
        let q_uu = q.view((n, n), (m, m));
        assert_close("Xi", &dense(&policy.value_of_information, t), &(feedback.transpose() * q_uu * &feedback), 1e-8);
        let mut closed = Dense::identity(joint, n);
        closed.rows_mut(n, m).copy_from(&feedback);
        let mut moved = DVector::zeros(joint);
        moved.rows_mut(n, m).copy_from(&k);
        decrease.linear += k.dot(&q_z.rows(n, m));
        decrease.quadratic += 0.5 * k.dot(&(q_uu * &k));
        slope = closed.transpose() * (&q * moved + q_z);
        s = closed.transpose() * q * closed;
        let found = DVector::from_column_slice(&policy.slope.vector(t)[..n]);
        assert!((&found - &slope).amax() <= 1e-9 * slope.amax(), "{t}: {found} {slope}");
    }
    assert_close("S", &dense(&policy.curvature, 0), &s, 1e-10);
    decrease
}

fn assert_decrease(found: Decrease, expected: Decrease) {
    let close = |found: f64, expected: f64| (found - expected).abs() <= 1e-9 * expected.abs();
    assert!(
        close(found.linear, expected.linear) && close(found.quadratic, expected.quadratic),
        "{found:?} {expected:?}"
    );
}

#[test]
fn riccati_sweeps_and_their_regularisation() {
    for (seed, shape) in SHAPES.into_iter().chain([(24, 4, 1)]).enumerate() {
        let mut problem = Problem::random(shape, 4, 13 + seed as u64);
        if shape.0 == 24 {
            problem = problem.carried(0.1);
        }
        let (n, m, knots) = (shape.0, shape.1, problem.knots());
        for (control, state) in [(0.0, 0.0), (0.5, 0.0), (0.0, 0.3), (0.2, 0.1)] {
            let regularisation = Regularisation { control, state };
            let mut policy = Policy::zeros(problem.dimensions, 4);
            policy.clamped.fill(true);
            let found = solve_riccati(&knots.dynamics, &knots.cost, regularisation, &mut policy).unwrap();
            assert!(policy.held().is_none());
            let expected = backwards(&problem, &policy, |t, q, q_z, s| {
                let f = &problem.f[t];
                let more = Dense::from_diagonal(&s.diagonal().map(|v| state * v.abs()));
                let q = q + f.transpose() * more * f;
                let mut q_uu = q.view((n, n), (m, m)).into_owned();
                (0..m).for_each(|a| q_uu[(a, a)] *= 1.0 + control);
                let factor = q_uu.cholesky().unwrap();
                (-factor.solve(&q.view((n, 0), (m, n)).into_owned()), -factor.solve(&q_z.rows(n, m).into_owned()))
            });
            assert_decrease(found, expected);
        }
    }
}

#[test]
fn a_step_whose_controls_have_no_minimum_is_named() {
    let mut problem = Problem::random((3, 2, 1), 6, 2);
    problem.cost[4].view_mut((3, 3), (2, 2)).fill_with_identity();
    problem.cost[4][(4, 4)] = -100.0;
    let knots = problem.knots();
    for state in [0.0, 1e-3] {
        let regularisation = Regularisation { state, ..Regularisation::default() };
        let mut policy = Policy::zeros(problem.dimensions, 6);
        assert_eq!(solve_riccati(&knots.dynamics, &knots.cost, regularisation, &mut policy), Err(4));
    }
}

/// The least of `1/2 k' H k + q' k` over a box, by trying which controls are at which bound.
fn least_in_box(h: &Dense, q: &DVector<f64>, (lower, upper): (&[f64], &[f64])) -> (DVector<f64>, Vec<bool>) {
    let m = q.len();
    let mut best: Option<(f64, DVector<f64>, Vec<bool>)> = None;
    for code in 0..3_usize.pow(m as u32) {
        let states: Vec<usize> = (0..m as u32).map(|a| code / 3_usize.pow(a) % 3).collect();
        let free: Vec<usize> = (0..m).filter(|&a| states[a] == 0).collect();
        let mut k = DVector::from_fn(m, |a, _| [0.0, lower[a], upper[a]][states[a]]);
        if k.iter().any(|v| v.is_infinite()) {
            continue;
        }
        let right = -(h * &k + q).select_rows(&free);
        let left = h.select_rows(&free).select_columns(&free);
        let solved = if free.is_empty() { right } else { left.lu().solve(&right).unwrap() };
        free.iter().zip(&solved).for_each(|(&a, v)| k[a] = *v);
        let value = 0.5 * k.dot(&(h * &k)) + q.dot(&k);
        let inside = (0..m).all(|a| k[a] >= lower[a] && k[a] <= upper[a]);
        if inside && best.as_ref().is_none_or(|(least, ..)| value < *least) {
            best = Some((value, k, states.iter().map(|&state| state != 0).collect()));
        }
    }
    best.map(|(_, k, held)| (k, held)).unwrap()
}

/// Gains of the controls that are free, and rows of 0 of the others.
fn free_gains(q: &Dense, n: usize, held: &[bool]) -> Dense {
    let m = held.len();
    let free: Vec<usize> = (0..m).filter(|&a| !held[a]).collect();
    let mut feedback = Dense::zeros(m, n);
    if free.is_empty() {
        return feedback;
    }
    let q_uu = q.view((n, n), (m, m)).into_owned().select_rows(&free).select_columns(&free);
    let gains = -q_uu.cholesky().unwrap().solve(&q.view((n, 0), (m, n)).into_owned().select_rows(&free));
    free.iter().enumerate().for_each(|(row, &a)| feedback.set_row(a, &gains.row(row)));
    feedback
}

#[test]
fn sweeps_within_limits_of_the_controls() {
    let mut met = 0;
    for (seed, shape) in [(2, 1, 1), (3, 2, 1), (4, 3, 1), (9, 4, 1), (18, 3, 1)].into_iter().enumerate() {
        let problem = Problem::random(shape, 5, 61 + seed as u64);
        let ((n, m, _), knots, mut random) = (shape, problem.knots(), Random(5));
        let bounds: Vec<(f64, f64)> =
            (0..m).map(|a| if a == 3 { (f64::NEG_INFINITY, 0.2) } else { (-0.2 - 0.1 * a as f64, 0.25) }).collect();
        let bounds = ControlBounds::new(&bounds);
        let mut controls = Matrices::vectors(5, m);
        (0..5).for_each(|t| controls.vector_mut(t)[..m].iter_mut().for_each(|u| *u = 0.3 * random.next()));
        bounds.clamp_all(&mut controls);
        assert!(bounds.hold(&controls));
        let lq = |limits| Lq {
            dynamics: &knots.dynamics,
            cost: &knots.cost,
            regularisation: Regularisation::default(),
            limits: Some(limits),
            with_value: true,
        };
        let mut policy = Policy::zeros(problem.dimensions, 5);
        let found = solve_limited(lq(Limits::Bounds(&bounds, &controls)), &mut policy).unwrap();
        let clamped = policy.clamped.clone();
        met += clamped.iter().filter(|held| **held).count();
        let expected = backwards(&problem, &policy, |t, q, q_z, _| {
            let room = |to: &[f64]| to.iter().zip(controls.vector(t)).map(|(to, u)| to - u).collect::<Vec<_>>();
            let (lower, upper) = (room(bounds.lower()), room(bounds.upper()));
            let h = q.view((n, n), (m, m)).into_owned();
            let (k, held) = least_in_box(&h, &q_z.rows(n, m).into_owned(), (&lower, &upper));
            assert_eq!(held, clamped[t * m..(t + 1) * m], "{shape:?} {t}");
            (free_gains(q, n, &held), k)
        });
        assert_decrease(found, expected);

        // The same controls held: those that are free still move.
        let held = policy.clamped.clone();
        let mut again = Policy::zeros(problem.dimensions, 5);
        let found = solve_limited(lq(policy.held().unwrap()), &mut again).unwrap();
        let expected = backwards(&problem, &again, |t, q, q_z, _| {
            let held = &held[t * m..(t + 1) * m];
            let free: Vec<usize> = (0..m).filter(|&a| !held[a]).collect();
            let mut k = DVector::zeros(m);
            if !free.is_empty() {
                let q_uu = q.view((n, n), (m, m)).into_owned().select_rows(&free).select_columns(&free);
                let solved = -q_uu.cholesky().unwrap().solve(&q_z.rows(n, m).select_rows(&free));
                free.iter().zip(&solved).for_each(|(&a, v)| k[a] = *v);
            }
            (free_gains(q, n, held), k)
        });
        assert_decrease(found, expected);
    }
    assert!(met > 10, "limits are met: {met}");
}

#[test]
fn bounds_of_controls() {
    let bounds = ControlBounds::new(&[(-1.0, 2.0), (0.5, 0.5)]);
    assert_eq!((bounds.lower(), bounds.upper()), (&[-1.0, 0.5][..], &[2.0, 0.5][..]));
    let mut u = [-3.0, 7.0];
    bounds.clamp(&mut u);
    assert_eq!(u, [-1.0, 0.5]);
    let of = |u: [f64; 2]| {
        let mut controls = Matrices::vectors(2, 2);
        controls.vector_mut(0)[1] = 0.5;
        controls.vector_mut(1)[..2].copy_from_slice(&u);
        controls
    };
    // Inside; at a bound, which counts as inside; outside on either side.
    let cases = [
        ([0.0, 0.5], true, false),
        ([2.0, 0.5], true, true),
        ([-1.0, 0.5], true, true),
        ([2.1, 0.5], false, false),
        ([-1.1, 0.5], false, false),
        ([0.0, 0.6], false, false),
    ];
    for (u, hold, met) in cases {
        assert_eq!((bounds.hold(&of(u)), bounds.are_met(&of(u))), (hold, met), "{u:?}");
    }
    // A slope counts unless going downhill leads out of the box.
    for (u, slope, left) in [
        (0.0, 3.0, 3.0),
        (0.0, -3.0, -3.0),
        (-1.0, 3.0, 0.0),
        (-1.0, -3.0, -3.0),
        (2.0, -3.0, 0.0),
        (2.0, 3.0, 3.0),
        (-1.5, 1.0, 0.0),
        (2.5, -1.0, 0.0),
    ] {
        assert_eq!(bounds.project(0, u, slope), left, "{u} {slope}");
    }
}

/// A step of the linear-quadratic problem satisfies the conditions of optimality.
#[test]
fn solutions_along_a_horizon_are_stationary() {
    for (seed, shape) in SHAPES.into_iter().enumerate() {
        let problem = Problem::random(shape, 4, 23 + seed as u64);
        let ((n, m, _), knots) = (shape, problem.knots());
        let joint = n + m;
        let mut policy = Policy::zeros(problem.dimensions, 4);
        solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy).unwrap();
        let (mut moved, mut costates) = (Matrices::vectors(5, joint), Matrices::vectors(5, n));
        moved.as_mut_slice().fill(9.0);
        solve_lq(&knots.dynamics, &policy, &mut moved, &mut costates);
        let z = |t: usize| DVector::from_column_slice(&moved.vector(t)[..joint]);
        let costate = |t: usize| DVector::from_column_slice(&costates.vector(t)[..n]);
        assert!(z(0).rows(0, n).amax() == 0.0 && z(4).rows(n, m).amax() == 0.0 && z(1).amax() > 1e-3);
        for t in 0..=4 {
            let mut slope = problem.cost[t].columns(0, joint) * z(t) + problem.cost[t].column(joint);
            if t < 4 {
                slope += problem.f[t].transpose() * costate(t + 1);
                assert!(slope.rows(n, m).amax() < 1e-11, "{shape:?} {t}: controls could do better");
                assert!((&problem.f[t] * z(t) - z(t + 1).rows(0, n)).amax() < 1e-12, "{shape:?} {t}");
            }
            assert!((slope.rows(0, n) - costate(t)).amax() < 1e-11, "{shape:?} {t}");
        }
    }
}

/// States and controls of the closed loop `u = K mu` as maps of all sources of uncertainty.
fn closed_loop(problem: &Problem, feedback: &[Dense], belief: &Belief) -> (Vec<Dense>, Vec<Dense>) {
    let Dimensions { states: n, controls: m, measurements: p } = problem.dimensions;
    let steps = problem.steps();
    let total = n + steps * n + (steps + 1) * p;
    let factor = |a: &Dense| a.clone().cholesky().unwrap().l();
    let (mut states, mut controls) = (Vec::new(), Vec::new());
    let (mut x, mut predicted) = (Dense::zeros(n, total), Dense::zeros(n, total));
    x.columns_mut(0, n).copy_from(&factor(&problem.x0));
    for (t, feedback) in feedback.iter().enumerate() {
        states.push(x.clone());
        let mut y = &problem.c[t] * &x;
        y.columns_mut(n + steps * n + t * p, p).copy_from(&factor(&problem.v[t]));
        let mean = &predicted + dense(&belief.gain_transposed, t).transpose() * (y - &problem.c[t] * &predicted);
        let u = feedback * &mean;
        let (a, b) = (problem.f[t].columns(0, n), problem.f[t].columns(n, m));
        x = a * x + b * &u;
        let mut noise = x.columns_mut(n + t * n, n);
        noise += factor(&problem.w[t]);
        predicted = a * mean + b * &u;
        controls.push(u);
    }
    (states, controls)
}

/// The variances of rows given earlier rows and given, by orthogonal projection: `1/2 log` of their ratio, summed.
fn told_by(problem: &Problem, feedback: &[Dense], belief: &Belief) -> Vec<f64> {
    let (states, controls) = closed_loop(problem, feedback, belief);
    let stack = |parts: &[Dense]| {
        let rows: Vec<_> = parts.iter().flat_map(|part| part.row_iter()).collect();
        if rows.is_empty() { Dense::zeros(0, states[0].ncols()) } else { Dense::from_rows(&rows) }
    };
    // What is left of a row across those before it.
    let across = |row: &Dense, before: &Dense| {
        if before.nrows() == 0 {
            return row.clone();
        }
        let svd = before.clone().svd(false, true);
        let (largest, v) = (svd.singular_values.max(), svd.v_t.unwrap());
        let kept: Vec<usize> = (0..v.nrows()).filter(|&k| svd.singular_values[k] > 1e-9 * largest).collect();
        let v = v.select_rows(&kept);
        let once = row - row * v.transpose() * &v;
        &once - &once * v.transpose() * &v
    };
    let mut nats = Vec::new();
    for t in 0..controls.len() {
        let (mut past, known) = (controls[..t].to_vec(), stack(&states[..=t]));
        let mut told = 0.0;
        for row in controls[t].row_iter().map(|row| row.into_owned()) {
            let row = Dense::from_row_slice(1, row.ncols(), row.as_slice());
            let given = stack(&[stack(&past), known.clone()]);
            let (without, with) = (across(&row, &stack(&past)).norm(), across(&row, &given).norm());
            if with > 1e-7 * row.norm() {
                told += (without / with).ln();
            }
            past.push(row);
        }
        nats.push(told);
    }
    nats
}

#[test]
fn information_that_reaches_the_controls() {
    for (seed, shape) in [(4, 2, 2), (1, 1, 1), (5, 1, 2), (3, 2, 5), (6, 3, 3), (4, 3, 1)].into_iter().enumerate() {
        let mut problem = Problem::random(shape, 5, 41 + seed as u64);
        if seed == 5 {
            problem = problem.picking(&[2], 1);
        }
        let ((n, m, _), knots, noise, belief) = (shape, problem.knots(), problem.noise(), believed(&problem));
        let mut random = Random(7);
        let ordinary: Vec<Dense> = (0..5).map(|_| random.matrix(m, n)).collect();
        // Controls that are multiples of one another, or 0, and steps without any.
        let mut degenerate = ordinary.clone();
        for (t, feedback) in degenerate.iter_mut().enumerate() {
            if m > 1 {
                let row = feedback.row(0) * if t % 2 == 0 { 2.0 } else { 0.0 };
                feedback.set_row(1, &row);
            }
            if t == 3 {
                feedback.fill(0.0);
            }
        }
        for feedback in [&ordinary, &degenerate] {
            let mut policy = Policy::zeros(problem.dimensions, 5);
            feedback.iter().enumerate().for_each(|(t, k)| store(&mut policy.feedback, t, k));
            let found = control_information(&knots, &policy, &belief, &noise).unwrap();
            for (t, (found, expected)) in found.iter().zip(told_by(&problem, feedback, &belief)).enumerate() {
                assert!((found - expected).abs() < 1e-8, "{shape:?} {t}: {found} {expected}");
            }
        }
    }
}

#[test]
fn recursions_and_their_radius() {
    let problem = Problem::random((4, 1, 2), 5, 9);
    let belief = believed(&problem);
    let expected = (0..5)
        .map(|t| {
            let moved = problem.f[t].columns(0, 4) * dense(&belief.corrected, t);
            let recursion = dense(&belief.predicted, t + 1).try_inverse().unwrap() * moved;
            recursion.complex_eigenvalues().iter().map(|root| root.norm()).fold(0.0, f64::max)
        })
        .fold(0.0, f64::max);
    let found = recursion_radius(&problem.knots(), &belief).unwrap();
    assert!((found - expected).abs() < 1e-9 * expected, "{found} {expected}");
    let known = Problem { w: vec![Dense::zeros(4, 4); 5], x0: Dense::zeros(4, 4), ..problem };
    assert_eq!(recursion_radius(&known.knots(), &believed(&known)), None);
    // A turn by a right angle, scaled by 3; one that is no turn at all; nilpotent and empty matrices.
    let of = |entries: &[f64]| spectral_radius(DMatrix::from_row_slice(2, 2, entries));
    assert!((of(&[0.0, -3.0, 3.0, 0.0]) - 3.0).abs() < 1e-9);
    assert!((of(&[0.5, 100.0, 0.0, -0.25]) - 0.5).abs() < 1e-9);
    assert_eq!((of(&[0.0, 1.0, 0.0, 0.0]), spectral_radius(Dense::zeros(0, 0))), (0.0, 0.0));
}

/// Several filters in step with one another are the filters by themselves; what they take in is what gains say.
#[test]
fn filters_in_step_with_one_another() {
    let samples = 4;
    for (shape, picks) in
        [((5, 1, 3), None), ((5, 1, 3), Some([4, 0, 2])), ((26, 2, 3), None), ((26, 2, 3), Some([9, 3, 9]))]
    {
        let (n, p) = (shape.0, shape.2);
        let problem = Problem::random(shape, samples, 6).carried(0.1);
        let problem = picks.iter().fold(problem, |problem, picks| problem.picking(picks, 2));
        let (knots, noise, mut random) = (problem.knots(), problem.noise(), Random(3));
        let mut batch = Belief::zeros(n, p, samples - 1);
        let priors: Vec<Dense> = (0..samples).map(|_| random.covariance(n)).collect();
        priors.iter().enumerate().for_each(|(k, prior)| store(&mut batch.predicted, k, prior));
        let each = (noise.measurement.at(0), Some(&noise.measurement));
        correct_each(&knots, picks.as_ref().map(|picks| &picks[..]), each, &mut batch).unwrap();
        for (k, prior) in priors.iter().enumerate() {
            let (c, v) = (&problem.c[k], &problem.v[k]);
            let s = c * prior * c.transpose() + v;
            let gain = prior * c.transpose() * s.clone().try_inverse().unwrap();
            let posterior = prior - &gain * c * prior;
            assert_close("Sigma", &dense(&batch.corrected, k), &posterior, 1e-11);
            let nu = random.matrix(p, 1);
            let mean = random.matrix(n, 1);
            let expected = (nu.transpose() * s.clone().try_inverse().unwrap() * &nu)[(0, 0)];
            let (found, told) = if let Some(picks) = &picks {
                let measured: Vec<f64> = picks.iter().zip(&nu).map(|(&s, nu)| mean[s] + nu).collect();
                let mut moved: Vec<f64> = mean.iter().copied().collect();
                let found = batch.take_in(k, picks, &measured, &mut moved);
                (found, Dense::from_column_slice(n, 1, &moved) - mean)
            } else {
                let mut solved: Vec<f64> = nu.iter().copied().collect();
                let stride = batch.innovation_factor.stride();
                let found = Innovation::of(&mut solved, batch.innovation_factor.at(k), stride);
                (found, dense(&batch.gain_transposed, k).transpose() * &nu)
            };
            assert_close("L nu", &told, &(&gain * &nu), 1e-9);
            assert!((found.squared - expected).abs() < 1e-9 * expected, "{found:?} {expected}");
            assert!((found.log_determinant - log_determinant(&s)).abs() < 1e-9, "{found:?}");
        }
        predict_each(&knots, noise.process.at(1), &mut batch);
        for k in 0..samples {
            let a = problem.f[k].columns(0, n);
            let expected = a * dense(&batch.corrected, k) * a.transpose() + &problem.w[1];
            assert_close("P", &dense(&batch.predicted, k), &expected, 1e-12);
        }
        let mut bad = noise.measurement.clone();
        store(&mut bad, 2, &(Dense::identity(p, p) * -1e6));
        let refused = correct_each(&knots, picks.as_ref().map(|picks| &picks[..]), (bad.at(0), Some(&bad)), &mut batch);
        let what = "the innovation covariance of a filter";
        assert_eq!(refused, Err(Error::NotPositiveDefinite { what, step: 2 }));
    }
}

/// What rounding made indefinite becomes the nearest semidefinite matrix; all else stays to the last bit.
#[test]
fn covariances_are_mended_to_the_nearest_one() {
    let mut random = Random(17);
    for n in [1, 2, 3, 7, 31, 32, 33, 40] {
        for unit in [1.0, 1e-8, 1e6] {
            let root = random.matrix(n, n.div_ceil(3)) * unit;
            let mut list = Matrices::zeros(1, n, n);
            store(&mut list, 0, &(&root * root.transpose()));
            let (before, stride) = (list.clone(), list.stride());
            assert!(!mend(list.at_mut(0), n, stride), "{n} {unit}");
            assert_eq!(list.to_rows(), before.to_rows());
            let direction = random.matrix(n, 1) * unit;
            let indefinite = dense(&list, 0) - &direction * direction.transpose() * 0.5;
            store(&mut list, 0, &indefinite);
            let eigen = indefinite.clone().symmetric_eigen();
            if eigen.eigenvalues.min() > -1e-3 * unit * unit {
                continue;
            }
            assert!(mend(list.at_mut(0), n, stride), "{n} {unit}");
            let kept = Dense::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0)));
            let nearest = &eigen.eigenvectors * kept * eigen.eigenvectors.transpose();
            let worst = (dense(&list, 0) - &nearest).amax();
            assert!(worst < 1e-13 * indefinite.norm(), "{n} {unit}: {worst:e}");
        }
    }
    // Around the threshold, as shares of the variance that is left over; and rows beside a variance of 0.
    let of = |entries: [f64; 4]| mend(&mut entries.clone(), 2, 2);
    for unit in [1.0, 1e-12, 1e12] {
        assert!(!of([unit, unit, unit, unit * (1.0 - 5e-14)]), "rounding");
        assert!(of([unit, unit, unit, unit * (1.0 - 1e-12)]), "no rounding");
        assert!(!of([4.0 * unit, 2.0 * unit, 2.0 * unit, unit]));
        assert!(!of([0.0, 0.0, 0.0, unit]) && !of([unit, 0.0, 0.0, 0.0]));
        assert!(of([0.0, 1e-6 * unit, 1e-6 * unit, unit]), "a state that is known is correlated with none");
        assert!(of([-unit, 0.0, 0.0, unit]) && of([unit, 0.0, 0.0, -unit]));
    }
}

/// Large matrices count as semidefinite up to 1e-13 of their greatest eigenvalue.
#[test]
fn large_covariances_are_mended_from_the_same_share_on() {
    for (unit, less, mended) in [(1.0, 1e-12, true), (1.0, 2.5e-13, false), (1e6, 1e-12, true), (1e-8, 2.5e-13, false)]
    {
        let mut list = Matrices::zeros(1, 40, 40);
        (0..40).for_each(|i| list.set(0, i, i, if i < 38 { 0.5 * unit } else { unit }));
        list.set(0, 39, 38, unit);
        list.set(0, 38, 39, unit);
        list.set(0, 39, 39, unit * (1.0 - less));
        let stride = list.stride();
        assert_eq!(mend(list.at_mut(0), 40, stride), mended, "{unit} {less}");
        // A state that is known exactly is no reason.
        let mut known = Matrices::zeros(1, 40, 40);
        (1..40).for_each(|i| known.set(0, i, i, unit));
        assert!(!mend(known.at_mut(0), 40, stride));
    }
}

/// Positions that follow rates but for a small part are not taken to follow them.
#[test]
fn positions_that_all_but_follow_rates() {
    let (n, half) = (24, 12);
    for (row, col) in [(0, 0), (3, 3), (3, 5), (11, 20), (11, 11), (0, 23), (5, 24)] {
        for off in [1e-10, -1e-10] {
            let mut problem = Problem::random((n, 2, 1), 3, 4);
            for f in &mut problem.f {
                let rates = f.rows(half, half).into_owned();
                f.rows_mut(0, half).copy_from(&(rates * 0.1));
                (0..half).for_each(|i| f[(i, i)] += 1.0);
            }
            problem.f[1][(row, col)] += off;
            let belief = believed(&problem);
            let a = problem.f[1].columns(0, n);
            let expected = a * dense(&belief.corrected, 1) * a.transpose() + &problem.w[1];
            assert_close("P", &dense(&belief.predicted, 2), &expected, 1e-14);
            let knots = problem.knots();
            let mut policy = Policy::zeros(problem.dimensions, 3);
            solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy).unwrap();
            let s = dense(&policy.curvature, 2);
            let q = problem.cost[1].columns(0, n + 2) + problem.f[1].transpose() * s * &problem.f[1];
            let gains =
                -q.view((n, n), (2, 2)).into_owned().cholesky().unwrap().solve(&q.view((n, 0), (2, n)).into_owned());
            assert_close("K", &dense(&policy.feedback, 1), &gains, 1e-12);
        }
    }
}

/// Measurements that are states but share their noise are taken together.
#[test]
fn measurements_whose_noise_is_shared_are_taken_together() {
    let mut problem = Problem::random((5, 1, 1), 4, 8).picking(&[3, 0, 1], 2);
    assert!(problem.noise().measurements_are_independent());
    (problem.v[2][(2, 0)], problem.v[2][(0, 2)]) = (0.1, 0.1);
    assert!(!problem.noise().measurements_are_independent());
    let (picked, plain) = (believed(&problem), believed(&Problem { picks: None, ..problem.clone() }));
    assert_eq!(picked.corrected.to_rows(), plain.corrected.to_rows());
    let mut noise = problem.noise();
    noise.clear_each(4);
    assert!(
        [&noise.initial, &noise.process, &noise.measurement].iter().all(|m| m.as_slice().iter().all(|v| *v == 0.0))
    );
    assert_eq!((noise.measurement.count(), noise.measurement.is_constant()), (5, false));
    for steps in [2, 3, 6] {
        noise.clear_each(steps);
        assert_eq!((noise.measurement.count(), noise.measurement.rows()), (steps + 1, 3));
    }
    let mut constant = supple_lqg::Noise::zeros(5, 3);
    constant.measurement.set(0, 1, 1, 3.0);
    constant.clear_each(0);
    assert!(!constant.measurement.is_constant() && constant.measurement.get(0, 1, 1) == 0.0);
}

#[test]
fn numbers_that_are_not_finite_are_named() {
    let knots = Problem::random((3, 1, 2), 4, 1).knots();
    assert_eq!(knots.check_finite(), Ok(()));
    for bad in [f64::NAN, f64::INFINITY] {
        let mut parts = [knots.clone(), knots.clone(), knots.clone()];
        parts[0].dynamics.set(3, 2, 3, bad);
        parts[1].measurement.set(4, 1, 2, bad);
        parts[2].cost.set(2, 3, 4, bad);
        let expected =
            [("the dynamics' derivative", 3), ("the measurement's derivative", 4), ("the cost's derivative", 2)];
        for (knots, (what, step)) in parts.iter().zip(expected) {
            assert_eq!(knots.check_finite(), Err(Error::NotFinite { what, step }));
        }
    }
}
