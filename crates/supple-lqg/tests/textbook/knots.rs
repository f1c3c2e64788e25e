//! Structure of knots that sweeps make use of, and numbers that they refuse.

use supple_lqg::dense::dense;
use supple_lqg::{Error, Policy, Regularisation, solve_riccati};

use crate::random_problem::Problem;
use crate::{assert_close, believed};

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
