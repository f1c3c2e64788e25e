use supple_kernels::graph::{Batch, Program};
use supple_kernels::{Matrices, Scratch};

use super::Points;
use super::programs::TOGETHER;

/// The programs of second derivatives for dynamics with many unknowns.
pub(super) struct Along<'a> {
    pub responses: &'a Program,
    pub curvature: &'a Program,
    /// Lengths of `z` and of the unknowns.
    pub joint: usize,
    pub unknowns: usize,
}

impl Along<'_> {
    /// Adds `(lambda' f)_zz` at every stage (theory, equation U.5): column b of `D' (lambda' F + mu' r)'' D` is `D'` times the
    /// second derivatives along `D_b = (e_b, W_b)`.
    pub fn add(&self, at: Points, phi: &[f64], costates: &Matrices, out: &mut Matrices, scratch: &mut Scratch) {
        let Self { joint, unknowns, .. } = *self;
        let stages = at.stages;
        let batch = Batch { first: 0, count: stages };
        let after = super::authored::after(costates);
        let mut responses = Matrices::zeros(stages, joint + 2, unknowns);
        let sources = [at.states.into(), at.controls.into(), after];
        self.responses.run(batch, (&sources, phi), (Some(&mut responses), &mut []), scratch);
        let mut directions = Matrices::zeros(stages, TOGETHER, joint + unknowns);
        let mut rates = Matrices::zeros(stages, TOGETHER, joint + unknowns);
        for first in (0..joint).step_by(TOGETHER) {
            let chosen = first..(first + TOGETHER).min(joint);
            for t in 0..stages {
                directions.at_mut(t).fill(0.0);
                for (place, b) in chosen.clone().enumerate() {
                    directions.set(t, place, b, 1.0);
                    for l in 0..unknowns {
                        directions.set(t, place, joint + l, responses.get(t, b, l));
                    }
                }
            }
            // What is not read stands in for sources of other programs.
            let [x, u, _] = sources;
            let sources = [x, u, after, (&responses).into(), x, x, (&directions).into()];
            self.curvature.run(batch, (&sources, phi), (Some(&mut rates), &mut []), scratch);
            for t in 0..stages {
                for (place, b) in chosen.clone().enumerate() {
                    self.add_column(b, row(&rates, t, place), (t, &responses), out.at_mut(t));
                }
            }
        }
    }

    /// Adds `D'` times the rates to column `b`, as far as the diagonal, and to its mirror image.
    fn add_column(&self, b: usize, rates: &[f64], (t, responses): (usize, &Matrices), out: &mut [f64]) {
        let stride = supple_kernels::padded(self.joint + 1);
        let (by_z, by_w) = rates.split_at(self.joint);
        for a in 0..=b {
            let sum = by_z[a] + dot(row(responses, t, a), by_w);
            out[a * stride + b] += sum;
            if a != b {
                out[b * stride + a] += sum;
            }
        }
    }
}

/// Row `i` of matrix `t`.
fn row(matrices: &Matrices, t: usize, i: usize) -> &[f64] {
    let start = i * matrices.stride();
    &matrices.at(t)[start..start + matrices.cols()]
}

/// The dot product, in eight sums side by side, which vector instructions take together.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (chunks_a, rest_a) = a.as_chunks::<8>();
    let (chunks_b, rest_b) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in chunks_a.iter().zip(chunks_b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}
