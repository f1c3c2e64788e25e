//! The control law where controls have limits.

use nalgebra::DVector;
use supple_lqg::dense::Dense;
use supple_lqg::{ControlBounds, Limits, Lq, Matrices, Policy, Regularisation, solve_limited};

use crate::random_problem::{Problem, Random};
use crate::riccati::{assert_decrease, backwards};

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
        let bounds: Vec<[f64; 2]> =
            (0..m).map(|a| if a == 3 { [f64::NEG_INFINITY, 0.2] } else { [-0.2 - 0.1 * a as f64, 0.25] }).collect();
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
    let bounds = ControlBounds::new(&[[-1.0, 2.0], [0.5, 0.5]]);
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
