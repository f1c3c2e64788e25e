//! The control law of every step, and solutions along a horizon.

use nalgebra::DVector;
use supple_lqg::dense::{Dense, dense};
use supple_lqg::{Decrease, Dimensions, Error, Matrices, Policy, Regularisation, solve_lq, solve_riccati};

use crate::random_problem::Problem;
use crate::{SHAPES, assert_close};

/// Gains and cost-to-go of one step by (P.2), with the gains given or found by `gains` from `Q` and `Q_z`.
pub fn backwards(
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

pub fn assert_decrease(found: Decrease, expected: Decrease) {
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
        let found = solve_riccati(&knots.dynamics, &knots.cost, regularisation, &mut policy);
        assert_eq!(found, Err(Error::NotPositiveDefinite { what: "the control's curvature", step: 4 }));
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
