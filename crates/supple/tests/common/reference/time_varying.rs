use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use supple::noise::{Covariance, NoiseModel};
use supple::system::{Arrays, Sequence};
use supple::{Matrices, Task};

use super::{full, numbers, random, random_covariance, random_matrix, task};

/// A linear system whose matrices and noise differ from step to step, with costs `x'Qx + u'Ru`.
#[derive(Clone)]
pub struct TimeVarying {
    pub a: Vec<DMatrix<f64>>,
    pub b: Vec<DMatrix<f64>>,
    pub c: Vec<DMatrix<f64>>,
    /// The last one is that of the final cost.
    pub q: Vec<DMatrix<f64>>,
    pub r: Vec<DMatrix<f64>>,
    pub start: DVector<f64>,
    pub x0: DMatrix<f64>,
    pub w: Vec<DMatrix<f64>>,
    pub v: Vec<DMatrix<f64>>,
}

/// Number of states, of controls, of measurements, and of steps.
pub type Shape = (usize, usize, usize, usize);

impl TimeVarying {
    /// Random matrices, with regular covariances.
    pub fn random((n, controls, measurements, steps): Shape, seed: u64) -> Self {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let gain = 1.5 / (n as f64).sqrt();
        Self {
            a: (0..steps).map(|_| random_matrix(rng, n, n) * gain).collect(),
            b: (0..steps).map(|_| random_matrix(rng, n, controls)).collect(),
            c: (0..=steps).map(|_| random_matrix(rng, measurements, n)).collect(),
            q: (0..=steps).map(|_| random_covariance(rng, n, 0.0)).collect(),
            r: (0..steps).map(|_| random_covariance(rng, controls, 0.5)).collect(),
            start: DVector::from_fn(n, |_, _| random(rng)),
            x0: random_covariance(rng, n, 0.1),
            w: (0..steps).map(|_| random_covariance(rng, n, 0.05) * 0.3).collect(),
            v: (0..=steps).map(|_| random_covariance(rng, measurements, 0.1) * 0.5).collect(),
        }
    }

    /// The same noise at every step.
    pub fn with_equal_noise(mut self) -> Self {
        let (w, v) = (self.w[0].clone(), self.v[0].clone());
        self.w.fill(w);
        self.v.fill(v);
        self
    }

    /// Holds state `index` constant: no dynamics, no noise.
    pub fn hold(mut self, index: usize) -> Self {
        for a in &mut self.a {
            a.row_mut(index).fill(0.0);
            a[(index, index)] = 1.0;
        }
        for b in &mut self.b {
            b.row_mut(index).fill(0.0);
        }
        for w in &mut self.w {
            w.row_mut(index).fill(0.0);
            w.column_mut(index).fill(0.0);
        }
        self
    }

    pub fn steps(&self) -> usize {
        self.a.len()
    }

    pub fn arrays(&self) -> Arrays {
        let steps = self.steps();
        Arrays {
            QN: Some(sequence(&self.q[steps..])),
            ..Arrays::new([&self.a, &self.b, &self.c, &self.q[..steps], &self.r].map(sequence))
        }
    }

    pub fn task(&self) -> Task {
        let [process, measurement] = [&self.w, &self.v].map(|list| Covariance::Sequence(sequence(list)));
        let noise = NoiseModel { initial: full(&self.x0), process, measurement, varying: Vec::new() };
        self.task_with(noise)
    }

    /// The task with other noise than its own.
    pub fn task_with(&self, noise: NoiseModel) -> Task {
        let system = Sequence::new(self.steps(), &self.arrays()).unwrap();
        let controls = vec![0.0; self.b[0].ncols()];
        task(system, self.steps(), numbers(self.start.as_slice()), &controls, noise)
    }
}

/// One matrix per step.
pub fn sequence(list: &[DMatrix<f64>]) -> Matrices {
    let mut out = Matrices::zeros(list.len(), list[0].nrows(), list[0].ncols());
    for (t, matrix) in list.iter().enumerate() {
        for i in 0..matrix.nrows() {
            for j in 0..matrix.ncols() {
                out.set(t, i, j, matrix[(i, j)]);
            }
        }
    }
    out
}
