//! The filter, what it takes in, and several filters in step with one another.

use nalgebra::DMatrix;
use supple_lqg::dense::{Dense, dense, store};
use supple_lqg::{
    Belief, BeliefAdjoint, BeliefSeeds, Error, Information, Innovation, KnotAdjoints, Matrices, Noise, SampleNoise,
    correct_each, entropy_form, information, paper_form, predict_each, recursion_radius, reverse_kalman,
    spectral_radius,
};

use crate::random_problem::{Problem, Random};
use crate::{SHAPES, assert_close, believed, log_determinant};

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
        let each = SampleNoise::Each(&noise.measurement);
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
        let refused = correct_each(&knots, picks.as_ref().map(|picks| &picks[..]), SampleNoise::Each(&bad), &mut batch);
        let what = "the innovation covariance of a filter";
        assert_eq!(refused, Err(Error::NotPositiveDefinite { what, step: 2 }));
    }
}

#[test]
fn without_sensors_only_the_plant_is_predicted() {
    for (seed, (n, m, _)) in SHAPES.into_iter().enumerate() {
        let problem = Problem::random((n, m, 0), 5, 3 + seed as u64);
        let belief = believed(&problem);
        let mut prior = problem.x0.clone();
        for t in 0..=problem.steps() {
            assert_close("P", &dense(&belief.predicted, t), &prior, 1e-12);
            assert_close("Sigma", &dense(&belief.corrected, t), &prior, 1e-12);
            if t < problem.steps() {
                let a = problem.f[t].columns(0, n);
                prior = a * prior * a.transpose() + &problem.w[t];
            }
        }
        let mut found = Information::default();
        information(&belief, &problem.noise(), &mut found).unwrap();
        assert_eq!(found.total, 0.0);
        let weights = Matrices::zeros(problem.steps(), n, n);
        let seeds = BeliefSeeds { weights: Some((&weights, 1.0)), information: 1.0, covariances: None };
        let mut adjoints = KnotAdjoints::zeros(problem.dimensions, problem.steps());
        let mut by_noise = Noise::zeros(n, 0);
        let work = &mut BeliefAdjoint::new(n, 0);
        reverse_kalman(&problem.knots(), &problem.noise(), &belief, seeds, work, &mut adjoints, &mut by_noise);
        assert_eq!(by_noise.initial.as_slice(), Noise::zeros(n, 0).initial.as_slice(), "no information depends on it");
    }
}
