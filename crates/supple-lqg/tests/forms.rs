//! What has several forms is the same in each: measurements taken together and one at a time, dynamics with and without the
//! structure that integrators give to them, small and large matrices.

use nalgebra::DMatrix;
use supple_lqg::{
    Belief, BeliefAdjoint, BeliefSeeds, Dimensions, Information, KnotAdjoints, Knots, Matrices, Noise, Policy,
    Regularisation, information, kalman, mend, reverse_kalman, solve_riccati,
};

/// Numbers between -1 and 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    }

    fn matrix(&mut self, rows: usize, cols: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, cols, |_, _| self.next())
    }

    fn covariance(&mut self, n: usize) -> DMatrix<f64> {
        let root = self.matrix(n, n);
        &root * root.transpose() / n as f64
    }
}

fn store(to: &mut Matrices, t: usize, from: &DMatrix<f64>) {
    for (i, j) in (0..from.nrows()).flat_map(|i| (0..from.ncols()).map(move |j| (i, j))) {
        to.set(t, i, j, from[(i, j)]);
    }
}

fn dense(from: &Matrices, t: usize) -> DMatrix<f64> {
    DMatrix::from_fn(from.rows(), from.cols(), |i, j| from.get(t, i, j))
}

/// Random knots that measure the states `picks`, in both forms, and noise of very different sizes.
fn problem(n: usize, picks: &[usize], steps: usize, seed: u64) -> ([Knots; 2], Noise) {
    let mut random = Random(seed);
    let dimensions = Dimensions { states: n, controls: 1, measurements: picks.len() };
    let mut knots = Knots::zeros(dimensions, steps);
    for t in 0..=steps {
        if t < steps {
            store(&mut knots.dynamics, t, &(random.matrix(n, n + 1) / (n as f64).sqrt()));
        }
        let c = DMatrix::from_fn(picks.len(), n, |i, j| f64::from(u8::from(picks[i] == j)));
        store(&mut knots.measurement, t, &c);
    }
    let mut noise = Noise::zeros(n, picks.len());
    store(&mut noise.initial, 0, &random.covariance(n));
    store(&mut noise.process, 0, &(random.covariance(n) * 0.01));
    for i in 0..picks.len() {
        noise.measurement.set(0, i, i, 10f64.powf(3.0 * random.next() - 3.0));
    }
    let picked = Knots { picks: Some(picks.to_vec()), ..knots.clone() };
    ([knots, picked], noise)
}

fn assert_close(a: &Matrices, b: &Matrices, within: f64) {
    let scale = a.as_slice().iter().fold(0.0f64, |most, v| most.max(v.abs()));
    for t in 0..a.count() {
        let worst = (dense(a, t) - dense(b, t)).abs().max();
        assert!(worst <= within * scale, "{worst:e} of {scale:e} at {t}");
    }
}

#[test]
fn measurements_together_and_one_at_a_time() {
    // Fewer than a group of them, several groups, states that are measured twice within a group and in two.
    let twice: Vec<usize> = (0..20).map(|i| (7 * i) % 12).collect();
    for (seed, (n, picks)) in [
        (1, (3, vec![2])),
        (2, (5, vec![4, 0, 4])),
        (3, (9, (0..9).collect())),
        (4, (12, twice.clone())),
        (5, (33, (0..33).rev().collect())),
        (6, (40, twice)),
    ] {
        let (knots, noise) = problem(n, &picks, 6, seed);
        let found = knots.map(|knots| {
            let mut belief = Belief::zeros(n, picks.len(), 6);
            kalman(&knots, &noise, &mut belief).unwrap();
            let mut bits = Information::default();
            information(&belief, &noise, &mut bits).unwrap();
            let (mut adjoints, mut by_noise) = (KnotAdjoints::zeros(knots.dimensions, 6), Noise::zeros(n, picks.len()));
            let mut work = BeliefAdjoint::new(n, picks.len());
            let seeds = BeliefSeeds { information: 1.0, ..BeliefSeeds::default() };
            reverse_kalman(&knots, &noise, &belief, seeds, &mut work, &mut adjoints, &mut by_noise);
            (belief, bits, adjoints, by_noise)
        });
        let [(belief, bits, adjoints, by_noise), (other, other_bits, other_adjoints, other_by_noise)] = &found;
        assert_close(&belief.corrected, &other.corrected, 1e-11);
        assert_close(&belief.predicted, &other.predicted, 1e-11);
        assert_close(&belief.gain_transposed, &other.gain_transposed, 1e-9);
        assert!((bits.total / other_bits.total - 1.0).abs() < 1e-11, "{} {}", bits.total, other_bits.total);
        assert_close(&adjoints.dynamics, &other_adjoints.dynamics, 1e-8);
        assert_close(&by_noise.process, &other_by_noise.process, 1e-8);
        assert_close(&by_noise.initial, &other_by_noise.initial, 1e-8);
    }
}

#[test]
fn positions_that_follow_rates() {
    for n in [24, 30, 46] {
        let (half, mut random) = (n / 2, Random(n as u64));
        let ([mut knots, _], noise) = problem(n, &[0, 5], 8, 9);
        for t in 0..8 {
            let rates = random.matrix(half, n + 1) / (n as f64).sqrt();
            let mut all = DMatrix::zeros(n, n + 1);
            all.view_mut((half, 0), (half, n + 1)).copy_from(&rates);
            all.view_mut((0, 0), (half, n + 1)).copy_from(&(&rates * 0.01));
            (0..half).for_each(|i| all[(i, i)] += 1.0);
            store(&mut knots.dynamics, t, &all);
        }
        let mut belief = Belief::zeros(n, 2, 8);
        kalman(&knots, &noise, &mut belief).unwrap();
        for t in 0..8 {
            let a = dense(&knots.dynamics, t).columns(0, n).into_owned();
            let expected = &a * dense(&belief.corrected, t) * a.transpose() + dense(&noise.process, 0);
            let found = dense(&belief.predicted, t + 1);
            let worst = (&found - &expected).abs().max();
            assert!(worst <= 1e-13 * expected.abs().max(), "{n} {t}: {worst:e}");
            assert_eq!(found, found.transpose(), "symmetric to the last bit");
        }
    }
}

/// Sweeps see the structure step by step: here every third step lacks it.
#[test]
fn positions_that_follow_rates_at_some_steps() {
    for (n, m, steps) in [(24, 5, 7), (30, 1, 5), (58, 29, 4)] {
        let (half, mut random) = (n / 2, Random((n + m) as u64));
        let dimensions = Dimensions { states: n, controls: m, measurements: 1 };
        let mut knots = Knots::zeros(dimensions, steps);
        let joint = n + m;
        for t in 0..=steps {
            let mut cost = DMatrix::zeros(joint, joint + 1);
            cost.view_mut((0, 0), (joint, joint))
                .copy_from(&(random.covariance(joint) + DMatrix::identity(joint, joint)));
            cost.set_column(joint, &random.matrix(joint, 1).column(0));
            store(&mut knots.cost, t, &cost);
            store(&mut knots.measurement, t, &random.matrix(1, n));
            if t < steps {
                let mut all = random.matrix(n, joint) / (n as f64).sqrt();
                if t % 3 != 2 {
                    let rates = all.rows(half, half).into_owned();
                    all.rows_mut(0, half).copy_from(&(rates * 0.01));
                    (0..half).for_each(|i| all[(i, i)] += 1.0);
                }
                store(&mut knots.dynamics, t, &all);
            }
        }
        let mut policy = Policy::zeros(dimensions, steps);
        solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy).unwrap();
        let whole = |t: usize| dense(&knots.cost, t);
        let mut s = whole(steps).view((0, 0), (n, n)).into_owned();
        let mut slope = whole(steps).view((0, joint), (n, 1)).into_owned();
        for t in (0..steps).rev() {
            let (f, cost) = (dense(&knots.dynamics, t), whole(t));
            let q = cost.columns(0, joint) + f.transpose() * &s * &f;
            let by_z = cost.columns(joint, 1) + f.transpose() * &slope;
            let solved = q.view((n, n), (m, m)).into_owned().cholesky().unwrap();
            let feedback = -solved.solve(&q.view((n, 0), (m, n)).into_owned());
            let feedforward = -solved.solve(&by_z.rows(n, m).into_owned());
            s = q.view((0, 0), (n, n)) + q.view((0, n), (n, m)) * &feedback;
            slope = by_z.rows(0, n) + q.view((0, n), (n, m)) * &feedforward;
            for (found, expected) in [
                (dense(&policy.feedback, t), feedback),
                (dense(&policy.curvature, t), s.clone()),
                (dense(&policy.slope, t), slope.transpose()),
                (dense(&policy.feedforward, t), feedforward.transpose()),
            ] {
                let worst = (&found - &expected).abs().max();
                assert!(worst <= 1e-11 * expected.abs().max(), "{n} {m} {t}: {worst:e}");
            }
        }
        let mut noise = Noise::zeros(n, 1);
        store(&mut noise.initial, 0, &random.covariance(n));
        store(&mut noise.process, 0, &(random.covariance(n) * 0.01));
        noise.measurement.set(0, 0, 0, 0.1);
        let mut belief = Belief::zeros(n, 1, steps);
        kalman(&knots, &noise, &mut belief).unwrap();
        for t in 0..steps {
            let a = dense(&knots.dynamics, t).columns(0, n).into_owned();
            let expected = &a * dense(&belief.corrected, t) * a.transpose() + dense(&noise.process, 0);
            let worst = (dense(&belief.predicted, t + 1) - &expected).abs().max();
            assert!(worst <= 1e-13 * expected.abs().max(), "{n} {t}: {worst:e}");
        }
    }
}

#[test]
fn large_matrices_are_guarded_as_small_ones_are() {
    for n in [20, 40, 64] {
        let mut random = Random(n as u64);
        // Of low rank, which rounding leaves indefinite by about 1e-16.
        let root = random.matrix(n, 5);
        let mut singular = Matrices::zeros(1, n, n);
        store(&mut singular, 0, &(&root * root.transpose()));
        let (before, stride) = (dense(&singular, 0), singular.stride());
        assert!(!mend(singular.at_mut(0), n, stride));
        assert_eq!(dense(&singular, 0), before);
        let direction = random.matrix(n, 1);
        let mut indefinite = Matrices::zeros(1, n, n);
        store(&mut indefinite, 0, &(before - &direction * direction.transpose() * 1e-3));
        assert!(mend(indefinite.at_mut(0), n, stride));
        assert!(dense(&indefinite, 0).symmetric_eigenvalues().min() > -1e-12);
        assert!(!mend(indefinite.at_mut(0), n, stride));
    }
}
