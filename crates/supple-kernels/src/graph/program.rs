use std::collections::{BTreeSet, HashSet};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, OnceLock};

use super::instructions::{Again, Part, SCALE, rounds};
use super::native::Code;
use super::node::{Node, Op, Repetition, Table, operations, repetitions};
use super::repetition::{Stage, stages};
use super::schedule::{Kind, Step, Units, behind, chain, fuse, plain, results, schedule, without_negatives};
use crate::{Level, Scalar};

/// Where a result of a program goes.
///
/// Example: the [front page](crate).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Entry `offset` of the matrix of sink number `sink` becomes the result.
    Set {
        /// Number of the sink.
        sink: usize,
        /// Place in its matrix.
        offset: usize,
    },
    /// The result is added to entry `offset` of the matrix of sink number `sink`.
    Add {
        /// Number of the sink.
        sink: usize,
        /// Place in its matrix.
        offset: usize,
    },
    /// The results of all knots are added to sum number `index`.
    Sum {
        /// Number of the sum.
        index: usize,
    },
}

/// A straight-line sequence of arithmetic, compiled from a graph, parts of which may repeat: no branches, and no memory
/// except numbered slots.
///
/// Slots hold constants and parameters first, then what is read at each knot, then intermediate results.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// Constants, in the first slots.
    pub(super) constants: Vec<f64>,
    /// Which parameters the slots after those hold.
    pub(super) given: Vec<usize>,
    /// Inputs at each knot, in the slots after those: source and place in its matrix.
    pub(super) varying: Vec<(usize, usize)>,
    pub(super) parts: Vec<Part>,
    operations: usize,
    pub(super) outputs: Vec<(usize, Target)>,
    pub(super) slots: usize,
    /// How many sources and parameters there must be.
    pub(super) sources: usize,
    pub(super) parameters: usize,
    pub(super) native: Arc<Native>,
}

/// Machine code of a program that is run at single knots repeatedly.
#[derive(Debug, Default)]
pub(super) struct Native {
    runs: AtomicU32,
    code: OnceLock<Option<Code>>,
}

#[cfg(test)]
impl Native {
    pub(super) fn is_made(&self) -> bool {
        self.code.get().is_some_and(Option::is_some)
    }
}

/// Machine code is worth making from this run on.
const WORTH_IT: u32 = 3;

impl Program {
    /// The program that computes these nodes, and nothing else, from the graph being recorded.
    #[must_use]
    pub fn compile(outputs: &[(Node, Target)]) -> Self {
        let nodes = outputs.iter().map(|&(node, _)| node);
        let ends = operations(|ops| results(ops, nodes));
        let units = Units { zero: Node::zero(), one: Node::one(), minus_one: -Node::one() };
        let repetitions = repetitions();
        let mut ops = operations(<[Op]>::to_vec);
        let mut runs = Vec::new();
        for Stage { ends, repetition } in stages(&ops, &repetitions, &ends) {
            let steps = fuse(&ops, &ends, units);
            let steps = schedule(plain(chain(without_negatives(steps, units), &ends), units));
            // Later stages read these nodes and do not recompute them.
            ends.iter().for_each(|end| ops[end.index()] = Op::Variable(0));
            let repetition = repetition.map(|number| Repeated::new(&ops, &repetitions, number));
            runs.push(Run { steps, repetition });
        }
        let mut slots = Slots::new(&runs, &ends);
        let mut place = 0;
        let parts: Vec<Part> = runs.iter().map(|run| slots.part(run, &mut place)).collect();
        let operations = runs.iter().flat_map(|run| &run.steps).map(|step| step.kind.operations()).sum();
        let outputs = ends.iter().zip(outputs).map(|(&node, &(_, target))| (slots.of(node), target)).collect();
        let Slots { constants, given, varying, next, .. } = slots;
        let sources = varying.iter().map(|&(source, _)| source + 1).max().unwrap_or(0);
        let parameters = given.iter().map(|parameter| parameter + 1).max().unwrap_or(0);
        let native = Arc::default();
        Self { constants, given, varying, parts, operations, outputs, slots: next, sources, parameters, native }
    }

    /// How many inputs are the same at every knot: constants and parameters.
    pub(super) fn fixed(&self) -> usize {
        self.constants.len() + self.given.len()
    }

    /// Its machine code, if the instructions in use allow it and it is worth it; prepares one run at single knots.
    pub(super) fn code(&self) -> Option<&Code> {
        let Native { runs, code } = &*self.native;
        let is_worth_it =
            || runs.load(Ordering::Relaxed) >= WORTH_IT || runs.fetch_add(1, Ordering::Relaxed) >= WORTH_IT;
        if Level::current() == Level::Baseline || !is_worth_it() {
            return None;
        }
        let results = self.outputs.iter().map(|&(slot, _)| slot);
        code.get_or_init(|| Code::new(&self.parts, results, self.slots)).as_ref()
    }

    /// How many operations one knot takes, counting repeated ones once.
    #[must_use]
    pub fn len(&self) -> usize {
        self.operations
    }

    /// Whether nothing is computed.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.outputs.is_empty()
    }
}

/// Instructions of a stage.
struct Run {
    steps: Vec<Step>,
    repetition: Option<Repeated>,
}

/// A repetition with the nodes that are its results.
struct Repeated {
    repetition: Repetition,
    /// The result of each variable, if anything reads it.
    results: Vec<Option<Node>>,
}

impl Repeated {
    /// Opaque nodes are replaced by the nodes behind them.
    fn new(ops: &[Op], repetitions: &[Repetition], number: usize) -> Self {
        let mut repetition = repetitions[number].clone();
        repetition.start.iter_mut().chain(&mut repetition.next).for_each(|node| *node = behind(ops, *node));
        let mut results = vec![None; repetition.variables.len()];
        for (i, op) in ops.iter().enumerate() {
            if let Op::Repeated { repetition, index } = *op
                && repetition as usize == number
            {
                results[index as usize] = Some(Node(i as u32));
            }
        }
        Self { repetition, results }
    }
}

impl Run {
    /// How many places it takes: one per instruction, and for a repetition also one for its beginning and one for its end.
    fn places(&self) -> usize {
        self.steps.len() + 2 * usize::from(self.repetition.is_some())
    }

    /// What its instructions read but do not compute; for a repetition, which needs it from beginning to end, also its
    /// variables.
    fn reads_from_outside(&self) -> BTreeSet<Node> {
        let made: HashSet<Node> = self.steps.iter().flat_map(|step| [Some(step.to), step.second]).flatten().collect();
        let variables = self.repetition.iter().flat_map(|repeated| repeated.repetition.variables.iter().copied());
        self.steps.iter().flat_map(Step::reads).filter(|node| !made.contains(node)).chain(variables).collect()
    }
}

/// Which slot holds which node, and how long.
struct Slots {
    constants: Vec<f64>,
    given: Vec<usize>,
    varying: Vec<(usize, usize)>,
    place: Table<usize>,
    /// Place of the last instruction that reads a node.
    last: Table<usize>,
    free: Vec<usize>,
    next: usize,
    /// The number of slots that hold inputs, which are never freed.
    inputs: usize,
}

impl Slots {
    fn new(runs: &[Run], ends: &[Node]) -> Self {
        let (mut last, mut first) = (Table::new(), 0);
        for run in runs {
            let next = first + run.places();
            // Of a run without instructions, nothing is read.
            let end = next.saturating_sub(1);
            if let Some(Repeated { repetition, .. }) = &run.repetition {
                repetition.start.iter().for_each(|&node| last.insert(node, first));
            }
            let steps = first + usize::from(run.repetition.is_some());
            for (place, step) in (steps..).zip(&run.steps) {
                for node in step.reads() {
                    last.insert(node, place);
                }
            }
            if let Some(Repeated { repetition, .. }) = &run.repetition {
                run.reads_from_outside().into_iter().for_each(|node| last.insert(node, end));
                repetition.next.iter().for_each(|&node| last.insert(node, end));
            }
            first = next;
        }
        for &end in ends {
            last.insert(end, usize::MAX);
        }
        let inputs: Vec<Node> = last.nodes().collect();
        let ops: Vec<(Node, Op)> = operations(|ops| inputs.into_iter().map(|node| (node, ops[node.index()])).collect());
        let (mut place, mut count) = (Table::new(), 0);
        let mut held = |node| {
            place.insert(node, count);
            count += 1;
        };
        let (mut constants, mut given, mut varying) = (Vec::new(), Vec::new(), Vec::new());
        for &(node, op) in &ops {
            if let Op::Constant(bits) = op {
                held(node);
                constants.push(f64::from_bits(bits));
            }
        }
        for &(node, op) in &ops {
            if let Op::Parameter(index) = op {
                held(node);
                given.push(index as usize);
            }
        }
        for &(node, op) in &ops {
            if let Op::Entry { source, offset } = op {
                held(node);
                varying.push((source as usize, offset as usize));
            }
        }
        Self { constants, given, varying, place, last, free: Vec::new(), next: count, inputs: count }
    }

    fn of(&self, node: Node) -> usize {
        self.place.get(node).unwrap_or(0)
    }

    fn take(&mut self, node: Node) -> u32 {
        let slot = self.free.pop().unwrap_or_else(|| {
            self.next += 1;
            self.next - 1
        });
        self.place.insert(node, slot);
        slot as u32
    }

    /// The instructions of a run that begins at `place`.
    fn part(&mut self, run: &Run, place: &mut usize) -> Part {
        let mut part = Part { rounds: rounds(&run.steps), ..Part::default() };
        part.instructions.reserve(4 * run.steps.len());
        if let Some(Repeated { repetition, .. }) = &run.repetition {
            let start: Vec<_> = repetition.start.iter().map(|&node| self.of(node)).collect();
            // Before the slots of the initial values are freed: several variables may share one initial value.
            let variables = repetition.variables.iter().map(|&node| self.take(node) as usize);
            let start = variables.zip(start).collect();
            part.again = Some(Again { start, next: Vec::new(), most: repetition.most });
            repetition.start.iter().for_each(|&node| self.let_go(node, *place));
            *place += 1;
        }
        for step in &run.steps {
            self.instruction(*place, step, &mut part.instructions);
            *place += 1;
        }
        if let (Some(Repeated { repetition, results, .. }), Some(again)) = (&run.repetition, &mut part.again) {
            let variables = || repetition.variables.iter().copied();
            let changes = variables().zip(&repetition.next).map(|(to, &from)| (self.of(to), self.of(from)));
            again.next = changes.filter(|(to, from)| to != from).collect();
            for (variable, result) in variables().zip(results) {
                if let Some(result) = result.filter(|&result| self.last.get(result).is_some()) {
                    self.place.insert(result, self.of(variable));
                    self.last.remove(variable);
                }
            }
            let ended: Vec<Node> =
                run.reads_from_outside().into_iter().chain(repetition.next.iter().copied()).collect();
            ended.into_iter().for_each(|node| self.let_go(node, *place));
            *place += 1;
        }
        part
    }

    /// Frees the slot of a node that nothing reads after this place.
    fn let_go(&mut self, node: Node, place: usize) {
        let slot = self.of(node);
        if self.last.get(node) == Some(place) && slot >= self.inputs {
            self.last.remove(node);
            self.free.push(slot);
        }
    }

    fn instruction(&mut self, place: usize, step: &Step, out: &mut Vec<u32>) {
        let mut operands = step.operands.map(|node| node.map_or(0, |node| self.of(node) as u32));
        step.reads().for_each(|node| self.let_go(node, place));
        let to = self.take(step.to);
        // Stored in place of the third operand, which this kind does not have.
        if step.kind == Kind::SinCos {
            operands[2] = step.second.map_or(to, |second| self.take(second));
        }
        let named = [to].into_iter().chain(operands).take(step.kind.places());
        out.extend(named.map(|slot| slot * SCALE as u32));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::record;

    /// The kinds of the instructions of a program, in the order in which they run.
    fn kinds(build: impl FnOnce([Node; 8]) -> Node) -> Vec<Kind> {
        let program = record(|| {
            let node = build(std::array::from_fn(|i| Node::entry(0, i)));
            Program::compile(&[(node, Target::Set { sink: 0, offset: 0 })])
        });
        let several = |(kind, count)| (0..count).map(move |_| kind);
        let kinds: Vec<Kind> = program.parts.iter().flat_map(Part::kinds).flat_map(several).collect();
        assert_eq!(program.len(), kinds.iter().map(|kind| kind.operations()).sum::<usize>());
        assert_eq!(program.parts[0].instructions.len(), kinds.iter().map(|kind| kind.places()).sum::<usize>());
        kinds
    }

    #[test]
    fn instructions_read_no_more_than_they_need() {
        assert_eq!(kinds(|[a, b, ..]| a + b), [Kind::Add]);
        assert_eq!(kinds(|[a, b, ..]| a - b), [Kind::Sub]);
        assert_eq!(kinds(|[a, b, ..]| a * b), [Kind::Mul]);
        assert_eq!(kinds(|[a, ..]| -a), [Kind::Mul], "a product with -1");
        assert_eq!(kinds(|[a, b, c, ..]| a * b + c), [Kind::MulAdd]);
        assert_eq!(kinds(|[a, b, c, d, ..]| a * b + c * d), [Kind::Mul2]);
        assert_eq!(kinds(|[a, b, c, d, e, f, ..]| a * b + c * d + e * f), [Kind::Mul3]);
        assert_eq!(kinds(|[a, b, c, d, e, ..]| a + b * c + d * e), [Kind::MulAdd2]);
        assert_eq!(kinds(|[a, b, c, d, e, f, g, _]| a + b * c + d * e + f * g), [Kind::MulAdd3]);
        let four = kinds(|[a, b, c, d, e, f, g, h]| a * b + c * d + e * f + g * h);
        assert_eq!(four, [Kind::Mul3, Kind::MulAdd], "three products at most");
        assert_eq!(kinds(|[a, b, c, ..]| c - a * b), [Kind::Mul, Kind::MulAdd], "a factor is negated beforehand");
        assert_eq!(kinds(|[a, b, ..]| b - a * 2.0), [Kind::MulAdd], "constants are negated at no cost");
    }

    /// The common factor of several subtracted products is negated once.
    #[test]
    fn the_factor_that_most_want_is_negated() {
        let count = |kinds: Vec<Kind>| kinds.len();
        let three = |[a, b, c, d, e, f, _, _]: [Node; 8]| {
            let products = [(a, b), (c, b), (d, b)].map(|(x, y)| e - x * y);
            (products[0] * products[1]).sin() * products[2] * f
        };
        // One negative, three differences, three products, a sine.
        assert_eq!(count(kinds(three)), 1 + 3 + 3 + 1);
        let other = |[a, b, c, d, e, f, _, _]: [Node; 8]| {
            let products = [(b, c), (b, d), (a, b)].map(|(x, y)| e - x * y);
            (products[0] * products[1]).sin() * products[2] * f
        };
        assert_eq!(count(kinds(other)), 1 + 3 + 3 + 1);
    }

    #[test]
    fn slots_are_used_again() {
        let slots = |length: usize| {
            record(|| {
                let (x, y) = (Node::entry(0, 0), Node::entry(0, 1));
                let chain = (0..length).fold(x, |sum, _| (sum * y).sin());
                Program::compile(&[(chain, Target::Set { sink: 0, offset: 0 })]).slots
            })
        };
        assert_eq!(slots(100), slots(3));
    }

    /// How many sources and parameters must be given.
    #[test]
    fn what_must_be_given_is_counted() {
        let program = record(|| {
            let sum = Node::entry(3, 0) + Node::entry(1, 2) * Node::parameter(4);
            Program::compile(&[(sum, Target::Set { sink: 0, offset: 0 })])
        });
        assert_eq!((program.sources, program.parameters), (4, 5));
    }
}
