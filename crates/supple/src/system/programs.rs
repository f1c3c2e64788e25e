//! The programs of a system: its functions and their derivatives, recorded and compiled.

use supple_kernels::graph::{Node, Program, Target, depends, record, tangent, vjp};
use supple_kernels::{Scalar, padded};

use super::Curvature;
use super::trace::{Dynamics, Linearised, Trace, column, dot, entries, jacobian, source};
use crate::cost::{Cost, Norm, Weights};
use crate::{Model, Value};

/// A model with its costs, to be recorded.
#[derive(Clone, Copy)]
pub(super) struct Recorder<'a, M> {
    pub model: &'a M,
    pub costs: &'a [Cost],
    pub time_step: Value,
    pub parameters: usize,
}

/// Entries that become results, but for those that are always 0 where they are only to be added.
type Outputs = Vec<(Node, Target)>;

impl<M: Model> Recorder<'_, M> {
    fn trace(&self, last: bool) -> Trace<'_, M> {
        Trace::new(self.model, self.time_step, self.parameters, last)
    }

    /// Which parameters any function depends on.
    pub fn dependencies(&self) -> Vec<bool> {
        record(|| {
            let trace = self.trace(false);
            let Dynamics { next, residual, .. } = trace.dynamics();
            let mut all = [next, residual, trace.measurement()].concat();
            all.extend([trace.cost(self.costs, false), self.trace(true).cost(self.costs, true)]);
            trace.phi.iter().map(|&parameter| depends(&all, parameter)).collect()
        })
    }

    /// `f`
    pub fn step(&self) -> Program {
        record(|| Program::compile(&vector(&self.trace(false).dynamics().next)))
    }

    /// `f`, and `l` as the second sink.
    pub fn advance(&self) -> Program {
        record(|| {
            let trace = self.trace(false);
            let mut outputs = vector(&trace.dynamics().next);
            outputs.push((trace.cost(self.costs, false), Target::Set { sink: 1, offset: 0 }));
            Program::compile(&outputs)
        })
    }

    /// `g`
    pub fn observe(&self) -> Program {
        record(|| Program::compile(&vector(&self.trace(false).measurement())))
    }

    /// `l` or `l_N`
    pub fn cost(&self, last: bool) -> Program {
        record(|| Program::compile(&vector(&[self.trace(last).cost(self.costs, last)])))
    }

    /// `[A B]` (theory, equation U.3)
    pub fn dynamics_jacobian(&self) -> Program {
        record(|| {
            let trace = self.trace(false);
            let Linearised { f_z, f_w, directions, .. } = trace.dynamics().linearise(&trace.z);
            let mut outputs = Outputs::new();
            let stride = padded(trace.z.len());
            for (i, (row, by_unknown)) in f_z.iter().zip(&f_w).enumerate() {
                for (j, &entry) in row.iter().enumerate() {
                    let total = entry + dot(by_unknown.iter().copied(), directions[j].iter().copied());
                    set(&mut outputs, total, i * stride + j);
                }
            }
            Program::compile(&outputs)
        })
    }

    /// `C`
    pub fn measurement_jacobian(&self) -> Program {
        record(|| {
            let trace = self.trace(true);
            let x = &trace.z[..self.model.dimensions().states];
            let mut outputs = Outputs::new();
            for (i, row) in jacobian(&trace.measurement(), x).into_iter().enumerate() {
                for (j, entry) in row.into_iter().enumerate() {
                    set(&mut outputs, entry, i * padded(x.len()) + j);
                }
            }
            Program::compile(&outputs)
        })
    }

    /// `[l_zz | l_z]` (theory, equation P.1a): with Gauss-Newton curvature `R' nu_rr R`, `R = dr/dz`.
    pub fn cost_quadratic(&self, curvature: Curvature, last: bool) -> Program {
        record(|| {
            let trace = self.trace(last);
            let joint = trace.z.len();
            let gradient = vjp(&[(trace.cost(self.costs, last), Node::one())], &trace.z);
            let exact = jacobian(&gradient, &trace.z);
            let hessian = match curvature {
                Curvature::Exact => exact.clone(),
                Curvature::GaussNewton => self.gauss_newton(&trace, last),
            };
            let stride = padded(joint + 1);
            let mut outputs = Outputs::new();
            for a in 0..joint {
                set(&mut outputs, gradient[a], a * stride + joint);
                // Both curvatures write the same entries: they take turns with one matrix.
                for b in (a..joint).filter(|&b| !(hessian[a][b].is_zero() && exact[a][b].is_zero())) {
                    outputs.push((hessian[a][b], Target::Set { sink: 0, offset: a * stride + b }));
                    if a != b {
                        outputs.push((hessian[a][b], Target::Set { sink: 0, offset: b * stride + a }));
                    }
                }
            }
            Program::compile(&outputs)
        })
    }

    fn gauss_newton(&self, trace: &Trace<M>, last: bool) -> Vec<Vec<Node>> {
        let joint = trace.z.len();
        let mut hessian = vec![vec![Node::zero(); joint]; joint];
        for (cost, r) in self.costs.iter().zip(trace.residuals(self.costs)) {
            let rows = jacobian(&r, &trace.z);
            let mut add = |i: usize, j: usize, weight: Node| {
                for a in 0..joint {
                    for b in a..joint {
                        hessian[a][b] += weight * rows[i][a] * rows[j][b];
                    }
                }
            };
            match (cost.weights(last), cost.norm) {
                (Weights::Equal(weight), norm) => {
                    let weight: Node = weight.resolve(&trace.phi);
                    for (i, &r) in r.iter().enumerate() {
                        let curvature = match norm {
                            Norm::Quadratic => Node::constant(2.0),
                            Norm::Absolute { smoothing } => {
                                let s: Node = smoothing.resolve(&trace.phi);
                                let inverse = r.mul_add(r, s * s).sqrt().recip();
                                s * s * inverse * inverse * inverse
                            }
                        };
                        add(i, i, weight * curvature);
                    }
                }
                (Weights::Matrix(weights), _) => {
                    for (i, row) in weights.iter().enumerate() {
                        for (j, weight) in row.iter().enumerate() {
                            add(i, j, weight.resolve::<Node>(&trace.phi) * 2.0);
                        }
                    }
                }
            }
        }
        hessian
    }

    /// `(lambda' f)_zz`, added (theory, equation U.5): with `mu = -M^-1 F_w' lambda` and `D = [I; W]`,
    /// `D' (lambda' F + mu' r)'' D` by `(z, w)`.
    pub fn dynamics_curvature(&self) -> Program {
        record(|| {
            let trace = self.trace(false);
            let dynamics = trace.dynamics();
            let Linearised { f_w, directions, .. } = dynamics.linearise(&trace.z);
            let lambda = entries(source::COSTATE, dynamics.next.len());
            let mu: Vec<Node> = dynamics.multipliers(&f_w, &lambda).into_iter().map(Node::opaque).collect();
            let joint = trace.z.len();
            // The multipliers stand still: they are variables that nothing moves.
            let variables: Vec<Node> = dynamics.variables(&trace.z).into_iter().chain(mu.iter().copied()).collect();
            let lagrangian: Vec<_> = weigh(&dynamics.next, &lambda).chain(weigh(&dynamics.residual, &mu)).collect();
            let gradient = vjp(&lagrangian, &variables);
            let moving = joint + dynamics.w.len();
            let hessian: Vec<Vec<Node>> =
                gradient[..moving].iter().map(|&entry| vjp(&[(entry, Node::one())], &variables)).collect();
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

    /// The gradient of `<F_bar, [A B]>` (theory, equations U.6 and U.7).
    ///
    /// With `mu_j = -M^-1 F_w' F_bar_j` it is that of `sum_j (F_bar_j, mu_j)' (F, r)' (e_j, W_j)`, all but the
    /// derivatives `(F, r)'` held fixed, and with `w` moving as it must.
    pub fn contract_dynamics(&self) -> Program {
        record(|| {
            let trace = self.trace(false);
            let dynamics = trace.dynamics();
            let Linearised { f_z, f_w, r_z, directions } = dynamics.linearise(&trace.z);
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
            for i in 0..n {
                for j in 0..joint {
                    consider(f_z[i][j], &|| adjoint(i, j));
                }
                for l in 0..k {
                    consider(f_w[i][l], &|| dot((0..joint).map(|j| adjoint(i, j)), column(&directions, l)));
                }
            }
            for i in 0..k {
                for j in 0..joint {
                    consider(r_z[i][j], &|| mu[j][i]);
                }
                for l in 0..k {
                    consider(dynamics.mass[i][l], &|| dot(column(&mu, i), column(&directions, l)));
                }
            }
            let variables = [dynamics.variables(&trace.z), trace.phi.clone()].concat();
            let gradient = vjp(&weighed, &variables);
            let nu = dynamics.respond(gradient[joint..joint + k].to_vec());
            let mut outputs = Outputs::new();
            for j in 0..joint {
                let total = gradient[j] + dot(nu.iter().copied(), column(&r_z, j));
                add(&mut outputs, total, j * padded(joint + 1) + joint);
            }
            let through = self.by_parameters(&trace, &dynamics, &nu);
            for (i, (&direct, through)) in gradient[joint + k..].iter().zip(through).enumerate() {
                sum(&mut outputs, direct + through, i);
            }
            Program::compile(&outputs)
        })
    }

    /// `nu' r_phi`
    fn by_parameters(&self, trace: &Trace<M>, dynamics: &Dynamics, nu: &[Node]) -> Vec<Node> {
        let held = dynamics.variables(&trace.z);
        let weighed: Vec<_> = weigh(&dynamics.residual, nu).collect();
        vjp(&weighed, &[held.clone(), trace.phi.clone()].concat()).split_off(held.len())
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

    /// The gradient of `<H_bar, l_zz>`.
    pub fn contract_cost(&self, last: bool) -> Program {
        record(|| {
            let trace = self.trace(last);
            let joint = trace.z.len();
            let gradient = vjp(&[(trace.cost(self.costs, last), Node::one())], &trace.z);
            let hessian = jacobian(&gradient, &trace.z);
            let mut weighed = Vec::new();
            for a in 0..joint {
                for b in (a..joint).filter(|&b| hessian[a][b].known().is_none()) {
                    let adjoint = Node::entry(source::COST, a * padded(joint + 1) + b);
                    weighed.push((hessian[a][b], if a == b { adjoint } else { adjoint * 2.0 }));
                }
            }
            Program::compile(&contraction(&trace, &weighed))
        })
    }

    /// The gradient by the parameters of the Lagrangian `l + lambda' f` (theory, equation U.4).
    pub fn parameter_gradient(&self, last: bool) -> Program {
        record(|| {
            let trace = self.trace(last);
            let mut weighed = vec![(trace.cost(self.costs, last), Node::one())];
            let mut held = trace.z.clone();
            if !last {
                let dynamics = trace.dynamics();
                let Linearised { f_w, .. } = dynamics.linearise(&trace.z);
                let lambda = entries(source::COSTATE, dynamics.next.len());
                weighed.extend(weigh(&dynamics.next, &lambda));
                weighed.extend(weigh(&dynamics.residual, &dynamics.multipliers(&f_w, &lambda)));
                held = dynamics.variables(&trace.z);
            }
            let gradient = vjp(&weighed, &[held.clone(), trace.phi.clone()].concat());
            let mut outputs = Outputs::new();
            for (i, &entry) in gradient[held.len()..].iter().enumerate() {
                sum(&mut outputs, entry, i);
            }
            Program::compile(&outputs)
        })
    }

    /// The derivative of that gradient along a variation `(dz, dlambda)` (theory, equation U.8):
    /// `dz' (l + lambda' f)_{z phi} + dlambda' f_phi`.
    pub fn parameter_gradient_along(&self, last: bool) -> Program {
        record(|| {
            let trace = self.trace(last);
            let dz = entries(source::VARIATION, trace.z.len());
            let seeds: Vec<_> = weigh(&trace.z, &dz).collect();
            let cost = trace.cost(self.costs, last);
            let total = if last {
                vjp(&[(tangent(&[cost], &seeds)[0], Node::one())], &trace.phi)
            } else {
                self.stage_gradient_along(&trace, cost, seeds, &dz)
            };
            let mut outputs = Outputs::new();
            for (i, entry) in total.into_iter().enumerate() {
                sum(&mut outputs, entry, i);
            }
            Program::compile(&outputs)
        })
    }

    fn stage_gradient_along(
        &self,
        trace: &Trace<M>,
        cost: Node,
        mut seeds: Vec<(Node, Node)>,
        dz: &[Node],
    ) -> Vec<Node> {
        let dynamics = trace.dynamics();
        let Linearised { f_w, directions, .. } = dynamics.linearise(&trace.z);
        let n = dynamics.next.len();
        let (lambda, dlambda) = (entries(source::COSTATE, n), entries(source::COSTATE_VARIATION, n));
        let mu = dynamics.multipliers(&f_w, &lambda);
        // The variation stands still: it is a variable that nothing moves.
        let dw: Vec<Node> =
            (0..dynamics.w.len()).map(|l| dot(column(&directions, l), dz.iter().copied()).opaque()).collect();
        seeds.extend(weigh(&dynamics.w, &dw));
        let rates = tangent(&[vec![cost], dynamics.next.clone(), dynamics.residual.clone()].concat(), &seeds);
        let weights = [vec![Node::one()], lambda, mu].concat();
        let mut weighed: Vec<_> = weigh(&rates, &weights).collect();
        weighed.extend(weigh(&dynamics.next, &dlambda));
        let moving = dynamics.variables(&trace.z);
        let held = [moving.clone(), dw].concat();
        let gradient = vjp(&weighed, &[held.clone(), trace.phi.clone()].concat());
        // What moves w moves the rates, and dlambda' F, through it.
        let nu = dynamics.respond(gradient[trace.z.len()..moving.len()].to_vec());
        let through = self.by_parameters(trace, &dynamics, &nu);
        gradient[held.len()..].iter().zip(through).map(|(&direct, through)| direct + through).collect()
    }
}

/// Pairs of outputs and their weights.
fn weigh<'a>(outputs: &'a [Node], weights: &'a [Node]) -> impl Iterator<Item = (Node, Node)> + 'a {
    outputs.iter().copied().zip(weights.iter().copied())
}

/// The gradient of a weighted sum by `z`, added to the last column of the joint matrix, and by the parameters.
fn contraction<M: Model>(trace: &Trace<M>, weighed: &[(Node, Node)]) -> Outputs {
    let joint = trace.z.len();
    let gradient = vjp(weighed, &[trace.z.clone(), trace.phi.clone()].concat());
    let mut outputs = Outputs::new();
    for j in 0..joint {
        add(&mut outputs, gradient[j], j * padded(joint + 1) + joint);
    }
    for (i, &entry) in gradient[joint..].iter().enumerate() {
        sum(&mut outputs, entry, i);
    }
    outputs
}

fn vector(nodes: &[Node]) -> Outputs {
    nodes.iter().enumerate().map(|(i, &node)| (node, Target::Set { sink: 0, offset: i })).collect()
}

/// An entry that is always 0 stays so: outputs begin as zeros.
fn set(outputs: &mut Outputs, node: Node, offset: usize) {
    if !node.is_zero() {
        outputs.push((node, Target::Set { sink: 0, offset }));
    }
}

fn add(outputs: &mut Outputs, node: Node, offset: usize) {
    if !node.is_zero() {
        outputs.push((node, Target::Add { sink: 0, offset }));
    }
}

fn sum(outputs: &mut Outputs, node: Node, index: usize) {
    if !node.is_zero() {
        outputs.push((node, Target::Sum { index }));
    }
}
