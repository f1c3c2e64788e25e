//! Excesses beyond the limits that plans enforce, and their derivatives.

use supple_kernels::Scalar;
use supple_kernels::graph::{Node, Program, jacobian, record, tangent, vjp};
use supple_kernels::padded;

use super::{Outputs, Recorder, add, set, sum, vector, weigh};
use crate::Model;
use crate::followed::{Ends, LimitEnd};
use crate::quantity::Quantity;
use crate::system::trace::{Trace, entries};

/// Numbers of the sources that these programs read beside state, control and next state.
pub(in crate::system) mod excess_source {
    pub const MULTIPLIERS: usize = 3;
    pub const VARIATION: usize = 4;
    pub const MULTIPLIER_VARIATION: usize = 5;
}

impl<M: Model> Recorder<'_, M> {
    /// The variables of excesses: the next state is one where any of the limited quantities takes it.
    pub(super) fn trace_excess(&self, ends: &Ends, last: bool) -> Trace<'_, M> {
        let trace = self.trace(last);
        match ends.need_next() {
            false => trace,
            true => trace.given_next(|given| if last { Vec::new() } else { self.excess(given, ends, false) }),
        }
    }

    /// Which entries of the next state excesses depend on.
    pub fn excesses_count(&self, ends: &Ends) -> Vec<usize> {
        record(|| self.trace_excess(ends, false).counting().to_vec())
    }

    /// The excess at every side of a limit; at the end of a plan, 0 for numbers that depend on the control.
    pub(super) fn excess(&self, trace: &Trace<M>, ends: &Ends, last: bool) -> Vec<Node> {
        let quantities: Vec<&Quantity> = ends.followed.iter().map(|followed| &followed.quantity).collect();
        let values = trace.values(&quantities);
        let of_end = |end: &LimitEnd| {
            let quantity = quantities[end.limit];
            if last && quantity.depends_on_control() {
                return Node::zero();
            }
            let value = values[end.limit][end.entry];
            let bound: Node = ends.bound(end).resolve(&trace.phi);
            if end.upper { value - bound } else { bound - value }
        };
        ends.list.iter().map(of_end).collect()
    }

    /// `e`
    pub fn excesses(&self, ends: &Ends, last: bool) -> Program {
        record(|| Program::compile(&vector(&self.excess(&self.trace_excess(ends, last), ends, last))))
    }

    /// `e_z`, by the next state too where it is given.
    pub fn excess_jacobian(&self, ends: &Ends, last: bool) -> Program {
        record(|| {
            let trace = self.trace_excess(ends, last);
            let variables = trace.with_next();
            let mut outputs = Outputs::new();
            let stride = padded(variables.len());
            for (i, row) in jacobian(&self.excess(&trace, ends, last), &variables).into_iter().enumerate() {
                for (j, entry) in row.into_iter().enumerate() {
                    set(&mut outputs, entry, i * stride + j);
                }
            }
            Program::compile(&outputs)
        })
    }

    /// `[(mu' e)_zz | 0]`, by the next state too where it is given, and then `(mu' e)_z` in the last column; added.
    pub fn excess_curvature(&self, ends: &Ends, last: bool) -> Program {
        record(|| {
            let trace = self.trace_excess(ends, last);
            let (excess, variables) = (self.excess(&trace, ends, last), trace.with_next());
            let multipliers = entries(excess_source::MULTIPLIERS, excess.len());
            let gradient = vjp(&weigh(&excess, &multipliers).collect::<Vec<_>>(), &variables);
            let stride = padded(variables.len() + 1);
            let mut outputs = Outputs::new();
            if variables.len() > trace.z.len() {
                let slopes = gradient.iter().enumerate();
                slopes.for_each(|(a, &slope)| add(&mut outputs, slope, a * stride + variables.len()));
            }
            for (a, row) in jacobian(&gradient, &variables).into_iter().enumerate() {
                for (b, entry) in row.into_iter().enumerate() {
                    add(&mut outputs, entry, a * stride + b);
                }
            }
            Program::compile(&outputs)
        })
    }

    /// `mu' e_phi`, with the next state held fixed where it is given.
    pub fn excess_parameter_gradient(&self, ends: &Ends, last: bool) -> Program {
        record(|| {
            let trace = self.trace_excess(ends, last);
            let excess = self.excess(&trace, ends, last);
            let multipliers = entries(excess_source::MULTIPLIERS, excess.len());
            sums(by_parameters(&trace, &weigh(&excess, &multipliers).collect::<Vec<_>>()))
        })
    }

    /// `dz' (mu' e)_{z phi} + dmu' e_phi`, the same.
    pub fn excess_parameter_gradient_along(&self, ends: &Ends, last: bool) -> Program {
        record(|| {
            let trace = self.trace_excess(ends, last);
            let excess = self.excess(&trace, ends, last);
            let multipliers = entries(excess_source::MULTIPLIERS, excess.len());
            let moved = entries(excess_source::MULTIPLIER_VARIATION, excess.len());
            let variables = trace.with_next();
            let dz = entries(excess_source::VARIATION, variables.len());
            let rates = tangent(&excess, &weigh(&variables, &dz).collect::<Vec<_>>());
            let weighed: Vec<_> = weigh(&rates, &multipliers).chain(weigh(&excess, &moved)).collect();
            sums(by_parameters(&trace, &weighed))
        })
    }
}

/// The gradient of a weighted sum by the parameters, the variables of the point held fixed.
fn by_parameters<M: Model>(trace: &Trace<M>, weighed: &[(Node, Node)]) -> Vec<Node> {
    let variables = trace.with_next();
    vjp(weighed, &[&variables[..], &trace.phi].concat()).split_off(variables.len())
}

fn sums(gradient: Vec<Node>) -> Program {
    let mut outputs = Outputs::new();
    for (i, entry) in gradient.into_iter().enumerate() {
        sum(&mut outputs, entry, i);
    }
    Program::compile(&outputs)
}
