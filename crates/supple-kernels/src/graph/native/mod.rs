//! Programs as machine code, for one knot at a time.
//!
//! Interpreted instructions take several times as long as the arithmetic if they work on one number each; in lanes, they
//! do not matter. Machine code does the same arithmetic in the same order: its results have the same bits.

mod assembler;
mod registers;

use std::fmt;

use memmap2::{Mmap, MmapMut};

use self::assembler::{Assembler, Binary, Place, Register};
use self::registers::{AFTERWARDS, NEVER, Next, Registers};
use super::instructions::{Part, SCALE};
use super::schedule::Kind;
use crate::lanes::x86::Avx2;
use crate::{Job, LANES, Lanes, Level, math};

/// The machine code of a program.
pub(super) struct Code {
    memory: Mmap,
    /// Where the function of each part begins.
    entries: Vec<usize>,
    /// Slots of the functions that are called, as the code has their addresses.
    _rows: Vec<u32>,
}

impl fmt::Debug for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Code").field("bytes", &self.memory.len()).finish_non_exhaustive()
    }
}

/// A function of machine code; its argument is the address of the slots.
type Entry = unsafe extern "sysv64" fn(*mut f64);

impl Code {
    /// The code of a program with so many slots, some of which hold its results; `None` where the machine lacks the
    /// instructions or does not allow code to be made.
    pub fn new(parts: &[Part], results: impl Iterator<Item = usize>, slots: usize) -> Option<Self> {
        if cfg!(miri) || !Level::Avx2.is_available() {
            return None;
        }
        let again = parts.iter().filter_map(|part| part.again.as_ref());
        let moved = again.flat_map(|again| again.start.iter().chain(&again.next));
        let given = results.chain(moved.flat_map(|&(to, from)| [to, from]));
        let parts: Vec<Vec<Instruction>> = parts.iter().map(instructions).collect();
        let kept = kept(given, &parts, slots);
        let called = parts.iter().flatten().filter(|instruction| instruction.is_call());
        let rows: Vec<u32> = called.flat_map(Instruction::row).collect();
        let mut address = rows.as_ptr() as usize;
        let (mut out, mut entries) = (Assembler::default(), Vec::with_capacity(parts.len()));
        for part in &parts {
            entries.push(out.code.len());
            function(part, &kept, &mut address, &mut out);
        }
        let mut memory = MmapMut::map_anon(out.code.len()).ok()?;
        memory.copy_from_slice(&out.code);
        Some(Self { memory: memory.make_exec().ok()?, entries, _rows: rows })
    }

    /// Runs the instructions of a part once.
    ///
    /// # Safety
    /// The code must be that of a program with this part, and there must be as many slots as it uses.
    #[inline(always)]
    pub unsafe fn run(&self, part: usize, slots: *mut f64) {
        let entry = self.memory[self.entries[part]..].as_ptr();
        // SAFETY: a function begins there.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry>(entry) };
        // SAFETY: the caller's.
        unsafe { entry(slots) };
    }
}

/// Operands that an instruction has at most.
const OPERANDS: usize = 7;

/// An instruction on slots.
#[derive(Clone, Copy, Debug)]
struct Instruction {
    kind: Kind,
    to: u32,
    operands: [u32; OPERANDS],
}

impl Instruction {
    /// Whether a function computes it.
    fn is_call(&self) -> bool {
        self.kind.arithmetic().is_none() && !matches!(self.kind, Kind::Recip | Kind::Sqrt | Kind::Select)
    }

    /// The slots that it reads.
    fn reads(&self) -> &[u32] {
        let count = match self.kind {
            Kind::Atan2 => 2,
            Kind::Select => 3,
            kind if kind.arithmetic().is_some() => kind.places() - 1,
            _ => 1,
        };
        &self.operands[..count]
    }

    /// The slots that it writes.
    fn writes(&self) -> impl Iterator<Item = u32> {
        let second = (self.kind == Kind::SinCos).then_some(self.operands[2]);
        [Some(self.to), second].into_iter().flatten()
    }

    /// What [`called`] needs.
    fn row(&self) -> [u32; 4] {
        [self.to, self.operands[0], self.operands[1], self.operands[2]]
    }
}

/// The instructions of a part in sequence.
fn instructions(part: &Part) -> Vec<Instruction> {
    let mut rest = part.instructions.as_slice();
    let mut out = Vec::new();
    for (kind, count) in part.kinds() {
        for _ in 0..count {
            let (row, later) = rest.split_at(kind.places());
            rest = later;
            let mut operands = [0; OPERANDS];
            operands[..row.len() - 1].copy_from_slice(&row[1..]);
            out.push(Instruction { kind, to: row[0], operands });
        }
    }
    out
}

/// Which of the slots must have their values when a part ends: those that something else reads, and those that parts
/// read before they write to them.
fn kept(others: impl Iterator<Item = usize>, parts: &[Vec<Instruction>], slots: usize) -> Vec<bool> {
    let mut kept = vec![false; slots];
    others.for_each(|slot| kept[slot] = true);
    for part in parts {
        let mut written = vec![false; slots];
        for instruction in part {
            for &read in instruction.reads() {
                let slot = read as usize / SCALE;
                kept[slot] |= !written[slot];
            }
            instruction.writes().for_each(|to| written[to as usize / SCALE] = true);
        }
    }
    kept
}

/// When each instruction's result and operands are read next.
fn uses(part: &[Instruction], kept: &[bool]) -> Vec<(Next, [Next; OPERANDS])> {
    let mut after: Vec<Next> = kept.iter().map(|&kept| if kept { AFTERWARDS } else { NEVER }).collect();
    let mut uses = vec![(NEVER, [NEVER; OPERANDS]); part.len()];
    for (number, instruction) in part.iter().enumerate().rev() {
        let (to, operands) = &mut uses[number];
        *to = after[instruction.to as usize / SCALE];
        instruction.writes().for_each(|to| after[to as usize / SCALE] = NEVER);
        for (next, &slot) in operands.iter_mut().zip(instruction.reads()) {
            *next = after[slot as usize / SCALE];
        }
        for &slot in instruction.reads() {
            after[slot as usize / SCALE] = number as Next;
        }
    }
    uses
}

/// How many instructions of the same kind follow one another, none of which reads the result of another.
fn independent(part: &[Instruction]) -> usize {
    let depends = |number: &usize| {
        let before = part[..*number].iter().flat_map(Instruction::writes);
        part[*number].kind != part[0].kind || before.into_iter().any(|to| part[*number].reads().contains(&to))
    };
    (1..part.len()).find(depends).unwrap_or(part.len())
}

/// For intermediate results.
const SCRATCH: [Register; 2] = [Register(14), Register(15)];

/// The function of a part. `address` is that of the next row of functions called.
fn function(part: &[Instruction], kept: &[bool], address: &mut usize, out: &mut Assembler) {
    let mut held = Registers::default();
    out.begin();
    let uses = uses(part, kept);
    let mut from = 0;
    while let Some(instruction) = part.get(from) {
        if instruction.is_call() {
            let count = independent(&part[from..]);
            held.flush(out);
            out.call(called(instruction.kind) as usize, *address, count);
            *address += count * size_of::<[u32; 4]>();
            from += count;
        } else {
            inline(instruction, uses[from], &mut held, out);
            from += 1;
        }
    }
    held.flush(out);
    out.end();
}

/// An instruction that needs no function; its result and its operands are read next at these.
fn inline(
    instruction: &Instruction,
    (next, nexts): (Next, [Next; OPERANDS]),
    held: &mut Registers,
    out: &mut Assembler,
) {
    held.begin();
    let reads = instruction.reads().iter().zip(nexts);
    let places: Vec<Place> = reads.map(|(&slot, next)| held.read(slot, next, out)).collect();
    // The operands that are read before anything is written: the result may take the register of one that is not read
    // again.
    let early = match instruction.kind {
        Kind::MulAdd | Kind::MulAdd2 | Kind::MulAdd3 => 2..3,
        Kind::Select => 0..0,
        _ => 0..places.len().min(2),
    };
    let is_late = |place: &Place| places.iter().enumerate().any(|(i, other)| !early.contains(&i) && other == place);
    let reused = places[early.clone()].iter().filter(|place| !is_late(place)).find_map(|place| held.last(*place));
    let to = reused.unwrap_or_else(|| held.take(out));
    match (instruction.kind, places.as_slice()) {
        (Kind::Add, &[a, b]) => binary(Binary::Add, to, (a, b), out),
        (Kind::Sub, &[a, b]) => binary(Binary::Sub, to, (b, a), out),
        (Kind::Recip, &[a]) => {
            out.constant(SCRATCH[0], 1.0);
            out.binary(Binary::Div, to, SCRATCH[0], a);
        }
        (Kind::Sqrt, &[a]) => {
            let from = in_register(a, out);
            out.sqrt(to, from);
        }
        (Kind::Select, &[a, b, c]) => {
            out.is_positive(SCRATCH[1], a);
            let yes = in_register(b, out);
            out.copy(to, c);
            out.blend(to, SCRATCH[1], yes, to);
        }
        (Kind::MulAdd | Kind::MulAdd2 | Kind::MulAdd3, &[a, b, c, ref others @ ..]) => {
            out.copy(to, c);
            add_product(to, (a, b), out);
            others.as_chunks::<2>().0.iter().for_each(|&[a, b]| add_product(to, (a, b), out));
        }
        (_, &[a, b, ref others @ ..]) => {
            binary(Binary::Mul, to, (a, b), out);
            others.as_chunks::<2>().0.iter().for_each(|&[a, b]| add_product(to, (a, b), out));
        }
        _ => {}
    }
    held.write(to, instruction.to, next);
}

/// The register of a value, which is loaded if it is in memory.
fn in_register(place: Place, out: &mut Assembler) -> Register {
    match place {
        Place::Register(register) => register,
        Place::Memory(offset) => {
            out.load(SCRATCH[0], offset);
            SCRATCH[0]
        }
    }
}

/// Only the second operand of an instruction may be in memory: two factors or terms with one in memory second.
fn memory_last((a, b): (Place, Place)) -> (Place, Place) {
    if matches!(b, Place::Register(_)) { (b, a) } else { (a, b) }
}

/// `to = a op b`
fn binary(operation: Binary, to: Register, operands: (Place, Place), out: &mut Assembler) {
    let (a, b) = if operation == Binary::Sub { operands } else { memory_last(operands) };
    let first = in_register(a, out);
    out.binary(operation, to, first, b);
}

/// `to = a b + to`
fn add_product(to: Register, factors: (Place, Place), out: &mut Assembler) {
    let (a, b) = memory_last(factors);
    let first = in_register(a, out);
    out.multiply_add(to, first, b);
}

/// A function that machine code calls: it works on `count` rows of slots, which are those of [`Instruction::row`].
type Called = unsafe extern "sysv64" fn(slots: *mut u8, rows: *const [u32; 4], count: usize);

/// The function that computes instructions of a kind.
fn called(kind: Kind) -> Called {
    macro_rules! one_by_one {
        (|$a:ident, $b:ident| $value:expr) => {{
            unsafe extern "sysv64" fn call(slots: *mut u8, rows: *const [u32; 4], count: usize) {
                // SAFETY: the code has them from `Code::new`.
                for &[to, a, b, _] in unsafe { std::slice::from_raw_parts(rows, count) } {
                    // SAFETY: slots of the program.
                    let [$a, $b] = [a, b].map(|at| unsafe { slots.byte_add(at as usize).cast::<f64>().read() });
                    // SAFETY: as above.
                    unsafe { slots.byte_add(to as usize).cast::<f64>().write($value) };
                }
            }
            call
        }};
    }
    match kind {
        Kind::Atan2 => one_by_one!(|a, b| math::atan2(a, b)),
        Kind::Exp => one_by_one!(|a, _b| math::exp(a)),
        Kind::Ln => one_by_one!(|a, _b| math::ln(a)),
        Kind::Tanh => one_by_one!(|a, _b| math::tanh(a)),
        Kind::ExpM1 => one_by_one!(|a, _b| math::exp_m1(a)),
        Kind::Ln1p => one_by_one!(|a, _b| math::ln_1p(a)),
        Kind::Cos => cosines,
        _ => sines_and_cosines,
    }
}

unsafe extern "sysv64" fn cosines(slots: *mut u8, rows: *const [u32; 4], count: usize) {
    // SAFETY: the caller's.
    unsafe { in_lanes(slots, rows, count, false) };
}

unsafe extern "sysv64" fn sines_and_cosines(slots: *mut u8, rows: *const [u32; 4], count: usize) {
    // SAFETY: the caller's.
    unsafe { in_lanes(slots, rows, count, true) };
}

/// # Safety
/// The rows must be those of a program with these slots.
unsafe fn in_lanes(slots: *mut u8, rows: *const [u32; 4], count: usize, sines: bool) {
    // SAFETY: the caller's.
    for rows in unsafe { std::slice::from_raw_parts(rows, count) }.chunks(LANES) {
        let mut angles = [0.0; LANES];
        for (angle, &[_, from, ..]) in angles.iter_mut().zip(rows) {
            // SAFETY: the caller's.
            *angle = unsafe { slots.byte_add(from as usize).cast::<f64>().read() };
        }
        let (sin, cos) = Avx2::apart(SinesAndCosines(&angles));
        for ((&[to, _, _, second], sin), cos) in rows.iter().zip(sin).zip(cos) {
            let (first, second) = if sines { ((to, sin), (second, cos)) } else { ((to, cos), (to, cos)) };
            for (to, value) in [second, first] {
                // SAFETY: the caller's.
                unsafe { slots.byte_add(to as usize).cast::<f64>().write(value) };
            }
        }
    }
}

struct SinesAndCosines<'a>(&'a [f64; LANES]);

impl Job for SinesAndCosines<'_> {
    type Output = ([f64; LANES], [f64; LANES]);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let (sin, cos) = L::from_array(*self.0).sin_cos();
        (sin.to_array(), cos.to_array())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scalar;
    use crate::graph::{Node, Program, Target, record};

    /// Numbers of a plain linear congruential generator.
    struct Random(u64);

    impl Random {
        fn below(&mut self, end: usize) -> usize {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) as usize % end
        }
    }

    /// A program of so many operations of all kinds on five numbers and two parameters, and a repetition among them.
    fn random_program(seed: u64, length: usize) -> Program {
        record(|| {
            let mut random = Random(seed);
            let mut nodes: Vec<Node> = (0..5).map(|i| Node::entry(0, i)).collect();
            nodes.extend([Node::parameter(0), Node::parameter(1), Node::constant(0.7)]);
            for number in 0..length {
                // Mostly those made last, sometimes one made long before.
                let recent = nodes.len().min([4, 40, 400][random.below(3)]);
                let mut any = || nodes[nodes.len() - 1 - random.below(recent)];
                let (a, b, c, d) = (any(), any(), any(), any());
                let tamed = |x: Node| (x.square() + 1.5).recip();
                let next = match random.below(24) {
                    0 => a.sin() * b.cos() + c,
                    1 => (tamed(a) * 0.5).atan2(b),
                    2 => tamed(a).exp() + tamed(b).ln(),
                    3 => a.tanh() * tamed(b).exp_m1(),
                    4 => tamed(a).ln_1p() - b.cos(),
                    5 => (a.square() + 0.25).sqrt(),
                    6 | 7 => tamed(a),
                    8 => (a - b).select(c, d),
                    9 | 10 => a - b,
                    11 | 12 => (a + b) * 0.5,
                    13 | 14 => a * tamed(b),
                    15 | 16 => tamed(a) * b + tamed(c) * d + a * tamed(d),
                    17 | 18 => c - tamed(a) * b,
                    19 | 20 => (a + tamed(b) * c) * 0.25,
                    _ => tamed(b) * c + d * 0.125 + tamed(a) * 3.0,
                };
                nodes.push(next);
                if number == length / 2 {
                    let start = vec![next, c, d];
                    nodes.extend(Scalar::repeat(start, 7, |now| {
                        let [x, y, z] = [now[0], now[1], now[2]];
                        let slower = tamed(x * y) * 0.5 + z * 0.1;
                        (vec![y * 0.5 + a * 0.01, slower.sin(), x + tamed(b)], slower - 0.3)
                    }));
                }
            }
            let results = nodes.iter().rev().take(6).enumerate();
            let outputs: Vec<_> = results.map(|(offset, &node)| (node, Target::Set { sink: 0, offset })).collect();
            Program::compile(&outputs)
        })
    }

    fn code_of(program: &Program) -> Option<Code> {
        Code::new(&program.parts, program.outputs.iter().map(|&(slot, _)| slot), program.slots)
    }

    fn found(program: &Program, code: Option<&Code>, numbers: &[f64]) -> Vec<u64> {
        let (mut scratch, mut out) = (crate::Scratch::new(), [0.0; 6]);
        program.with_code(code, &[0.4, -1.3], &mut scratch).run_in::<Avx2>(&[numbers], &mut [&mut out]);
        out.iter().map(|value| value.to_bits()).collect()
    }

    #[test]
    fn machine_code_has_the_bits_of_interpreted_instructions() {
        if !Level::Avx2.is_available() {
            return;
        }
        for seed in 0..200 {
            let program = random_program(seed, 5 + 3 * seed as usize);
            let code = code_of(&program).expect("this machine has the instructions");
            for numbers in [[0.3, -1.2, 2.5, 0.01, 1e3], [-0.0, 1e6, -7.0, 0.5, 1e-9]] {
                let (expected, found) = (found(&program, None, &numbers), found(&program, Some(&code), &numbers));
                assert_eq!(expected, found, "seed {seed}");
                assert!(found.into_iter().all(|bits| f64::from_bits(bits).is_finite()), "seed {seed}");
            }
        }
    }

    #[test]
    fn numbers_that_are_not_finite_pass() {
        let program = record(|| {
            let [a, b, c] = [0, 1, 2].map(|i| Node::entry(0, i));
            let nodes = [a.select(b, c), a.sqrt(), a.recip(), a * b + c, a.sin(), a - b];
            let outputs = nodes.into_iter().enumerate().map(|(offset, node)| (node, Target::Set { sink: 0, offset }));
            Program::compile(&outputs.collect::<Vec<_>>())
        });
        let code = code_of(&program);
        if code.is_none() {
            return;
        }
        for a in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, 5e-324, -1.0] {
            let [expected, found] = [None, code.as_ref()]
                .map(|code| found(&program, code, &[a, 2.0, 3.0]).into_iter().map(f64::from_bits).collect::<Vec<_>>());
            let alike = |(x, y): (&f64, &f64)| x.to_bits() == y.to_bits() || (x.is_nan() && y.is_nan());
            assert!(expected.iter().zip(&found).all(alike), "{a}: {expected:?} {found:?}");
        }
    }

    #[test]
    fn code_is_made_for_programs_that_run_repeatedly() {
        let program = random_program(1, 20);
        let runs_until_made = (1..1000).find(|_| {
            program.run_single(&[&[0.5; 5]], &[1.0, 2.0], &mut [&mut [0.0; 6]]);
            program.native.is_made()
        });
        // More runs are needed only if other tests choose the baseline in the meantime.
        assert!(!Level::Avx2.is_available() || runs_until_made.is_some_and(|runs| runs > 3), "{runs_until_made:?}");
    }
}
