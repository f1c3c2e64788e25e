//! Second derivatives of dynamics with many unknowns along one direction, and what all of them start from.

use supple_kernels::graph::{Node, Program, Target, record, tangent, vjp};
use supple_kernels::padded;

use super::{Recorder, vector, weigh};
use crate::Model;
use crate::system::trace::{Linearised, entries, source};

impl<M: Model> Recorder<'_, M> {
    /// Responses of the unknowns (theory, equations U.2 and U.4), as rows of length k: `W_j` for every variable of `z`, then
    /// the multipliers `mu` of the costates, then `w` itself.
    pub fn responses(&self) -> Program {
        record(|| {
            let trace = self.trace(false);
            let dynamics = trace.dynamics_to_linearise();
            let Linearised { f_w, directions, .. } = dynamics.linearise(&trace.z);
            let lambda = entries(source::COSTATE, dynamics.next.len());
            let mu = dynamics.multipliers(&f_w, &lambda);
            let rows = directions.iter().chain([&mu, &dynamics.w]);
            let stride = padded(dynamics.w.len());
            let of_row = |(j, row): (usize, &Vec<Node>)| {
                let target = move |l| Target::Set { sink: 0, offset: j * stride + l };
                row.iter().enumerate().map(move |(l, &entry)| (entry, target(l))).collect::<Vec<_>>()
            };
            Program::compile(&rows.enumerate().flat_map(of_row).collect::<Vec<_>>())
        })
    }

    /// `(lambda' F + mu' r)'' d` by `(z, w)` for a direction `d`, which is the source `VARIATION`, given the
    /// [responses](Self::responses) as the source `DYNAMICS`.
    pub fn curvature_along(&self) -> Program {
        record(|| {
            let (variables, gradient) = self.slopes_beside();
            let direction = entries(source::VARIATION, variables.len());
            let seeds: Vec<_> = weigh(&variables, &direction).collect();
            Program::compile(&vector(&tangent(&gradient, &seeds)))
        })
    }

    /// `(z, w)`, and the gradient of `lambda' F + mu' r` by them, given the [responses](Self::responses) as the source
    /// `DYNAMICS`.
    pub(super) fn slopes_beside(&self) -> (Vec<Node>, Vec<Node>) {
        let trace = self.trace(false);
        let (joint, k) = (trace.z.len(), self.model.unknowns());
        let row = |j: usize| (0..k).map(move |l| Node::entry(source::DYNAMICS, j * padded(k) + l));
        let (mu, w): (Vec<_>, Vec<_>) = (row(joint).collect(), row(joint + 1).collect());
        let (next, residual) = trace.at(&w);
        let lambda = entries(source::COSTATE, next.len());
        let lagrangian: Vec<_> = weigh(&next, &lambda).chain(weigh(&residual, &mu)).collect();
        let variables: Vec<Node> = trace.z.iter().chain(&w).copied().collect();
        let gradient = vjp(&lagrangian, &variables);
        (variables, gradient)
    }
}
