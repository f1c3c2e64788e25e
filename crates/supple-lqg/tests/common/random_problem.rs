//! Random problems that change from step to step, the numbers that sweeps find of them, and their textbook forms.

use nalgebra::DMatrix;
use supple_lqg::dense::{Dense, store};
use supple_lqg::{Dimensions, Knots, Matrices, Noise};

/// Numbers between -1 and 1.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    }

    pub fn matrix(&mut self, rows: usize, cols: usize) -> Dense {
        DMatrix::from_fn(rows, cols, |_, _| self.next())
    }

    /// Positive definite, with eigenvalues around 1.
    pub fn covariance(&mut self, n: usize) -> Dense {
        let root = self.matrix(n, n);
        &root * root.transpose() / n as f64 + Dense::identity(n, n) * 0.2
    }
}

/// A problem as plain lists of matrices; also a direction in which one is changed.
#[derive(Clone)]
pub struct Problem {
    pub dimensions: Dimensions,
    /// `[A B]`
    pub f: Vec<Dense>,
    pub c: Vec<Dense>,
    /// `[l_zz | l_z]`
    pub cost: Vec<Dense>,
    pub x0: Dense,
    pub w: Vec<Dense>,
    pub v: Vec<Dense>,
    pub picks: Option<Vec<usize>>,
}

impl Problem {
    /// A problem with coupled noise in every matrix.
    pub fn random((n, m, p): (usize, usize, usize), steps: usize, seed: u64) -> Self {
        let mut random = Random(seed);
        let joint = n + m;
        let knot = |random: &mut Random| {
            let mut cost = Dense::zeros(joint, joint + 1);
            cost.columns_mut(0, joint).copy_from(&random.covariance(joint));
            cost.set_column(joint, &random.matrix(joint, 1).column(0));
            cost
        };
        Self {
            dimensions: Dimensions { states: n, controls: m, measurements: p },
            f: (0..steps).map(|_| random.matrix(n, joint) / (n as f64).sqrt()).collect(),
            c: (0..=steps).map(|_| random.matrix(p, n)).collect(),
            cost: (0..=steps).map(|_| knot(&mut random)).collect(),
            x0: random.covariance(n),
            w: (0..steps).map(|_| random.covariance(n) * 0.1).collect(),
            v: (0..=steps).map(|_| random.covariance(p) * 0.3).collect(),
            picks: None,
        }
    }

    /// The same with measurements that are states with independent noise.
    pub fn picking(mut self, picks: &[usize], seed: u64) -> Self {
        let (n, p, mut random) = (self.dimensions.states, picks.len(), Random(seed));
        self.dimensions.measurements = p;
        self.c.fill(DMatrix::from_fn(p, n, |i, j| f64::from(u8::from(picks[i] == j))));
        for v in &mut self.v {
            *v = DMatrix::from_fn(p, p, |i, j| if i == j { 0.4 + 0.3 * random.next() } else { 0.0 });
        }
        self.picks = Some(picks.to_vec());
        self
    }

    /// The same with positions that follow rates at every other step.
    pub fn carried(mut self, dt: f64) -> Self {
        let half = self.dimensions.states / 2;
        for f in self.f.iter_mut().step_by(2) {
            let rates = f.rows(half, half).into_owned();
            f.rows_mut(0, half).copy_from(&(rates * dt));
            (0..half).for_each(|i| f[(i, i)] += 1.0);
        }
        self
    }

    pub fn steps(&self) -> usize {
        self.f.len()
    }

    pub fn knots(&self) -> Knots {
        let mut knots = Knots::zeros(self.dimensions, self.steps());
        self.f.iter().enumerate().for_each(|(t, f)| store(&mut knots.dynamics, t, f));
        self.c.iter().enumerate().for_each(|(t, c)| store(&mut knots.measurement, t, c));
        self.cost.iter().enumerate().for_each(|(t, cost)| store(&mut knots.cost, t, cost));
        knots.picks.clone_from(&self.picks);
        knots
    }

    /// Zero noise of the right shapes, different at each step.
    pub fn no_noise(&self) -> Noise {
        let Dimensions { states: n, measurements: p, .. } = self.dimensions;
        Noise {
            initial: Matrices::constant(n, n),
            process: Matrices::zeros(self.steps(), n, n),
            measurement: Matrices::zeros(self.steps() + 1, p, p),
        }
    }

    pub fn noise(&self) -> Noise {
        let mut noise = self.no_noise();
        store(&mut noise.initial, 0, &self.x0);
        self.w.iter().enumerate().for_each(|(t, w)| store(&mut noise.process, t, w));
        self.v.iter().enumerate().for_each(|(t, v)| store(&mut noise.measurement, t, v));
        noise
    }
}
