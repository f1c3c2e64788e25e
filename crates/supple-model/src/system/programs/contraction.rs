//! Gradients of numbers that depend on the knots, given their adjoints.

use supple_kernels::graph::{Node, Program, jacobian, record, vjp};
use supple_kernels::padded;

use super::{Outputs, Recorder, add, sum, weigh};
use crate::Model;
use crate::system::Curvature;
use crate::system::trace::{Linearised, Trace, column, dot, entries, source};

impl<M: Model> Recorder<'_, M> {
    /// The gradient of `<F_bar, [A B]>` (theory, equations U.6 and U.7).
    ///
    /// With `mu_j = -M^-1 F_w' F_bar_j` it is that of `sum_j (F_bar_j, mu_j)' (F, r)' (e_j, W_j)`, with everything except
    /// the derivatives `(F, r)'` held fixed, and `w` following its equation. The gradient with respect to `z` is a vector
    /// if steps are `composed`; otherwise it is added to the last column of the joint matrix.
    pub fn contract_dynamics(&self, composed: bool) -> Program {
        record(|| {
            let trace = self.trace(false);
            let dynamics = trace.dynamics_to_linearise();
            let Linearised { f_z, f_w, r_z, directions } = dynamics.linearise(&trace.z);
            let mass = trace.mass(&dynamics.w);
            let (n, joint, k) = (dynamics.next.len(), trace.z.len(), dynamics.w.len());
            let adjoint = |i: usize, j: usize| Node::entry(source::DYNAMICS, i * padded(joint) + j);
            let mu: Vec<Vec<Node>> = (0..joint)
                .map(|j| dynamics.multipliers(&f_w, &(0..n).map(|i| adjoint(i, j)).collect::<Vec<_>>()))
                .collect();
            let mut weighed = Vec::new();
            let mut consider = |entry: Node, weight: &dyn Fn() -> Node| {
                if entry.known().is_none() {
                    weighed.push((entry, weight()));
                }
            };
            for (i, (by_z, by_w)) in f_z.iter().zip(&f_w).enumerate() {
                for (j, &entry) in by_z.iter().enumerate() {
                    consider(entry, &|| adjoint(i, j));
                }
                for (l, &entry) in by_w.iter().enumerate() {
                    consider(entry, &|| dot((0..joint).map(|j| adjoint(i, j)), column(&directions, l)));
                }
            }
            for i in 0..k {
                for j in 0..joint {
                    consider(r_z[i][j], &|| mu[j][i]);
                }
                for (l, &entry) in mass[i].iter().enumerate() {
                    consider(entry, &|| dot(column(&mu, i), column(&directions, l)));
                }
            }
            let variables = [dynamics.variables(&trace.z), trace.phi.clone()].concat();
            let gradient = vjp(&weighed, &variables);
            let nu = dynamics.respond(gradient[joint..joint + k].to_vec());
            let mut outputs = Outputs::new();
            for (j, &direct) in gradient[..joint].iter().enumerate() {
                let total = direct + dot(nu.iter().copied(), column(&r_z, j));
                add(&mut outputs, total, if composed { j } else { j * padded(joint + 1) + joint });
            }
            let through = self.by_parameters(&trace, &dynamics, &nu);
            for (i, (&direct, through)) in gradient[joint + k..].iter().zip(through).enumerate() {
                sum(&mut outputs, direct + through, i);
            }
            Program::compile(&outputs)
        })
    }

    /// The gradient of `<H_bar, (lambda' f)_zz>` of a step of integration, as a vector by `(z, lambda)`, and by the
    /// parameters.
    pub fn contract_curvature(&self) -> Program {
        record(|| {
            let trace = self.trace(false);
            let next = trace.solved_step();
            let (n, joint) = (next.len(), trace.z.len());
            let lambda = entries(source::COSTATE, n);
            let hessian = jacobian(&vjp(&weigh(&next, &lambda).collect::<Vec<_>>(), &trace.z), &trace.z);
            let weighed = weighed_triangle(&hessian, padded(joint));
            let variables = [&trace.z[..], &lambda, &trace.phi].concat();
            let mut outputs = Outputs::new();
            for (i, entry) in vjp(&weighed, &variables).into_iter().enumerate() {
                if i < joint + n { add(&mut outputs, entry, i) } else { sum(&mut outputs, entry, i - joint - n) }
            }
            Program::compile(&outputs)
        })
    }

    /// The gradient of `<C_bar, C>`.
    pub fn contract_measurement(&self) -> Program {
        record(|| {
            let trace = self.trace(true);
            let n = self.model.dimensions().states;
            let c = jacobian(&trace.measurement(), &trace.z[..n]);
            let weighed: Vec<_> = c
                .iter()
                .enumerate()
                .flat_map(|(i, row)| row.iter().enumerate().map(move |(j, &entry)| (i * padded(n) + j, entry)))
                .filter(|(_, entry)| entry.known().is_none())
                .map(|(place, entry)| (entry, Node::entry(source::MEASUREMENT, place)))
                .collect();
            Program::compile(&contraction(&trace, &weighed))
        })
    }

    /// The gradient of `<H_bar, l_zz>`, of all second derivatives of the cost or of Gauss-Newton's.
    pub fn contract_cost(&self, curvature: Curvature, last: bool) -> Program {
        record(|| {
            let trace = self.trace_cost(last);
            let joint = trace.with_next().len();
            let hessian = self.cost_curvature(&trace, curvature, last);
            let weighed = weighed_triangle(&hessian, padded(joint + 1));
            Program::compile(&contraction(&trace, &weighed))
        })
    }
}

/// The upper triangle of symmetric second derivatives with their adjoints, the source `COST` with rows `stride` apart.
fn weighed_triangle(hessian: &[Vec<Node>], stride: usize) -> Vec<(Node, Node)> {
    let mut weighed = Vec::new();
    for (a, row) in hessian.iter().enumerate() {
        for (b, &entry) in row.iter().enumerate().skip(a).filter(|(_, entry)| entry.known().is_none()) {
            let adjoint = Node::entry(source::COST, a * stride + b);
            weighed.push((entry, if a == b { adjoint } else { adjoint * 2.0 }));
        }
    }
    weighed
}

/// The gradient of a weighted sum with respect to `z`, added to the last column of the joint matrix, and to the
/// parameters. If the next state is an input, the joint matrix has rows and columns for it too.
fn contraction<M: Model>(trace: &Trace<M>, weighed: &[(Node, Node)]) -> Outputs {
    let variables = trace.with_next();
    let joint = variables.len();
    let gradient = vjp(weighed, &[variables, trace.phi.clone()].concat());
    let mut outputs = Outputs::new();
    for (j, &entry) in gradient[..joint].iter().enumerate() {
        add(&mut outputs, entry, j * padded(joint + 1) + joint);
    }
    for (i, &entry) in gradient[joint..].iter().enumerate() {
        sum(&mut outputs, entry, i);
    }
    outputs
}
