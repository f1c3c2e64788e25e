//! The functions themselves.

use supple_kernels::graph::{Program, Target, record};

use super::{Recorder, vector};
use crate::Model;
use crate::followed::Followed;
use crate::quantity::Quantity;
use crate::system::trace::source;

impl<M: Model> Recorder<'_, M> {
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

    /// The state that each measurement equals, if every measurement is simply a state.
    pub fn picks(&self) -> Option<Vec<usize>> {
        record(|| self.trace(true).measurement().into_iter().map(|y| y.entry_of(source::STATE)).collect())
    }

    /// The numbers of quantities that are `limited`, of a stage.
    pub fn follow_limited(&self, followed: &[Followed], limited: &[bool]) -> Program {
        let quantities: Vec<&Quantity> = followed.iter().map(|followed| &followed.quantity).collect();
        record(|| {
            let trace = self.trace(false);
            let takes_next = quantities.iter().any(|quantity| quantity.needs_next());
            let trace = if takes_next { trace.given_next(|_| Vec::new()) } else { trace };
            let numbers = trace.values(&quantities).concat();
            let kept = numbers.into_iter().zip(limited).filter(|(_, limited)| **limited);
            Program::compile(&vector(&kept.map(|(number, _)| number).collect::<Vec<_>>()))
        })
    }

    /// `l` or `l_N`; for stages whose cost is [given](Self::gives_next) the next state, that is an input too.
    pub fn cost(&self, last: bool) -> Program {
        record(|| Program::compile(&vector(&[self.trace_cost(last).cost(self.costs, last)])))
    }
}
