use std::cell::RefCell;

use super::instructions::{Again, Part, Round, SCALE};
use super::native::Code;
use super::program::{Program, Target};
use super::schedule::Kind;
use crate::Single as _;
use crate::pair::Pair;
use crate::{Job, LANES, Lanes, Matrices, Scalar, Scratch, dispatch};

/// What a program reads at its knots: matrices, from the knot itself or from a later one.
///
/// Example: [`Batch`].
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// The matrices.
    pub matrices: &'a Matrices,
    /// How many knots later they are read.
    pub shift: usize,
}

impl<'a> From<&'a Matrices> for Source<'a> {
    fn from(matrices: &'a Matrices) -> Self {
        Self { matrices, shift: 0 }
    }
}

/// The knots that a program is run for.
///
/// ```
/// use supple_kernels::graph::{Batch, Node, Program, Source, Target, record};
/// use supple_kernels::{Matrices, Scratch};
///
/// // The change from each of three numbers to the next.
/// let program = record(|| {
///     let change = Node::entry(1, 0) - Node::entry(0, 0);
///     Program::compile(&[(change, Target::Set { sink: 0, offset: 0 })])
/// });
/// let numbers = Matrices::of_rows(&[vec![1.0], vec![4.0], vec![9.0]], 1);
/// let mut changes = Matrices::vectors(2, 1);
/// let sources = [Source::from(&numbers), Source { matrices: &numbers, shift: 1 }];
/// let (batch, mut scratch) = (Batch { first: 0, count: 2 }, Scratch::new());
/// program.run(batch, (&sources, &[]), (Some(&mut changes), &mut []), &mut scratch);
/// assert_eq!(changes.to_rows(), [[3.0], [5.0]]);
///
/// // At one knot at a time.
/// let mut change = [0.0];
/// program.with_parameters(&[], &mut scratch).run(&[&[2.0], &[2.5]], &mut [&mut change]);
/// assert_eq!(change, [0.5]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Batch {
    /// The first.
    pub first: usize,
    /// How many.
    pub count: usize,
}

impl Program {
    /// Runs the program at every knot of a batch, several at a time. Its only sink is `sink`.
    ///
    /// Results with [`Target::Sum`] are added to `sums` in the order of the knots. Long work without sums is divided among
    /// the threads of the current pool: the results do not depend on their number. Allocates nothing once
    /// `scratch` has been used, except for what threads need.
    pub fn run(
        &self,
        batch: Batch,
        (sources, parameters): (&[Source], &[f64]),
        (sink, sums): (Option<&mut Matrices>, &mut [f64]),
        scratch: &mut Scratch,
    ) {
        if self.is_empty() || batch.count == 0 {
            return;
        }
        assert!(self.sources <= sources.len() && self.parameters <= parameters.len(), "all that is read is given");
        let sink = sink.map_or(Sink { data: &mut [], size: 0 }, |sink| {
            let size = sink.rows() * sink.stride();
            Sink { data: &mut sink.as_mut_slice()[batch.first * size..(batch.first + batch.count) * size], size }
        });
        let threads = rayon::current_num_threads();
        if sums.is_empty() && threads > 1 && self.is_shared(batch) {
            self.share(batch, (sources, parameters), sink);
        } else {
            dispatch(Run { program: self, batch, sources, parameters, sink, sums, scratch });
        }
    }

    /// Splits the knots in halves among threads until the parts are small.
    fn share(&self, batch: Batch, given: (&[Source], &[f64]), sink: Sink) {
        if !self.is_shared(batch) {
            let (sources, parameters) = given;
            let sums = &mut [];
            return SINGLE.with_borrow_mut(|scratch| {
                dispatch(Run { program: self, batch, sources, parameters, sink, sums, scratch });
            });
        }
        let Batch { first, count } = batch;
        let half = (count / 2).next_multiple_of(2 * LANES);
        let (head, tail) = sink.data.split_at_mut(half * sink.size);
        rayon::join(
            || self.share(Batch { first, count: half }, given, Sink { data: head, size: sink.size }),
            || {
                let rest = Batch { first: first + half, count: count - half };
                self.share(rest, given, Sink { data: tail, size: sink.size });
            },
        );
    }

    /// Whether two threads are faster than one for a batch: enough work, and more knots than the lanes process at once.
    fn is_shared(&self, batch: Batch) -> bool {
        batch.count > 2 * LANES && self.len().saturating_mul(batch.count) >= 2 * SHARE
    }

    /// Runs the program at one knot: sources and sinks are single matrices by rows, padded as those of [`Matrices`] are.
    pub fn run_single(&self, sources: &[&[f64]], parameters: &[f64], sinks: &mut [&mut [f64]]) {
        SINGLE.with_borrow_mut(|scratch| self.with_parameters(parameters, scratch).run(sources, sinks));
    }

    /// Prepares to run the program at one knot at a time, with the same parameters.
    pub fn with_parameters<'a>(&'a self, parameters: &[f64], scratch: &'a mut Scratch) -> OneByOne<'a> {
        self.with_code(self.code(), parameters, scratch)
    }

    /// The same, by this machine code if there is some: that of this program.
    pub(super) fn with_code<'a>(
        &'a self,
        code: Option<&'a Code>,
        parameters: &[f64],
        scratch: &'a mut Scratch,
    ) -> OneByOne<'a> {
        assert!(self.parameters <= parameters.len(), "all that is read is given");
        // SAFETY: every slot is written before it is read.
        let slots = unsafe { scratch.leftovers::<f64>(self.slots) };
        fix(self, parameters, slots);
        OneByOne { program: self, code, slots }
    }
}

/// A [`Program`] to be run at one knot at a time.
///
/// Example: [`Batch`].
#[derive(Debug)]
pub struct OneByOne<'a> {
    program: &'a Program,
    code: Option<&'a Code>,
    slots: &'a mut [f64],
}

impl OneByOne<'_> {
    /// Runs it as [`Program::run_single`] does.
    pub fn run(&mut self, sources: &[&[f64]], sinks: &mut [&mut [f64]]) {
        assert!(self.program.sources <= sources.len(), "all that is read is given");
        let Self { program, code, ref mut slots } = *self;
        dispatch(AtKnot { program, code, slots, sources, sinks });
    }
}

#[cfg(test)]
impl OneByOne<'_> {
    /// Runs it as [`OneByOne::run`] does, at the level of these lanes.
    pub(super) fn run_in<L: Lanes>(&mut self, sources: &[&[f64]], sinks: &mut [&mut [f64]]) {
        let Self { program, code, ref mut slots } = *self;
        L::apart(AtKnot { program, code, slots, sources, sinks });
    }
}

/// The least number of operations worth moving to another thread.
const SHARE: usize = 1_000_000;

/// The matrices that a batch writes to, and how many numbers each has.
struct Sink<'a> {
    data: &'a mut [f64],
    size: usize,
}

/// Does the arithmetic, with all inputs in their slots, by machine code where there is some, which works on single
/// numbers. `is_above` returns whether any of the numbers is above 0.
#[inline(always)]
fn execute<V: Scalar>(program: &Program, code: Option<&Code>, slots: &mut [V], is_above: impl Fn(V) -> bool) {
    assert!(program.slots <= slots.len() && (code.is_none() || size_of::<V>() == size_of::<f64>()));
    for (number, part) in program.parts.iter().enumerate() {
        for &(to, from) in part.again.iter().flat_map(|again| &again.start) {
            slots[to] = slots[from];
        }
        let mut runs = 0;
        loop {
            match code {
                // SAFETY: the program's, with slots for all that it uses.
                Some(code) => unsafe { code.run(number, slots.as_mut_ptr().cast()) },
                None => execute_part(part, slots),
            }
            let Some(Again { start, next, most }) = &part.again else { break };
            for &(to, from) in next {
                slots[to] = slots[from];
            }
            runs += 1;
            let goes_on = start.first().is_some_and(|&(running, _)| is_above(slots[running]));
            if runs == *most || !goes_on {
                break;
            }
        }
    }
}

/// The numbers of a row, read two at a time: loads limit how fast instructions run.
#[inline(always)]
fn places<const N: usize>(row: &[u32; N]) -> [usize; N] {
    let mut out = [0; N];
    let (pairs, odd) = row.as_chunks::<2>();
    for (i, pair) in pairs.iter().enumerate() {
        // SAFETY: two numbers are 8 bytes.
        let both = u64::from_le(unsafe { pair.as_ptr().cast::<u64>().read_unaligned() });
        out[2 * i] = u32::from_le(both as u32) as usize;
        out[2 * i + 1] = u32::from_le((both >> 32) as u32) as usize;
    }
    if let [last] = odd {
        out[N - 1] = *last as usize;
    }
    out
}

/// The same for one part of a program, with enough slots.
#[inline(always)]
fn execute_part<V: Scalar>(part: &Part, slots: &mut [V]) {
    let base = slots.as_mut_ptr();
    // Macros, not closures: a closure does not inherit the instructions of run-time dispatch.
    macro_rules! slot {
        ($place:expr) => {
            // SAFETY: `compile` gives places `SCALE slot` with `slot` below `program.slots`, at most the length of
            // `slots`.
            *unsafe { &mut *base.byte_add($place as usize * (size_of::<V>() / SCALE)) }
        };
    }
    let mut rest = part.instructions.as_slice();
    // The next instructions: of each, `to` and the operands.
    macro_rules! each {
        ($count:expr, [$($operand:ident),*] $value:expr) => {{
            const PLACES: usize = 1 + [$(stringify!($operand)),*].len();
            let (now, later): (&[u32], _) = rest.split_at($count as usize * PLACES);
            rest = later;
            let (fours, odd) = now.as_chunks::<PLACES>().0.as_chunks::<4>();
            for four in fours {
                for row in four {
                    let [to, $($operand),*] = places(row);
                    slot!(to) = $value;
                }
            }
            // Fewer than four: two branches instead of a loop whose end is rarely predicted.
            let (two, one) = odd.as_chunks::<2>();
            if let [two] = two {
                for row in two {
                    let [to, $($operand),*] = places(row);
                    slot!(to) = $value;
                }
            }
            if let [row] = one {
                let [to, $($operand),*] = places(row);
                slot!(to) = $value;
            }
        }};
    }
    macro_rules! some {
        ($count:expr, $operands:tt $value:expr) => {
            if $count > 0 {
                each!($count, $operands $value);
            }
        };
    }
    for &Round { arithmetic, other } in &part.rounds {
        let [add, sub, mul, mul2, mul3, mul_add, mul_add2, mul_add3] = arithmetic;
        some!(add, [a, b] slot!(a) + slot!(b));
        some!(sub, [a, b] slot!(b) - slot!(a));
        some!(mul, [a, b] slot!(a) * slot!(b));
        some!(mul2, [a, b, d, e] slot!(d).mul_add(slot!(e), slot!(a) * slot!(b)));
        some!(mul3, [a, b, d, e, f, g] slot!(f).mul_add(slot!(g), slot!(d).mul_add(slot!(e), slot!(a) * slot!(b))));
        some!(mul_add, [a, b, c] slot!(a).mul_add(slot!(b), slot!(c)));
        some!(mul_add2, [a, b, c, d, e] slot!(d).mul_add(slot!(e), slot!(a).mul_add(slot!(b), slot!(c))));
        some!(mul_add3, [a, b, c, d, e, f, g] {
            let sum = slot!(d).mul_add(slot!(e), slot!(a).mul_add(slot!(b), slot!(c)));
            slot!(f).mul_add(slot!(g), sum)
        });
        let Some((kind, count)) = other else { continue };
        match kind {
            Kind::Add
            | Kind::Sub
            | Kind::Mul
            | Kind::Mul2
            | Kind::Mul3
            | Kind::MulAdd
            | Kind::MulAdd2
            | Kind::MulAdd3 => {}
            Kind::Recip => each!(count, [a, _b, _c] slot!(a).recip()),
            Kind::Sqrt => each!(count, [a, _b, _c] slot!(a).sqrt()),
            Kind::Atan2 => each!(count, [a, b, _c] slot!(a).atan2(slot!(b))),
            Kind::Exp => each!(count, [a, _b, _c] slot!(a).exp()),
            Kind::Ln => each!(count, [a, _b, _c] slot!(a).ln()),
            Kind::Tanh => each!(count, [a, _b, _c] slot!(a).tanh()),
            Kind::ExpM1 => each!(count, [a, _b, _c] slot!(a).exp_m1()),
            Kind::Ln1p => each!(count, [a, _b, _c] slot!(a).ln_1p()),
            Kind::Cos => each!(count, [a, _b, _c] slot!(a).sin_cos().1),
            Kind::Select => each!(count, [a, b, c] slot!(a).select(slot!(b), slot!(c))),
            Kind::SinCos => {
                let (now, later): (&[u32], _) = rest.split_at(count as usize * kind.places());
                rest = later;
                for &[to, a, _, second] in now.as_chunks::<4>().0 {
                    let (sin, cos) = slot!(a).sin_cos();
                    slot!(second) = cos;
                    slot!(to) = sin;
                }
            }
        }
    }
}

/// Sets the inputs that are the same at every knot.
#[inline(always)]
fn fix<V: Scalar>(program: &Program, parameters: &[f64], slots: &mut [V]) {
    let (constants, others) = slots.split_at_mut(program.constants.len());
    for (slot, &value) in constants.iter_mut().zip(&program.constants) {
        *slot = V::constant(value);
    }
    for (slot, &parameter) in others.iter_mut().zip(&program.given) {
        *slot = V::constant(parameters[parameter]);
    }
}

struct Run<'a> {
    program: &'a Program,
    batch: Batch,
    sources: &'a [Source<'a>],
    parameters: &'a [f64],
    sink: Sink<'a>,
    sums: &'a mut [f64],
    scratch: &'a mut Scratch,
}

impl Job for Run<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { program, batch, sources, parameters, mut sink, sums, scratch } = self;
        // Two sets of lanes at once while there are knots for both.
        let whole = batch.count - batch.count % (2 * LANES);
        if whole > 0 {
            // SAFETY: lanes hold plain numbers; every slot is written before it is read.
            let slots = unsafe { scratch.leftovers::<Pair<L>>(program.slots) };
            fix(program, parameters, slots);
            for start in (0..whole).step_by(2 * LANES) {
                let first = batch.first + start;
                let inputs = &mut slots[program.fixed()..];
                for (slot, &(source, offset)) in inputs.iter_mut().zip(&program.varying) {
                    let source = &sources[source];
                    *slot = Pair(gather(source, first, LANES, offset), gather(source, first + LANES, LANES, offset));
                }
                execute(program, None, slots, |Pair(one, two)| is_above(one) || is_above(two));
                for &(slot, target) in &program.outputs {
                    let Pair(one, two) = slots[slot];
                    scatter(target, one, (start, LANES), &mut sink, sums);
                    scatter(target, two, (start + LANES, LANES), &mut sink, sums);
                }
            }
        }
        // SAFETY: as above.
        let slots = unsafe { scratch.leftovers::<L>(program.slots) };
        fix(program, parameters, slots);
        for start in (whole..batch.count).step_by(LANES) {
            let (first, count) = (batch.first + start, LANES.min(batch.count - start));
            let inputs = &mut slots[program.fixed()..];
            for (slot, &(source, offset)) in inputs.iter_mut().zip(&program.varying) {
                *slot = gather(&sources[source], first, count, offset);
            }
            execute(program, None, slots, is_above);
            for &(slot, target) in &program.outputs {
                scatter(target, slots[slot], (start, count), &mut sink, sums);
            }
        }
    }
}

/// Whether any of the numbers is above 0.
#[inline(always)]
fn is_above<L: Lanes>(values: L) -> bool {
    values.to_array().iter().any(|&value| value > 0.0)
}

/// Writes a result of the `count` knots from `start` of the batch on to its target.
#[inline(always)]
fn scatter<L: Lanes>(target: Target, values: L, (start, count): (usize, usize), sink: &mut Sink, sums: &mut [f64]) {
    let values = values.to_array();
    match target {
        Target::Set { offset, .. } => {
            let data = &mut sink.data[start * sink.size + offset..];
            for lane in 0..count {
                data[lane * sink.size] = values[lane];
            }
        }
        Target::Add { offset, .. } => {
            let data = &mut sink.data[start * sink.size + offset..];
            for lane in 0..count {
                data[lane * sink.size] += values[lane];
            }
        }
        Target::Sum { index } => {
            for value in &values[..count] {
                sums[index] += value;
            }
        }
    }
}

/// Entry `offset` of the matrices of all knots of a block in the lanes, with missing ones repeating the last.
#[inline(always)]
fn gather<L: Lanes>(source: &Source, first: usize, count: usize, offset: usize) -> L {
    let size = source.matrices.rows() * source.matrices.stride();
    let data = &source.matrices.as_slice()[(first + source.shift) * size + offset..];
    let mut values = [0.0; LANES];
    for (lane, value) in values.iter_mut().enumerate() {
        *value = data[lane.min(count - 1) * size];
    }
    L::from_array(values)
}

struct AtKnot<'a, 'b> {
    program: &'a Program,
    code: Option<&'a Code>,
    /// With the inputs that are the same at every knot.
    slots: &'a mut [f64],
    sources: &'a [&'a [f64]],
    sinks: &'a mut [&'b mut [f64]],
}

thread_local! {
    /// Slots of single runs, and of threads that share a batch.
    static SINGLE: RefCell<Scratch> = RefCell::default();
}

impl Job for AtKnot<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { program, code, slots, sources, sinks } = self;
        let slots = L::Single::slice_of(slots);
        let inputs = &mut slots[program.fixed()..];
        for (slot, &(source, offset)) in inputs.iter_mut().zip(&program.varying) {
            *slot = L::Single::constant(sources[source][offset]);
        }
        execute(program, code, slots, |number| number.into() > 0.0);
        for &(slot, target) in &program.outputs {
            let value: f64 = slots[slot].into();
            match target {
                Target::Set { sink, offset } => sinks[sink][offset] = value,
                Target::Add { sink, offset } => sinks[sink][offset] += value,
                Target::Sum { index } => sinks[0][index] += value,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::{Node, record};

    /// Threads are used if there are more knots than the lanes process at once, and two million operations.
    #[test]
    fn only_long_work_is_shared() {
        let program = record(|| {
            let (x, y) = (Node::entry(0, 0), Node::entry(0, 1));
            let chain = (0..1000).fold(x, |sum, _| sum * y + x);
            Program::compile(&[(chain, Target::Set { sink: 0, offset: 0 })])
        });
        assert_eq!(program.len(), 1000);
        let is_shared = |count| program.is_shared(Batch { first: 5, count });
        assert_eq!([1, 16, 1999, 2000, 2001, 5000].map(is_shared), [false, false, false, true, true, true]);
        let long = record(|| {
            let (x, y) = (Node::entry(0, 0), Node::entry(0, 1));
            let chain = (0..130_000).fold(x, |sum, _| sum * y + x);
            Program::compile(&[(chain, Target::Set { sink: 0, offset: 0 })])
        });
        let is_shared = |count| long.is_shared(Batch { first: 0, count });
        assert_eq!([1, 2 * LANES, 2 * LANES + 1].map(is_shared), [false, false, true]);
    }
}
