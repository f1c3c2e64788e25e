use serde::{Deserialize, Serialize};
use supple_kernels::Scalar;

/// One operation on values of a [`Tape`], which are referred to by number.
///
/// Example: [`Recorded`](crate::model::Recorded).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Instruction {
    /// `a + b`
    Add(u32, u32),
    /// `a - b`
    Sub(u32, u32),
    /// `a b`
    Mul(u32, u32),
    /// `a / b`
    Div(u32, u32),
    /// `-a`
    Neg(u32),
    /// `1 / a`
    Recip(u32),
    /// Square root.
    Sqrt(u32),
    /// Sine of an angle in radians.
    Sin(u32),
    /// Cosine of an angle in radians.
    Cos(u32),
    /// `e^a`
    Exp(u32),
    /// Natural logarithm.
    Ln(u32),
    /// Hyperbolic tangent.
    Tanh(u32),
    /// `e^a - 1`
    ExpM1(u32),
    /// Natural logarithm of `1 + a`; its name in files, `ln_1p`, is spelled like `exp_m1`.
    #[serde(rename = "ln_1p", alias = "ln1p")]
    Ln1p(u32),
    /// The angle of the point (`b`, `a`), radians.
    Atan2(u32, u32),
    /// `b` where `a > 0`, else `c`.
    Select(u32, u32, u32),
}

impl Instruction {
    /// The values that it reads.
    pub fn operands(self) -> impl Iterator<Item = u32> {
        let (mut list, mut len) = ([0; 3], 0);
        self.on(|operand| {
            (list[len], len) = (operand, len + 1);
            operand
        });
        list.into_iter().take(len)
    }

    /// The same operation on other values.
    pub(super) fn on(self, mut to: impl FnMut(u32) -> u32) -> Self {
        match self {
            Self::Add(a, b) => Self::Add(to(a), to(b)),
            Self::Sub(a, b) => Self::Sub(to(a), to(b)),
            Self::Mul(a, b) => Self::Mul(to(a), to(b)),
            Self::Div(a, b) => Self::Div(to(a), to(b)),
            Self::Neg(a) => Self::Neg(to(a)),
            Self::Recip(a) => Self::Recip(to(a)),
            Self::Sqrt(a) => Self::Sqrt(to(a)),
            Self::Sin(a) => Self::Sin(to(a)),
            Self::Cos(a) => Self::Cos(to(a)),
            Self::Exp(a) => Self::Exp(to(a)),
            Self::Ln(a) => Self::Ln(to(a)),
            Self::Tanh(a) => Self::Tanh(to(a)),
            Self::ExpM1(a) => Self::ExpM1(to(a)),
            Self::Ln1p(a) => Self::Ln1p(to(a)),
            Self::Atan2(a, b) => Self::Atan2(to(a), to(b)),
            Self::Select(a, b, c) => Self::Select(to(a), to(b), to(c)),
        }
    }

    fn apply<S: Scalar>(self, value: impl Fn(u32) -> S) -> S {
        match self {
            Self::Add(a, b) => value(a) + value(b),
            Self::Sub(a, b) => value(a) - value(b),
            Self::Mul(a, b) => value(a) * value(b),
            Self::Div(a, b) => value(a) / value(b),
            Self::Neg(a) => -value(a),
            Self::Recip(a) => value(a).recip(),
            Self::Sqrt(a) => value(a).sqrt(),
            Self::Sin(a) => value(a).sin(),
            Self::Cos(a) => value(a).cos(),
            Self::Exp(a) => value(a).exp(),
            Self::Ln(a) => value(a).ln(),
            Self::Tanh(a) => value(a).tanh(),
            Self::ExpM1(a) => value(a).exp_m1(),
            Self::Ln1p(a) => value(a).ln_1p(),
            Self::Atan2(a, b) => value(a).atan2(value(b)),
            Self::Select(a, b, c) => value(a).select(value(b), value(c)),
        }
    }
}

/// A straight-line program over numbers: no branches, no loops.
///
/// Its values are numbered: first the inputs, which are the states, the controls, the parameters and the time step;
/// then the constants; then the results of the instructions, in their order.
///
/// Example: [`Recorded`](crate::model::Recorded).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "TapeParts", into = "TapeParts")]
pub struct Tape {
    parts: TapeParts,
}

/// The parts of a [`Tape`], unchecked, as stored in files.
///
/// Example: [`Recorded`](crate::model::Recorded).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TapeParts {
    /// How many states are inputs.
    pub states: usize,
    /// How many controls are inputs.
    pub controls: usize,
    /// How many parameters are inputs.
    pub parameters: usize,
    /// Constants, finite.
    pub constants: Vec<f64>,
    /// Instructions; each reads inputs, constants and results of those before it.
    pub instructions: Vec<Instruction>,
    /// The values that are the results.
    pub outputs: Vec<u32>,
}

/// An error in a [`Tape`], or in several that do not fit together.
///
/// Example: [`Recorded`](crate::model::Recorded).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TapeError {
    /// An instruction reads a value that has not been computed yet.
    #[error("instruction {instruction} reads value {value}, but there are {available} values before it")]
    Forward {
        /// Its number.
        instruction: usize,
        /// The value that it reads.
        value: u32,
        /// How many there are.
        available: usize,
    },
    /// An output that does not exist.
    #[error("output {output} is value {value}, but there are {available} values")]
    Output {
        /// Its number.
        output: usize,
        /// The value that it names.
        value: u32,
        /// How many there are.
        available: usize,
    },
    /// A constant that is infinite or not a number.
    #[error("constant {index} is {value}: constants must be finite")]
    Constant {
        /// Its number.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// More values than can be numbered.
    #[error("{found} values are more than the {limit} that can be numbered")]
    TooLong {
        /// How many there are.
        found: usize,
        /// How many there may be.
        limit: usize,
    },
    /// A tape with the wrong number of inputs or outputs.
    #[error("the tape of {tape} has {found} {what}, not {expected}")]
    Size {
        /// What the tape is for.
        tape: &'static str,
        /// The kind of input or output whose number is wrong.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there must be.
        expected: usize,
    },
    /// A tape that reads the controls although it must not depend on them.
    #[error("the tape of {tape} reads control {control}, but {tape} must not depend on the controls")]
    ReadsControl {
        /// What the tape is for.
        tape: &'static str,
        /// The control, from 1.
        control: usize,
    },
}

impl TryFrom<TapeParts> for Tape {
    type Error = TapeError;

    fn try_from(parts: TapeParts) -> Result<Self, TapeError> {
        Self::new(parts)
    }
}

impl From<Tape> for TapeParts {
    fn from(tape: Tape) -> Self {
        tape.parts
    }
}

/// The most values that a tape may have.
const LIMIT: usize = i32::MAX as usize;

impl Tape {
    /// The tape of these parts.
    ///
    /// # Errors
    /// If an instruction or output refers to a value that does not exist, or a constant is not finite.
    pub fn new(parts: TapeParts) -> Result<Self, TapeError> {
        let lengths = [parts.states, parts.controls, parts.parameters, parts.constants.len(), parts.instructions.len()];
        let found = lengths.into_iter().fold(1usize, usize::saturating_add);
        if found > LIMIT {
            return Err(TapeError::TooLong { found, limit: LIMIT });
        }
        if let Some((index, &value)) = parts.constants.iter().enumerate().find(|(_, value)| !value.is_finite()) {
            return Err(TapeError::Constant { index, value });
        }
        let tape = Self { parts };
        let first = tape.first_result();
        for (number, instruction) in tape.parts.instructions.iter().enumerate() {
            let available = first + number;
            if let Some(value) = instruction.operands().find(|&value| value as usize >= available) {
                return Err(TapeError::Forward { instruction: number, value, available });
            }
        }
        let available = tape.values();
        match tape.parts.outputs.iter().enumerate().find(|(_, value)| **value as usize >= available) {
            Some((output, &value)) => Err(TapeError::Output { output, value, available }),
            None => Ok(tape),
        }
    }

    /// A tape from parts derived from those of another tape, which are known to be valid.
    pub(super) fn trusted(parts: TapeParts) -> Self {
        debug_assert!(Self::new(parts.clone()).is_ok());
        Self { parts }
    }

    /// What it is made of.
    #[must_use]
    pub fn parts(&self) -> &TapeParts {
        &self.parts
    }

    /// How many inputs there are.
    pub(super) fn inputs(&self) -> usize {
        self.parts.states + self.parts.controls + self.parts.parameters + 1
    }

    /// The number of the first instruction's result.
    pub(super) fn first_result(&self) -> usize {
        self.inputs() + self.parts.constants.len()
    }

    /// How many values there are.
    pub(super) fn values(&self) -> usize {
        self.first_result() + self.parts.instructions.len()
    }

    /// How many results there are.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.parts.outputs.len()
    }

    /// Which values the outputs need.
    pub(super) fn needed(&self) -> Vec<bool> {
        let mut needed = vec![false; self.values()];
        self.parts.outputs.iter().for_each(|&value| needed[value as usize] = true);
        let first = self.first_result();
        for (number, instruction) in self.parts.instructions.iter().enumerate().rev() {
            if needed[first + number] {
                instruction.operands().for_each(|value| needed[value as usize] = true);
            }
        }
        needed
    }

    /// Runs it. `x`, `u` and `phi` may be longer than the inputs they provide; missing entries count as 0.
    pub fn run<S: Scalar>(&self, x: &[S], u: &[S], phi: &[S], time_step: S, out: &mut [S]) {
        let TapeParts { states, controls, parameters, constants, instructions, outputs } = &self.parts;
        let mut values = Vec::with_capacity(self.values());
        for (list, &count) in [(x, states), (u, controls), (phi, parameters)] {
            let missing = std::iter::repeat(S::zero());
            values.extend(list.iter().copied().chain(missing).take(count));
        }
        values.push(time_step);
        values.extend(constants.iter().map(|&constant| S::constant(constant)));
        for instruction in instructions {
            let result = instruction.apply(|value| values[value as usize]);
            values.push(result);
        }
        for (out, &value) in out.iter_mut().zip(outputs) {
            *out = values[value as usize];
        }
    }
}
