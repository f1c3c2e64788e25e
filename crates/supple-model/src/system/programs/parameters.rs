//! Gradients by the parameters of the Lagrangian of a plan.

use supple_kernels::Scalar;
use supple_kernels::graph::{Node, Program, record, tangent, vjp};

use super::{Outputs, Recorder, sum, weigh};
use crate::Model;
use crate::cost::Cost;
use crate::system::trace::{Linearised, Trace, column, dot, entries, source};

/// What a gradient with respect to the parameters refers to: the Lagrangian `l + lambda' f`, or one part of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::system) enum GradientOf {
    /// Both at a stage.
    Stage,
    /// The final cost.
    End,
    /// The cost of a stage.
    StageCost,
    /// `lambda' f`, of a step of integration.
    Step,
}

impl GradientOf {
    fn has_step(self) -> bool {
        matches!(self, Self::Stage | Self::Step)
    }

    /// The cost, if included.
    fn cost<M: Model>(self, trace: &Trace<M>, costs: &[Cost]) -> Node {
        if self == Self::Step { Node::zero() } else { trace.cost(costs, self == Self::End) }
    }
}

impl<M: Model> Recorder<'_, M> {
    /// The gradient by the parameters of the Lagrangian `l + lambda' f` (theory, equation U.4), or of a part of it.
    pub fn parameter_gradient(&self, of: GradientOf) -> Program {
        record(|| {
            let trace = self.trace_of(of);
            let mut weighed = vec![(of.cost(&trace, self.costs), Node::one())];
            let mut held = trace.with_next();
            if of.has_step() {
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
    pub fn parameter_gradient_along(&self, of: GradientOf) -> Program {
        record(|| {
            let trace = self.trace_of(of);
            let moving = trace.with_next();
            let dz = entries(source::VARIATION, moving.len());
            let seeds: Vec<_> = weigh(&moving, &dz).collect();
            let cost = of.cost(&trace, self.costs);
            let total = if of.has_step() {
                self.stage_gradient_along(&trace, cost, seeds, &dz)
            } else {
                vjp(&[(tangent(&[cost], &seeds)[0], Node::one())], &trace.phi)
            };
            let mut outputs = Outputs::new();
            for (i, entry) in total.into_iter().enumerate() {
                sum(&mut outputs, entry, i);
            }
            Program::compile(&outputs)
        })
    }

    fn trace_of(&self, of: GradientOf) -> Trace<'_, M> {
        if of.has_step() { self.trace(false) } else { self.trace_cost(of == GradientOf::End) }
    }

    fn stage_gradient_along(
        &self,
        trace: &Trace<M>,
        cost: Node,
        mut seeds: Vec<(Node, Node)>,
        dz: &[Node],
    ) -> Vec<Node> {
        let dynamics = trace.dynamics_to_linearise();
        let Linearised { f_w, directions, .. } = dynamics.linearise(&trace.z);
        let n = dynamics.next.len();
        let (lambda, dlambda) = (entries(source::COSTATE, n), entries(source::COSTATE_VARIATION, n));
        let mu = dynamics.multipliers(&f_w, &lambda);
        // The variation is held fixed: it is an independent variable.
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
        // A change of w also changes the rates and, through them, dlambda' F.
        let nu = dynamics.respond(gradient[trace.z.len()..moving.len()].to_vec());
        let through = self.by_parameters(trace, &dynamics, &nu);
        gradient[held.len()..].iter().zip(through).map(|(&direct, through)| direct + through).collect()
    }
}
