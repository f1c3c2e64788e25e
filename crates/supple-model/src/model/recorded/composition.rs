//! Decomposes costs into a norm of a residual by analysing their recorded instructions.
//!
//! ```text
//! l(z; phi) = nu(r(z; phi); phi),   nu = sum of weights times r_i^2, sqrt(sum of weights times r_i^2 + c), and others
//! ```
//!
//! `r` holds the arguments of squares, up to linear functions, and the states and controls that the other terms use.
//! `R' nu_rr R` is then the Gauss-Newton curvature of the squares and the exact curvature of everything else.

use super::tape::{Instruction, Tape, TapeParts};

/// A cost decomposed as `nu(r)`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Composition {
    /// `r(x, u; phi)`
    pub residual: Tape,
    /// `nu(r; phi)`: its states are the entries of the residual.
    pub norm: Tape,
    /// Whether `nu` is known to be convex in `r` for all parameters.
    pub convex: bool,
}

/// The roles that a value has in the norm. One value may have several.
#[derive(Clone, Copy, Debug, Default)]
struct Parts {
    /// It is a sum of terms.
    outer: bool,
    /// It is a sum that may have a negative weight.
    turned: bool,
    /// It is a linear function of residuals inside a square.
    inner: bool,
    /// It is used in full, down to states and controls.
    whole: bool,
}

/// Limit on the number of values examined to classify one of them.
const LOOK: usize = 4096;

struct Search<'a> {
    parts: &'a TapeParts,
    first_result: usize,
    /// Whether each value depends on states or controls.
    varies: Vec<bool>,
    /// For values that do not vary: whether each is at least 0 for any parameters.
    positive: Vec<bool>,
    belongs: Vec<Parts>,
    convex: bool,
}

impl Composition {
    /// Decomposes the cost that is the first output of a tape.
    pub fn of(tape: &Tape) -> Self {
        let mut search = Search::new(tape);
        if let Some(&cost) = tape.parts().outputs.first() {
            search.belongs[cost as usize].outer = true;
        }
        for value in (0..tape.values() as u32).rev() {
            search.visit(value);
        }
        search.build()
    }
}

impl<'a> Search<'a> {
    fn new(tape: &'a Tape) -> Self {
        let (parts, joint) = (tape.parts(), tape.parts().states + tape.parts().controls);
        let first_result = tape.first_result();
        let mut varies: Vec<bool> = (0..first_result).map(|input| input < joint).collect();
        let mut positive = vec![false; first_result];
        // The time step.
        positive[tape.inputs() - 1] = true;
        for (place, &constant) in parts.constants.iter().enumerate() {
            positive[tape.inputs() + place] = constant >= 0.0;
        }
        for &instruction in &parts.instructions {
            varies.push(instruction.operands().any(|value| varies[value as usize]));
            let of = |value: u32| positive[value as usize];
            positive.push(match instruction {
                Instruction::Add(a, b) | Instruction::Div(a, b) => of(a) && of(b),
                Instruction::Mul(a, b) => a == b || of(a) && of(b),
                Instruction::Recip(a) => of(a),
                Instruction::Select(_, a, b) => of(a) && of(b),
                Instruction::Sqrt(_) | Instruction::Exp(_) => true,
                _ => false,
            });
        }
        let belongs = vec![Parts::default(); tape.values()];
        Self { parts, first_result, varies, positive, belongs, convex: true }
    }

    fn instruction(&self, value: u32) -> Option<Instruction> {
        self.parts.instructions.get((value as usize).checked_sub(self.first_result)?).copied()
    }

    fn varies(&self, value: u32) -> bool {
        self.varies[value as usize]
    }

    /// Assigns roles to the operands of a value.
    fn visit(&mut self, value: u32) {
        let Parts { outer, turned, inner, whole } = self.belongs[value as usize];
        let Some(instruction) = self.instruction(value) else { return };
        if !self.varies(value) || whole {
            if outer || inner || whole {
                instruction.operands().for_each(|operand| self.belongs[operand as usize].whole = true);
            }
            if !self.varies(value) {
                return;
            }
        }
        if inner && let Some(operands) = self.linear(instruction) {
            operands.for_each(|(operand, _)| self.belongs[operand as usize].inner = true);
        }
        if outer {
            self.visit_term(value, instruction, turned);
        }
    }

    fn visit_term(&mut self, value: u32, instruction: Instruction, turned: bool) {
        if let Some(operands) = self.linear(instruction) {
            for (operand, keeps) in operands {
                let part = &mut self.belongs[operand as usize];
                part.outer = true;
                part.turned |= turned || !keeps;
            }
            return;
        }
        if let Some(convex) = self.square(instruction) {
            self.convex &= convex && !turned;
            instruction.operands().for_each(|operand| self.belongs[operand as usize].inner = true);
            return;
        }
        if let Instruction::Sqrt(sum) = instruction
            && let Some(convex) = self.sum_of_squares(sum)
        {
            self.convex &= convex && !turned;
            self.belongs[sum as usize].outer = true;
            return;
        }
        self.convex = false;
        self.belongs[value as usize].whole = true;
        instruction.operands().for_each(|operand| self.belongs[operand as usize].whole = true);
    }

    /// The operands of a linear function, each with a flag telling whether its factor is at least 0.
    fn linear(&self, instruction: Instruction) -> Option<impl Iterator<Item = (u32, bool)> + use<>> {
        let positive = |value: u32| self.positive[value as usize];
        let list = match instruction {
            Instruction::Add(a, b) => [Some((a, true)), Some((b, true))],
            Instruction::Sub(a, b) => [Some((a, true)), Some((b, false))],
            Instruction::Neg(a) => [Some((a, false)), None],
            // The role of the factor itself does not matter: it is constant.
            Instruction::Mul(a, b) if !self.varies(b) => [Some((a, positive(b))), Some((b, true))],
            Instruction::Mul(a, b) if !self.varies(a) => [Some((b, positive(a))), Some((a, true))],
            Instruction::Div(a, b) if !self.varies(b) => [Some((a, positive(b))), Some((b, true))],
            _ => return None,
        };
        Some(list.into_iter().flatten())
    }

    /// Whether a product is a square or part of a quadratic form, and if so, whether it is known to be at least 0.
    fn square(&self, instruction: Instruction) -> Option<bool> {
        let Instruction::Mul(a, b) = instruction else { return None };
        let ((core_a, positive_a), (core_b, positive_b)) = (self.core(a), self.core(b));
        if core_a == core_b {
            return Some(positive_a && positive_b);
        }
        let (of_a, of_b) = (self.atoms(a)?, self.atoms(b)?);
        of_a.iter().any(|atom| of_b.contains(atom)).then_some(false)
    }

    /// A value without its constant factors, and whether these are at least 0.
    fn core(&self, mut value: u32) -> (u32, bool) {
        let mut positive = true;
        loop {
            let (operand, keeps) = match self.instruction(value) {
                Some(Instruction::Neg(a)) => (a, false),
                Some(Instruction::Mul(a, b) | Instruction::Div(a, b)) if self.varies(a) && !self.varies(b) => {
                    (a, self.positive[b as usize])
                }
                Some(Instruction::Mul(a, b)) if self.varies(b) && !self.varies(a) => (b, self.positive[a as usize]),
                _ => return (value, positive),
            };
            (value, positive) = (operand, positive && keeps);
        }
    }

    /// The values that a value is a linear function of; `None` if too many would have to be examined.
    fn atoms(&self, value: u32) -> Option<Vec<u32>> {
        let (mut atoms, mut open) = (Vec::new(), vec![value]);
        for _ in 0..LOOK {
            let Some(value) = open.pop() else { return Some(atoms) };
            match self.instruction(value).and_then(|instruction| self.linear(instruction)) {
                Some(operands) => open.extend(operands.map(|(operand, _)| operand).filter(|&o| self.varies(o))),
                None => atoms.push(value),
            }
        }
        None
    }

    /// Whether a value is a sum of squares and constants, and if so, whether all of its terms are known to be at
    /// least 0.
    fn sum_of_squares(&self, value: u32) -> Option<bool> {
        let (mut convex, mut open) = (true, vec![(value, true)]);
        for _ in 0..LOOK {
            let Some((value, positive)) = open.pop() else { return Some(convex) };
            if !self.varies(value) {
                convex &= positive && self.positive[value as usize];
                continue;
            }
            let instruction = self.instruction(value)?;
            match self.linear(instruction) {
                Some(operands) if matches!(instruction, Instruction::Add(..) | Instruction::Sub(..)) => {
                    open.extend(operands.map(|(operand, keeps)| (operand, positive && keeps)));
                }
                Some(operands) => {
                    let varying = operands.filter(|&(operand, _)| self.varies(operand));
                    open.extend(varying.map(|(operand, keeps)| (operand, positive && keeps)));
                }
                None => convex &= positive && self.square(instruction)?,
            }
        }
        None
    }

    /// Builds both tapes.
    fn build(&self) -> Composition {
        let TapeParts { states, controls, parameters, constants, outputs, .. } = self.parts;
        let joint = states + controls;
        // A value becomes an entry of the residual where its decomposition ends.
        let is_atom = |value: u32| {
            let Parts { inner, whole, outer, .. } = self.belongs[value as usize];
            match self.instruction(value) {
                None => (value as usize) < joint && (inner || whole || outer),
                Some(instruction) => inner && self.varies(value) && self.linear(instruction).is_none(),
            }
        };
        let count = self.belongs.len() as u32;
        let atoms: Vec<u32> = (0..count).filter(|&value| is_atom(value)).collect();
        let residual = TapeParts { outputs: atoms.clone(), ..self.parts.clone() };
        let mut writer = Writer {
            inner: vec![None; count as usize],
            whole: vec![None; count as usize],
            outer: vec![None; count as usize],
            next: (atoms.len() + parameters + 1 + constants.len()) as u32,
            instructions: Vec::new(),
        };
        for (place, &atom) in atoms.iter().enumerate() {
            writer.inner[atom as usize] = Some(place as u32);
            if self.instruction(atom).is_none() {
                writer.whole[atom as usize] = Some(place as u32);
            }
        }
        for (place, value) in (joint..self.first_result).enumerate() {
            writer.whole[value] = Some((atoms.len() + place) as u32);
        }
        for value in self.first_result as u32..count {
            self.write(value, &mut writer);
        }
        let outputs = outputs.iter().take(1).map(|&cost| writer.outer(cost)).collect();
        let Writer { instructions, .. } = writer;
        let constants = constants.clone();
        let norm =
            TapeParts { states: atoms.len(), controls: 0, parameters: *parameters, constants, instructions, outputs };
        Composition { residual: Tape::trusted(residual), norm: Tape::trusted(norm), convex: self.convex }
    }

    /// Writes the instructions that the norm needs for a value.
    fn write(&self, value: u32, writer: &mut Writer) {
        let (Parts { outer, inner, whole, .. }, place) = (self.belongs[value as usize], value as usize);
        let Some(instruction) = self.instruction(value) else { return };
        if !self.varies(value) || whole {
            if outer || inner || whole {
                writer.whole[place] = Some(writer.push(instruction.on(|operand| writer.whole(operand))));
            }
            if !self.varies(value) || !(inner || outer) {
                return;
            }
        }
        if inner && writer.inner[place].is_none() {
            writer.inner[place] = Some(writer.push(instruction.on(|operand| writer.inner(operand))));
        }
        if outer {
            let linear = self.linear(instruction).is_some();
            writer.outer[place] = if linear || matches!(instruction, Instruction::Sqrt(_)) && !whole {
                Some(writer.push(instruction.on(|operand| writer.outer(operand))))
            } else if whole {
                writer.whole[place]
            } else {
                Some(writer.push(instruction.on(|operand| writer.inner(operand))))
            };
        }
    }
}

/// For each role of each value, its number in the norm's tape.
struct Writer {
    inner: Vec<Option<u32>>,
    whole: Vec<Option<u32>>,
    outer: Vec<Option<u32>>,
    next: u32,
    instructions: Vec<Instruction>,
}

impl Writer {
    fn push(&mut self, instruction: Instruction) -> u32 {
        self.instructions.push(instruction);
        self.next += 1;
        self.next - 1
    }

    /// The number of a value used in full.
    fn whole(&self, value: u32) -> u32 {
        self.whole[value as usize].unwrap_or(0)
    }

    /// The number of a value in terms of the residual's entries, or of the full value if it is constant.
    fn inner(&self, value: u32) -> u32 {
        self.inner[value as usize].unwrap_or_else(|| self.whole(value))
    }

    /// The number of a value as a sum of terms.
    fn outer(&self, value: u32) -> u32 {
        self.outer[value as usize].unwrap_or_else(|| self.inner(value))
    }
}
