//! The programs of a system: its functions and their derivatives, recorded and compiled. One file by kind of derivative.

use supple_kernels::graph::{Node, Target, depends, record, vjp};

use super::trace::{Dynamics, Trace};
use crate::cost::Cost;
use crate::followed::Ends;
use crate::{Model, ParameterHandle, Value};

mod along;
mod constraints;
mod contraction;
mod curvature;
mod jacobians;
mod parameters;
mod second;
mod values;

pub(super) use constraints::excess_source;
pub(super) use parameters::GradientOf;
pub(super) use second::SecondDerivatives;

/// A model with its costs, to be recorded.
pub(super) struct Recorder<'a, M> {
    pub model: &'a M,
    pub costs: &'a [Cost],
    pub time_step: Value,
    pub parameters: usize,
}

/// Results of a program; entries that are always 0 are omitted if results are added to the output.
type Outputs = Vec<(Node, Target)>;

impl<M: Model> Recorder<'_, M> {
    /// The same recorder, with the time step as an additional last parameter.
    pub fn of_any_time_step(&self) -> Self {
        let time_step = ParameterHandle::at(self.parameters).into();
        Self { time_step, parameters: self.parameters + 1, ..*self }
    }

    /// Whether stage costs take the next state as an input, because some depend on it. Their derivatives are then propagated
    /// through those of the step, rather than through the solution of its unknowns.
    pub fn gives_next(&self) -> bool {
        self.needs_next(false)
    }

    fn needs_next(&self, last: bool) -> bool {
        self.costs.iter().any(|cost| cost.quantity.needs_next() && !cost.weights(last).are_zero())
    }

    /// The variables of costs.
    fn trace_cost(&self, last: bool) -> Trace<'_, M> {
        let trace = self.trace(last);
        match last {
            _ if !self.gives_next() => trace,
            false => trace.given_next(|given| vec![given.cost(self.costs, false)]),
            true if self.needs_next(true) => trace,
            true => trace.given_next(|_| Vec::new()),
        }
    }

    /// Which entries of the next state the stage costs depend on.
    pub fn counting_of_next(&self) -> Vec<usize> {
        record(|| self.trace_cost(false).counting().to_vec())
    }

    fn trace(&self, last: bool) -> Trace<'_, M> {
        Trace::new(self.model, &self.time_step, self.parameters, last)
    }

    /// Which parameters any function depends on, including limits that plans enforce.
    pub fn dependencies(&self, ends: Option<&Ends>) -> Vec<bool> {
        record(|| {
            let trace = self.trace(false);
            let Dynamics { next, residual, .. } = trace.dynamics();
            let mut all = [next, residual, trace.measurement()].concat();
            all.extend(ends.map_or_else(Vec::new, |ends| self.excess(&self.trace_excess(ends, false), ends, false)));
            all.extend([trace.cost(self.costs, false), self.trace(true).cost(self.costs, true)]);
            trace.phi.iter().map(|&parameter| depends(&all, parameter)).collect()
        })
    }

    /// `nu' r_phi`
    fn by_parameters(&self, trace: &Trace<M>, dynamics: &Dynamics, nu: &[Node]) -> Vec<Node> {
        let held = dynamics.variables(&trace.z);
        let weighed: Vec<_> = weigh(&dynamics.residual, nu).collect();
        vjp(&weighed, &[held.clone(), trace.phi.clone()].concat()).split_off(held.len())
    }
}

/// Pairs of outputs and their weights.
fn weigh<'a>(outputs: &'a [Node], weights: &'a [Node]) -> impl Iterator<Item = (Node, Node)> + 'a {
    outputs.iter().copied().zip(weights.iter().copied())
}

fn vector(nodes: &[Node]) -> Outputs {
    nodes.iter().enumerate().map(|(i, &node)| (node, Target::Set { sink: 0, offset: i })).collect()
}

/// Skips entries that are always 0: outputs are zero initially.
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
