//! Second derivatives of dynamics with many unknowns, a few directions at a time: programs that grow with the number of
//! unknowns as the dynamics do, where that of all second derivatives grows with its third power.

use supple_kernels::graph::{Node, Program, Target, record, tangent, vjp};
use supple_kernels::padded;

use super::{Recorder, weigh};
use crate::Model;
use crate::system::trace::{Linearised, entries, source};

/// Directions that one run of [`Recorder::curvature_along`] takes together where all are asked for.
pub(in crate::system) const TOGETHER: usize = 8;

impl<M: Model> Recorder<'_, M> {
    /// How the unknowns respond (theory, equations U.2 and U.4), as rows of length k: `W_j` for every variable of `z`, then
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

    /// Whether next states are an affine function of the controls: whether neither dynamics nor residual curve along controls
    /// and unknowns, as in rigid bodies with motors.
    pub fn is_affine_in_controls(&self) -> bool {
        record(|| {
            let trace = self.trace(false);
            let w: Vec<Node> = (0..self.model.unknowns()).map(|l| Node::entry(source::DYNAMICS, l)).collect();
            let (next, residual) = trace.at(&w);
            let entries_of = |source, from: &[Node]| entries(source, from.len());
            let (lambda, mu) = (entries_of(source::COSTATE, &next), entries_of(source::VARIATION, &residual));
            let lagrangian: Vec<_> = weigh(&next, &lambda).chain(weigh(&residual, &mu)).collect();
            let moving: Vec<Node> = trace.z[self.model.dimensions().states..].iter().chain(&w).copied().collect();
            let seeds: Vec<_> = moving.iter().map(|&node| (node, node.opaque())).collect();
            tangent(&vjp(&lagrangian, &moving), &seeds).iter().all(|rate| rate.is_zero())
        })
    }

    /// `(lambda' F + mu' r)'' d` by `(z, w)` for some directions `d`, which are rows of the source `VARIATION`, given the
    /// [responses](Self::responses) as the source `DYNAMICS`.
    pub fn curvature_along(&self, directions: usize) -> Program {
        record(|| {
            let trace = self.trace(false);
            let (joint, k) = (trace.z.len(), self.model.unknowns());
            let row = |j: usize| (0..k).map(move |l| Node::entry(source::DYNAMICS, j * padded(k) + l));
            let (mu, w): (Vec<_>, Vec<_>) = (row(joint).collect(), row(joint + 1).collect());
            let (next, residual) = trace.at(&w);
            let lambda = entries(source::COSTATE, next.len());
            let lagrangian: Vec<_> = weigh(&next, &lambda).chain(weigh(&residual, &mu)).collect();
            let variables: Vec<Node> = trace.z.iter().chain(&w).copied().collect();
            let gradient = vjp(&lagrangian, &variables);
            let stride = padded(joint + k);
            let mut outputs = Vec::new();
            for direction in 0..directions {
                let entry = |i: usize| Node::entry(source::VARIATION, direction * stride + i);
                let seeds: Vec<_> = variables.iter().enumerate().map(|(i, &node)| (node, entry(i))).collect();
                for (i, &rate) in tangent(&gradient, &seeds).iter().enumerate() {
                    outputs.push((rate, Target::Set { sink: 0, offset: direction * stride + i }));
                }
            }
            Program::compile(&outputs)
        })
    }
}
