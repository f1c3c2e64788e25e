//! Second derivatives of costs and dynamics.

use supple_kernels::graph::{Node, Program, Target, jacobian, record, vjp};
use supple_kernels::{Scalar, padded};

use super::{Outputs, Recorder, add, set, weigh};
use crate::Model;
use crate::cost::{Cost, Weights};
use crate::system::Curvature;
use crate::system::trace::{Linearised, Trace, column, dot, entries, source};

impl<M: Model> Recorder<'_, M> {
    /// `[l_zz | l_z]` (theory, equation P.1a), by the next state too where it is [given](Self::gives_next): with
    /// Gauss-Newton curvature `R' nu_rr R`, `R = dr/dz`.
    pub fn cost_quadratic(&self, curvature: Curvature, last: bool) -> Program {
        record(|| {
            let trace = self.trace_cost(last);
            let variables = trace.with_next();
            let joint = variables.len();
            let gradient = vjp(&[(trace.cost(self.costs, last), Node::one())], &variables);
            let exact = jacobian(&gradient, &variables);
            let hessian = match curvature {
                Curvature::Exact => exact.clone(),
                Curvature::GaussNewton => self.gauss_newton(&trace, last),
            };
            let stride = padded(joint + 1);
            let mut outputs = Outputs::new();
            for a in 0..joint {
                set(&mut outputs, gradient[a], a * stride + joint);
                // Both curvatures share a matrix and must write the same entries; all entries if making it
                // convex may fill any of them.
                let always = !self.is_convex(last);
                for b in (a..joint).filter(|&b| always || !(hessian[a][b].is_zero() && exact[a][b].is_zero())) {
                    outputs.push((hessian[a][b], Target::Set { sink: 0, offset: a * stride + b }));
                    if a != b {
                        outputs.push((hessian[a][b], Target::Set { sink: 0, offset: b * stride + a }));
                    }
                }
            }
            Program::compile(&outputs)
        })
    }

    /// The second derivatives of the cost with respect to `z`; only the upper triangle is used.
    pub(super) fn cost_curvature(&self, trace: &Trace<M>, curvature: Curvature, last: bool) -> Vec<Vec<Node>> {
        match curvature {
            Curvature::GaussNewton => self.gauss_newton(trace, last),
            Curvature::Exact => {
                let variables = trace.with_next();
                let gradient = vjp(&[(trace.cost(self.costs, last), Node::one())], &variables);
                jacobian(&gradient, &variables)
            }
        }
    }

    fn gauss_newton(&self, trace: &Trace<M>, last: bool) -> Vec<Vec<Node>> {
        let variables = trace.with_next();
        let joint = variables.len();
        let mut hessian = vec![vec![Node::zero(); joint]; joint];
        for (cost, r) in self.costs.iter().zip(trace.residuals(self.costs)) {
            let rows = jacobian(&r, &variables);
            // Most residuals depend on few variables.
            let on = |row: &Vec<Node>| (0..joint).filter(|&a| !row[a].is_zero()).collect::<Vec<_>>();
            let on: Vec<Vec<usize>> = rows.iter().map(on).collect();
            let mut add = |i: usize, j: usize, weight: Node| {
                for &a in &on[i] {
                    for &b in on[j].iter().filter(|&&b| b >= a) {
                        hessian[a][b] += weight * rows[i][a] * rows[j][b];
                    }
                }
            };
            match cost.weights(last) {
                Weights::Equal(weight) => {
                    let weight: Node = weight.resolve(&trace.phi);
                    for (i, &r) in r.iter().enumerate() {
                        add(i, i, weight * cost.norm.curvature(r, &trace.phi));
                    }
                }
                Weights::Each(weights) => {
                    for (i, (weight, &r)) in
                        weights.iter().zip(&r).enumerate().filter(|(_, (weight, _))| !weight.is_zero())
                    {
                        add(i, i, weight.resolve::<Node>(&trace.phi) * cost.norm.curvature(r, &trace.phi));
                    }
                }
                Weights::Matrix(weights) => {
                    for (i, row) in weights.iter().enumerate() {
                        for (j, weight) in row.iter().enumerate() {
                            add(i, j, weight.resolve::<Node>(&trace.phi) * 2.0);
                        }
                    }
                }
            }
        }
        self.add_own(trace, last, &mut hessian);
        hessian
    }

    /// Whether the Gauss-Newton curvature is known to be positive semidefinite.
    pub fn is_convex(&self, last: bool) -> bool {
        let curved = |weights: &Weights| !matches!(weights, Weights::Matrix(_)) && !weights.are_zero();
        let convex = |cost: &Cost| cost.norm.is_convex() || !curved(cost.weights(last));
        self.model.own_cost(last).is_none_or(|cost| cost.convex) && self.costs.iter().all(convex)
    }

    /// Adds the curvature of the model's own norm, of which the residual is the variable.
    fn add_own(&self, trace: &Trace<M>, last: bool, hessian: &mut [Vec<Node>]) {
        let residual = trace.own_residual(last);
        let rows = jacobian(&residual, &trace.with_next());
        let free: Vec<Node> = residual.into_iter().map(Node::opaque).collect();
        let gradient = vjp(&[(trace.own_norm(&free, last), Node::one())], &free);
        for (i, curvatures) in jacobian(&gradient, &free).into_iter().enumerate() {
            for (j, curvature) in curvatures.into_iter().enumerate().filter(|(_, curvature)| !curvature.is_zero()) {
                for (a, row) in hessian.iter_mut().enumerate().filter(|&(a, _)| !rows[i][a].is_zero()) {
                    for (b, entry) in row.iter_mut().enumerate().skip(a) {
                        *entry += curvature * rows[i][a] * rows[j][b];
                    }
                }
            }
        }
    }

    /// `(lambda' f)_zz`, added (theory, equation U.5): with `mu = -M^-1 F_w' lambda` and `D = [I; W]`,
    /// `D' (lambda' F + mu' r)'' D` by `(z, w)`.
    pub fn dynamics_curvature(&self) -> Program {
        record(|| {
            let trace = self.trace(false);
            let dynamics = trace.dynamics_to_linearise();
            let Linearised { f_w, directions, .. } = dynamics.linearise(&trace.z);
            let lambda = entries(source::COSTATE, dynamics.next.len());
            let mu: Vec<Node> = dynamics.multipliers(&f_w, &lambda).into_iter().map(Node::opaque).collect();
            let joint = trace.z.len();
            // The multipliers are held fixed: they are independent variables.
            let variables: Vec<Node> = dynamics.variables(&trace.z).into_iter().chain(mu.iter().copied()).collect();
            let lagrangian: Vec<_> = weigh(&dynamics.next, &lambda).chain(weigh(&dynamics.residual, &mu)).collect();
            let gradient = vjp(&lagrangian, &variables);
            let moving = joint + dynamics.w.len();
            let hessian = jacobian(&gradient[..moving], &variables);
            let by_unknown = |a: usize| hessian[a][joint..moving].iter().copied();
            let stride = padded(joint + 1);
            let mut outputs = Outputs::new();
            for a in 0..joint {
                // W_a' H_ww
                let through: Vec<Node> =
                    (joint..moving).map(|l| dot(directions[a].iter().copied(), column(&hessian[joint..], l))).collect();
                for b in a..joint {
                    let sum = hessian[a][b]
                        + dot(by_unknown(a), directions[b].iter().copied())
                        + dot(by_unknown(b), directions[a].iter().copied())
                        + dot(through.iter().copied(), directions[b].iter().copied());
                    add(&mut outputs, sum, a * stride + b);
                    if a != b {
                        add(&mut outputs, sum, b * stride + a);
                    }
                }
            }
            Program::compile(&outputs)
        })
    }
}
