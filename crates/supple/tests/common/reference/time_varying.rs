use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use supple::noise::NoiseModel;
use supple::system::{Curvature, KnotAdjoints, Points, System, Variation};
use supple::{Dimensions, Matrices, Scratch, Task};

use super::{full, numbers, random, random_covariance, random_matrix, task};

/// A linear system whose matrices differ from step to step, with costs `x'Qx + u'Ru`.
///
/// Its last state is a clock that only says which step it is: the matrices keep it apart from everything else, and no
/// cost or measurement sees it.
#[derive(Clone)]
pub struct TimeVarying {
    pub a: Vec<DMatrix<f64>>,
    pub b: Vec<DMatrix<f64>>,
    pub c: Vec<DMatrix<f64>>,
    pub q: Vec<DMatrix<f64>>,
    pub r: Vec<DMatrix<f64>>,
    pub start: DVector<f64>,
    pub x0: DMatrix<f64>,
    pub w: DMatrix<f64>,
    pub v: DMatrix<f64>,
}

/// Number of states without the clock, of controls, of measurements, and of steps.
pub type Shape = (usize, usize, usize, usize);

impl TimeVarying {
    /// Random matrices, with regular covariances.
    pub fn random((states, controls, measurements, steps): Shape, seed: u64) -> Self {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let n = states + 1;
        let apart = |matrix: DMatrix<f64>, clock: f64| {
            let mut matrix = matrix.resize(n, n, 0.0);
            matrix[(states, states)] = clock;
            matrix
        };
        let gain = 1.5 / (states as f64).sqrt();
        let mut start = DVector::from_fn(n, |_, _| random(rng));
        start[states] = 0.0;
        Self {
            a: (0..steps).map(|_| apart(random_matrix(rng, states, states) * gain, 1.0)).collect(),
            b: (0..steps).map(|_| random_matrix(rng, states, controls).resize_vertically(n, 0.0)).collect(),
            c: (0..=steps).map(|_| random_matrix(rng, measurements, states).resize_horizontally(n, 0.0)).collect(),
            q: (0..=steps).map(|_| apart(random_covariance(rng, states, 0.0), 0.0)).collect(),
            r: (0..steps).map(|_| random_covariance(rng, controls, 0.5)).collect(),
            start,
            x0: apart(random_covariance(rng, states, 0.1), 0.5),
            w: apart(random_covariance(rng, states, 0.05) * 0.3, 0.2),
            v: random_covariance(rng, measurements, 0.1) * 0.5,
        }
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
        self.w.row_mut(index).fill(0.0);
        self.w.column_mut(index).fill(0.0);
        self
    }

    pub fn steps(&self) -> usize {
        self.a.len()
    }

    pub fn task(&self) -> Task {
        let noise = NoiseModel { initial: full(&self.x0), process: full(&self.w), measurement: full(&self.v) };
        let controls = vec![0.0; self.b[0].ncols()];
        task(self.clone(), self.steps(), numbers(self.start.as_slice()), &controls, noise)
    }

    fn clock(&self, x: &[f64]) -> usize {
        x[x.len() - 1].round() as usize
    }
}

fn quadratic(weight: &DMatrix<f64>, x: &[f64]) -> f64 {
    let x = DVector::from_column_slice(x);
    x.dot(&(weight * &x))
}

impl System for TimeVarying {
    fn dimensions(&self) -> Dimensions {
        Dimensions { states: self.start.len(), controls: self.b[0].ncols(), measurements: self.v.nrows() }
    }

    fn state_names(&self) -> Vec<String> {
        (1..=self.start.len()).map(|i| format!("x{i}")).collect()
    }

    fn depends_on(&self, parameters: usize) -> Vec<bool> {
        vec![false; parameters]
    }

    fn step(&self, _: usize, x: &[f64], u: &[f64], _: &[f64], next: &mut [f64]) {
        let t = self.clock(x);
        let result = &self.a[t] * DVector::from_column_slice(x) + &self.b[t] * DVector::from_column_slice(u);
        next.copy_from_slice(result.as_slice());
        next[x.len() - 1] = (t + 1) as f64;
    }

    fn observe(&self, _: usize, x: &[f64], _: &[f64], y: &mut [f64]) {
        y.copy_from_slice((&self.c[self.clock(x)] * DVector::from_column_slice(x)).as_slice());
    }

    fn stage_cost(&self, _: usize, x: &[f64], u: &[f64], _: &[f64], _: &mut Scratch) -> f64 {
        let t = self.clock(x);
        quadratic(&self.q[t], x) + quadratic(&self.r[t], u)
    }

    fn final_cost(&self, x: &[f64], _: &[f64], _: &mut Scratch) -> f64 {
        quadratic(&self.q[self.clock(x)], x)
    }

    fn dynamics_jacobians(&self, at: Points, _: &[f64], out: &mut Matrices, _: &mut Scratch) {
        for i in 0..at.stages {
            let t = self.clock(at.states.vector(i));
            write(out, i, (0, 0), &self.a[t]);
            write(out, i, (0, self.a[t].ncols()), &self.b[t]);
        }
    }

    fn measurement_jacobians(&self, at: Points, _: &[f64], out: &mut Matrices, _: &mut Scratch) {
        for i in 0..at.count() {
            write(out, i, (0, 0), &self.c[self.clock(at.states.vector(i))]);
        }
    }

    fn cost_quadratics(&self, at: Points, _: &[f64], _: Curvature, out: &mut Matrices, _: &mut Scratch) {
        let (n, joint) = (self.start.len(), self.dimensions().joint());
        for i in 0..at.count() {
            let x = at.states.vector(i);
            let t = self.clock(x);
            write(out, i, (0, 0), &(&self.q[t] * 2.0));
            write(out, i, (0, joint), &(&self.q[t] * DMatrix::from_column_slice(n, 1, x) * 2.0));
            if i < at.stages {
                let u = DMatrix::from_column_slice(joint - n, 1, at.controls.vector(i));
                write(out, i, (n, n), &(&self.r[t] * 2.0));
                write(out, i, (n, joint), &(&self.r[t] * u * 2.0));
            }
        }
    }

    fn add_dynamics_curvature(&self, _: Points, _: &[f64], _: &Matrices, _: &mut Matrices, _: &mut Scratch) {}

    fn contract(&self, _: Points, _: &[f64], _: &KnotAdjoints, _: &mut Matrices, _: &mut [f64], _: &mut Scratch) {}

    fn add_parameter_gradient(
        &self,
        _: Points,
        _: &[f64],
        _: &Matrices,
        _: Option<Variation>,
        _: &mut [f64],
        _: &mut Scratch,
    ) {
    }
}

fn write(out: &mut Matrices, index: usize, (row, col): (usize, usize), block: &DMatrix<f64>) {
    for i in 0..block.nrows() {
        for j in 0..block.ncols() {
            out.set(index, row + i, col + j, block[(i, j)]);
        }
    }
}
