//! Second derivatives of dynamics with the unknowns as variables, by programs whose size grows with the dynamics and
//! their sparsity; that of [all of them](super::Recorder::dynamics_curvature) grows with the cube of the unknowns.

use supple_kernels::graph::{Node, Program, Target, record, vjp};
use supple_kernels::{Scalar, padded};

use super::Recorder;
use crate::Model;

/// Second derivatives of `lambda' F + mu' r` by `(z, w)`: those that are not always 0.
#[derive(Debug)]
pub(in crate::system) struct SecondDerivatives {
    /// Rows of length k: for each of `mixed` with respect to `w`; then, if there are [any](Self::by_unknowns), halves of
    /// those with respect to `w` twice; then those for each of `pairs`, one after the other.
    pub program: Program,
    /// Variables of `z` with mixed second derivatives with the unknowns; all of them if `by_unknowns`.
    pub mixed: Vec<usize>,
    /// Whether there are second derivatives with respect to the unknowns twice.
    pub by_unknowns: bool,
    /// Pairs of variables of `z`, the greater number first.
    pub pairs: Vec<[usize; 2]>,
    /// The number of rows.
    pub rows: usize,
}

impl<M: Model> Recorder<'_, M> {
    /// `(lambda' F + mu' r)''` by `(z, w)`, given the [responses](Self::responses) as the source `DYNAMICS`.
    pub fn second_derivatives(&self) -> SecondDerivatives {
        record(|| {
            let (variables, gradient) = self.slopes_beside();
            let k = self.model.unknowns();
            let (joint, stride) = (variables.len() - k, padded(k));
            // The lower triangle.
            let row = |a: usize| vjp(&[(gradient[a], Node::one())], &variables[..=a]);
            let hessian: Vec<Vec<Node>> = (0..variables.len()).map(row).collect();

            let entry = |a: usize, b: usize| hessian[a.max(b)][a.min(b)];
            let varies = |a: usize, b: usize| !entry(a, b).is_zero();
            let unknowns = joint..joint + k;
            let by_unknowns = unknowns.clone().any(|a| unknowns.clone().any(|b| varies(a, b)));
            let mixed: Vec<usize> =
                (0..joint).filter(|&a| by_unknowns || unknowns.clone().any(|l| varies(a, l))).collect();
            let pairs: Vec<[usize; 2]> =
                (0..joint).flat_map(|a| (0..=a).map(move |b| [a, b])).filter(|&[a, b]| varies(a, b)).collect();

            let rows = mixed.iter().copied().chain(unknowns.clone().filter(|_| by_unknowns));
            let beside = |(place, a): (usize, usize)| (0..k).map(move |l| (place * stride + l, a, joint + l));
            let unpacked = mixed.len() + if by_unknowns { k } else { 0 };
            let packed = unpacked * stride;
            let places = rows.enumerate().flat_map(beside);
            let places = places.chain(pairs.iter().enumerate().map(|(i, &[a, b])| (packed + i, a, b)));
            let output = |(offset, a, b): (usize, usize, usize)| {
                let share = if a < joint { 1.0 } else { 0.5 };
                varies(a, b).then(|| (entry(a, b) * share, Target::Set { sink: 0, offset }))
            };
            let program = Program::compile(&places.filter_map(output).collect::<Vec<_>>());
            let rows = unpacked + pairs.len().div_ceil(stride.max(1));
            SecondDerivatives { program, mixed, by_unknowns, pairs, rows }
        })
    }
}
