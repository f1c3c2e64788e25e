//! Models and costs of this repository written down as tapes, as another program would.

use std::cell::RefCell;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use supple::cost::Cost;
use supple::quantity::Known;
use supple::{Instruction, Model, Point, Recorded, RecordedParts, Scalar, Tape, TapeParts};

/// A value of the tape that this thread writes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Written(u32);

thread_local! {
    static TAPE: RefCell<(TapeParts, Vec<f64>)> = RefCell::default();
}

/// Constants have numbers from the top down until the tape is whole.
const CONSTANTS: u32 = u32::MAX;

fn push(instruction: Instruction) -> Written {
    TAPE.with_borrow_mut(|(parts, _)| {
        let place = parts.states + parts.controls + parts.parameters + 1 + parts.instructions.len();
        parts.instructions.push(instruction);
        Written(place as u32)
    })
}

macro_rules! operators {
    ($($trait:ident $method:ident $instruction:ident,)*) => {$(
        impl $trait for Written {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                push(Instruction::$instruction(self.0, other.0))
            }
        }
        impl $trait<f64> for Written {
            type Output = Self;
            fn $method(self, other: f64) -> Self {
                self.$method(Self::constant(other))
            }
        }
    )*};
}
operators! { Add add Add, Sub sub Sub, Mul mul Mul, Div div Div, }

impl Neg for Written {
    type Output = Self;
    fn neg(self) -> Self {
        push(Instruction::Neg(self.0))
    }
}
impl AddAssign for Written {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl SubAssign for Written {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

macro_rules! functions {
    ($($method:ident $instruction:ident,)*) => {$(
        fn $method(self) -> Self {
            push(Instruction::$instruction(self.0))
        }
    )*};
}

impl Scalar for Written {
    fn constant(value: f64) -> Self {
        TAPE.with_borrow_mut(|(_, constants)| {
            constants.push(value);
            Self(CONSTANTS - (constants.len() - 1) as u32)
        })
    }
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    fn sin_cos(self) -> (Self, Self) {
        (push(Instruction::Sin(self.0)), push(Instruction::Cos(self.0)))
    }
    functions! { recip Recip, sqrt Sqrt, exp Exp, ln Ln, tanh Tanh, exp_m1 ExpM1, ln_1p Ln1p, }
    fn atan2(self, x: Self) -> Self {
        push(Instruction::Atan2(self.0, x.0))
    }
    fn select(self, positive: Self, otherwise: Self) -> Self {
        push(Instruction::Select(self.0, positive.0, otherwise.0))
    }
}

/// The tape of a function of states, controls, parameters and time step.
pub fn tape(
    (states, controls, parameters): (usize, usize, usize),
    function: impl FnOnce(&Point<Written>) -> Vec<Written>,
) -> Tape {
    let fresh = TapeParts { states, controls, parameters, ..TapeParts::default() };
    TAPE.replace((fresh, Vec::new()));
    let inputs: Vec<Written> = (0..(states + controls + parameters + 1) as u32).map(Written).collect();
    let (x, rest) = inputs.split_at(states);
    let (u, rest) = rest.split_at(controls);
    let (phi, time_step) = rest.split_at(parameters);
    let outputs = function(&Point { x, u, phi, time_step: time_step[0], w: &[] });
    let (mut parts, constants) = TAPE.take();
    let (first, count) = (inputs.len() as u32, constants.len() as u32);
    // Constants stand before results.
    let place = |value: u32| match value {
        input if input < first => input,
        constant if constant > CONSTANTS - count => first + (CONSTANTS - constant),
        result => result + count,
    };
    let instructions = serde_json::to_value(&parts.instructions).unwrap();
    let moved = instructions.as_array().unwrap().iter().map(|instruction| {
        let (name, operands) = instruction.as_object().unwrap().iter().next().unwrap();
        let moved = |value: &serde_json::Value| place(value.as_u64().unwrap() as u32);
        let operands = match operands.as_array() {
            Some(list) => list.iter().map(moved).collect::<Vec<_>>().into(),
            None => moved(operands).into(),
        };
        serde_json::from_value(serde_json::Value::Object([(name.clone(), operands)].into_iter().collect())).unwrap()
    });
    parts.instructions = moved.collect();
    parts.outputs = outputs.iter().map(|output| place(output.0)).collect();
    parts.constants = constants;
    Tape::new(parts).unwrap()
}

/// A model whose step has no unknowns, with costs, as tapes.
pub fn recorded<M: Model>(model: &M, costs: &[Cost], parameters: usize) -> Recorded {
    let size = model.dimensions();
    let sizes = (size.states, size.controls, parameters);
    let cost = |last: bool| {
        tape(sizes, |at| {
            let mut signals = vec![Written(0); model.signals().len()];
            model.signal(at, &mut signals);
            let mut sum = Written::zero();
            for cost in costs.iter().filter(|cost| !cost.weights(last).are_zero()) {
                let values = cost.quantity.values(at, &Known { signals: &signals, ..Known::NONE });
                let r = cost.residual(values, at);
                sum += cost.of_residual(&r, at.phi, last);
            }
            vec![sum]
        })
    };
    let step = tape(sizes, |at| {
        let mut next = vec![Written(0); size.states];
        model.step(at, &mut next);
        next
    });
    let observe = tape(sizes, |at| {
        let mut y = vec![Written(0); size.measurements];
        model.observe(at, &mut y);
        y
    });
    let without_controls = costs.iter().all(|cost| cost.last.are_zero() || !cost.quantity.depends_on_control());
    assert!(without_controls, "final costs are of states only");
    let parts = RecordedParts {
        channels: model.channels(),
        parameters,
        step,
        observe,
        cost: Some(cost(false)),
        final_cost: Some(cost(true)),
    };
    Recorded::new(parts).unwrap()
}
