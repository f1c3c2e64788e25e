use super::node::{Node, Op, Table, operations};
use super::schedule::{Kind, Step, Units, chain, fuse, results, schedule, without_negatives};
use crate::Scalar;

/// Where a result of a program goes.
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

/// A number that is the same at every knot.
#[derive(Clone, Copy, Debug)]
pub(super) enum Fixed {
    Constant(f64),
    Parameter(usize),
}

/// Instructions name slots by this many times their number, so that no multiplication is needed to find them.
pub(super) const SCALE: usize = 8;

/// A straight sequence of arithmetic, compiled from a graph: no branches, no memory but numbered slots.
///
/// Slots hold constants and parameters first, then what is read at each knot, then results on the way.
#[derive(Clone, Debug, Default)]
pub struct Program {
    /// Inputs that are the same at every knot, each in the slot of its place.
    pub(super) fixed: Vec<Fixed>,
    /// Inputs at each knot, in the slots after those: source and place in its matrix.
    pub(super) varying: Vec<(usize, usize)>,
    /// The slots that instructions name, one after the other: of the result and of the operands, as many as the kind has.
    pub(super) instructions: Vec<u32>,
    /// How many instructions of each kind follow one another.
    pub(super) runs: Vec<(Kind, usize)>,
    pub(super) outputs: Vec<(usize, Target)>,
    pub(super) slots: usize,
    /// How many sources and parameters there must be.
    pub(super) sources: usize,
    pub(super) parameters: usize,
}

impl Program {
    /// The program that computes these nodes, and nothing else, of the graph being recorded.
    #[must_use]
    pub fn compile(outputs: &[(Node, Target)]) -> Self {
        let nodes = outputs.iter().map(|&(node, _)| node);
        let ends = operations(|ops| results(ops, nodes));
        let units = Units { zero: Node::zero(), one: Node::one(), minus_one: -Node::one() };
        let steps = operations(|ops| fuse(ops, &ends, units));
        let steps = schedule(chain(without_negatives(steps, units), &ends));
        let mut slots = Slots::new(&steps, &ends);
        let mut instructions = Vec::with_capacity(4 * steps.len());
        for (place, step) in steps.iter().enumerate() {
            slots.instruction(place, step, &mut instructions);
        }
        let mut runs: Vec<(Kind, usize)> = Vec::new();
        for step in &steps {
            match runs.last_mut() {
                Some((kind, count)) if *kind == step.kind => *count += 1,
                _ => runs.push((step.kind, 1)),
            }
        }
        let outputs = ends.iter().zip(outputs).map(|(&node, &(_, target))| (slots.of(node), target)).collect();
        let Slots { fixed, varying, next, .. } = slots;
        let sources = varying.iter().map(|&(source, _)| source + 1).max().unwrap_or(0);
        let parameters = fixed.iter().map(|input| if let Fixed::Parameter(i) = input { i + 1 } else { 0 });
        let parameters = parameters.max().unwrap_or(0);
        Self { fixed, varying, instructions, runs, outputs, slots: next, sources, parameters }
    }

    /// How many operations one knot takes.
    pub fn len(&self) -> usize {
        self.runs.iter().map(|(kind, count)| kind.operations() * count).sum()
    }

    /// Whether nothing is computed.
    pub fn is_empty(&self) -> bool {
        self.outputs.is_empty()
    }
}

/// Which slot holds which node, and until when.
struct Slots {
    fixed: Vec<Fixed>,
    varying: Vec<(usize, usize)>,
    place: Table<usize>,
    /// Place of the last instruction that reads a node.
    last: Table<usize>,
    free: Vec<usize>,
    next: usize,
}

impl Slots {
    fn new(steps: &[Step], ends: &[Node]) -> Self {
        let mut last = Table::new();
        for (place, step) in steps.iter().enumerate() {
            for node in step.reads() {
                last.insert(node, place);
            }
        }
        for &end in ends {
            last.insert(end, usize::MAX);
        }
        let mut slots =
            Self { fixed: Vec::new(), varying: Vec::new(), place: Table::new(), last, free: Vec::new(), next: 0 };
        let inputs: Vec<Node> = slots.last.nodes().collect();
        let ops: Vec<(Node, Op)> = operations(|ops| inputs.into_iter().map(|node| (node, ops[node.index()])).collect());
        for &(node, op) in &ops {
            let input = match op {
                Op::Constant(bits) => Fixed::Constant(f64::from_bits(bits)),
                Op::Parameter(index) => Fixed::Parameter(index as usize),
                _ => continue,
            };
            slots.place.insert(node, slots.fixed.len());
            slots.fixed.push(input);
        }
        for &(node, op) in &ops {
            if let Op::Entry { source, offset } = op {
                slots.place.insert(node, slots.fixed.len() + slots.varying.len());
                slots.varying.push((source as usize, offset as usize));
            }
        }
        slots.next = slots.fixed.len() + slots.varying.len();
        slots
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

    fn instruction(&mut self, place: usize, step: &Step, out: &mut Vec<u32>) {
        let mut operands = step.operands.map(|node| node.map_or(0, |node| self.of(node) as u32));
        let inputs = self.fixed.len() + self.varying.len();
        for node in step.reads() {
            let slot = self.of(node);
            if self.last.get(node) == Some(place) && slot >= inputs {
                self.last.remove(node);
                self.free.push(slot);
            }
        }
        let to = self.take(step.to);
        // In the place of the third operand, which it has not.
        if step.kind == Kind::SinCos {
            operands[2] = step.second.map_or(to, |second| self.take(second));
        }
        let named = [to].into_iter().chain(operands).take(step.kind.places());
        out.extend(named.map(|slot| slot * SCALE as u32));
    }
}
