//! Directions in which random problems are changed, and slopes along them.

use nalgebra::DMatrix;
use supple_lqg::dense::{Dense, dense};
use supple_lqg::{KnotAdjoints, Matrices, Noise};

use super::random_problem::{Problem, Random};

impl Random {
    pub fn symmetric(&mut self, n: usize) -> Dense {
        let a = self.matrix(n, n);
        (&a + a.transpose()) * 0.5
    }
}

impl Problem {
    /// A direction: covariances and curvatures change by shares of themselves.
    pub fn direction(&self, seed: u64) -> Self {
        let mut random = Random(seed);
        let mut share = |a: &Dense| {
            let root = a.clone().cholesky().unwrap().l();
            &root * random.symmetric(a.nrows()) * root.transpose()
        };
        let (x0, w) = (share(&self.x0), self.w.iter().map(&mut share).collect());
        let mut v: Vec<Dense> = self.v.iter().map(&mut share).collect();
        if self.picks.is_some() {
            v.iter_mut().for_each(|v| *v = DMatrix::from_diagonal(&v.diagonal()));
        }
        let joint = self.dimensions.joint();
        let cost = self
            .cost
            .iter()
            .map(|cost| share(&cost.columns(0, joint).into_owned()).resize_horizontally(joint + 1, 0.0));
        let cost = cost.collect();
        let c = self.c.iter().map(|c| if self.picks.is_some() { c * 0.0 } else { random.matrix(c.nrows(), c.ncols()) });
        let mut c: Vec<Dense> = c.collect();
        for (along, c) in c.iter_mut().zip(&self.c) {
            // Rows that are equal stay so.
            let equal = (1..c.nrows()).filter(|&i| c.row(i) == c.row(0));
            equal.for_each(|i| along.set_row(i, &along.row(0).into_owned()));
        }
        let f = self.f.iter().map(|f| random.matrix(f.nrows(), f.ncols()) * 0.3).collect();
        Self { x0, w, v, cost, c, f, ..self.clone() }
    }

    /// `self + h direction`
    pub fn moved(&self, direction: &Self, h: f64) -> Self {
        let sums = |a: &[Dense], b: &[Dense]| a.iter().zip(b).map(|(a, b)| a + b * h).collect();
        Self {
            f: sums(&self.f, &direction.f),
            c: sums(&self.c, &direction.c),
            cost: sums(&self.cost, &direction.cost),
            x0: &self.x0 + &direction.x0 * h,
            w: sums(&self.w, &direction.w),
            v: sums(&self.v, &direction.v),
            ..self.clone()
        }
    }

    /// `sum_t <adjoint_t, direction_t>` over all matrices.
    pub fn inner(&self, adjoints: &KnotAdjoints, noise: &Noise) -> f64 {
        let of = |adjoint: &Matrices, along: &[Dense]| -> f64 {
            along.iter().enumerate().map(|(t, along)| dense(adjoint, t).dot(along)).sum()
        };
        let by_noise = of(&noise.initial, std::slice::from_ref(&self.x0)) + of(&noise.process, &self.w);
        let by_knots = of(&adjoints.dynamics, &self.f) + of(&adjoints.measurement, &self.c);
        let by_cost = if adjoints.has_cost { of(&adjoints.cost, &self.cost) } else { 0.0 };
        by_noise + of(&noise.measurement, &self.v) + by_knots + by_cost
    }
}

/// The slope of a function at 0, by differences of sixth order.
pub fn slope(function: impl Fn(f64) -> f64) -> f64 {
    const H: f64 = 2e-3;
    let odd = |k: f64| function(k * H) - function(-k * H);
    (45.0 * odd(1.0) - 9.0 * odd(2.0) + odd(3.0)) / (60.0 * H)
}
