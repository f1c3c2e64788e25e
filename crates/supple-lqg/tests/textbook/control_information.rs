//! Information that reaches the controls, by joint covariances of whole trajectories.

use supple_lqg::dense::{Dense, dense, store};
use supple_lqg::{Belief, Dimensions, Policy, control_information};

use crate::believed;
use crate::random_problem::{Problem, Random};

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
    let shapes = [(4, 2, 2), (1, 1, 1), (5, 1, 2), (3, 2, 5), (6, 3, 3), (4, 3, 1), (2, 9, 1), (17, 3, 9), (9, 2, 17)];
    for (seed, shape) in shapes.into_iter().enumerate() {
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
