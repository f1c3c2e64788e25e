use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};

use super::node::{Map, Node, Op, Table};
use crate::Scalar;

/// The operation of an instruction. The first [`ARITHMETIC`] kinds make up nearly all instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Kind {
    /// `a + b`
    Add,
    /// `b - a`
    Sub,
    /// `a b`
    Mul,
    /// `d e + a b`
    Mul2,
    /// `f g + (d e + a b)`
    Mul3,
    /// `a b + c`
    MulAdd,
    /// `d e + (a b + c)`: the intermediate result is never stored.
    MulAdd2,
    /// `f g + (d e + (a b + c))`
    MulAdd3,
    Recip,
    Sqrt,
    /// Sine to the first result, cosine to the second where it is needed.
    SinCos,
    Cos,
    Atan2,
    Exp,
    Ln,
    Tanh,
    ExpM1,
    Ln1p,
    Select,
}

/// How many kinds there are.
const KINDS: usize = Kind::Select as usize + 1;

/// The kinds that a program runs in this order before it checks which other kind is next.
pub(super) const ARITHMETIC: [Kind; 8] =
    [Kind::Add, Kind::Sub, Kind::Mul, Kind::Mul2, Kind::Mul3, Kind::MulAdd, Kind::MulAdd2, Kind::MulAdd3];

impl Kind {
    /// Its position among the [`ARITHMETIC`] kinds; `None` for the others.
    pub fn arithmetic(self) -> Option<usize> {
        let place = self as usize;
        (place < ARITHMETIC.len()).then_some(place)
    }

    /// How many operations an instruction is.
    pub fn operations(self) -> usize {
        match self {
            Self::Mul2 | Self::MulAdd2 => 2,
            Self::Mul3 | Self::MulAdd3 => 3,
            _ => 1,
        }
    }

    /// How many slots an instruction refers to: its result, and its operands or second result.
    pub fn places(self) -> usize {
        let without_term = matches!(self, Self::Add | Self::Sub | Self::Mul | Self::Mul2 | Self::Mul3);
        2 + 2 * self.operations() - usize::from(without_term)
    }

    /// Cycles that an instruction keeps the processor busy: roughly.
    fn issue(self) -> usize {
        1 + self.operations()
    }

    /// Cycles until its result can be read, through memory, roughly.
    fn latency(self) -> usize {
        match self {
            Self::Recip | Self::Sqrt => 24,
            Self::SinCos | Self::Cos | Self::Atan2 | Self::Exp | Self::Ln | Self::Tanh | Self::ExpM1 | Self::Ln1p => 80,
            _ => 8 + 4 * self.operations(),
        }
    }

    /// The kind with one more product, if there is one.
    fn with_product(self) -> Option<Self> {
        match self {
            Self::MulAdd => Some(Self::MulAdd2),
            Self::MulAdd2 => Some(Self::MulAdd3),
            _ => None,
        }
    }
}

/// Operands that an instruction has at most.
const OPERANDS: usize = 7;

/// An instruction on nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub kind: Kind,
    pub to: Node,
    /// The second result, of those that have one.
    pub second: Option<Node>,
    pub operands: [Option<Node>; OPERANDS],
    /// Whether the product is subtracted; resolved by [`without_negatives`].
    pub negative: bool,
}

impl Step {
    /// The nodes that it reads.
    pub fn reads(&self) -> impl Iterator<Item = Node> {
        self.operands.into_iter().flatten()
    }
}

fn padded<const N: usize>(given: [Option<Node>; N]) -> [Option<Node>; OPERANDS] {
    let mut operands = [None; OPERANDS];
    operands[..N].copy_from_slice(&given);
    operands
}

/// The node behind opaque nodes.
pub(super) fn behind(ops: &[Op], mut node: Node) -> Node {
    while let Op::Opaque(a, _) = ops[node.index()] {
        node = a;
    }
    node
}

/// The nodes that results are read from: what stands behind each of `ends`.
pub(super) fn results(ops: &[Op], ends: impl Iterator<Item = Node>) -> Vec<Node> {
    ends.map(|end| behind(ops, end)).collect()
}

/// How often each node is read; 0 for nodes that `ends` do not need.
fn count_uses(ops: &[Op], ends: &[Node]) -> Vec<u32> {
    let len = ends.iter().map(|node| node.index() + 1).max().unwrap_or(0);
    let mut uses = vec![0; len];
    for end in ends {
        uses[end.index()] += 1;
    }
    for i in (0..len).rev() {
        if uses[i] > 0 {
            for operand in ops[i].operands() {
                uses[behind(ops, operand).index()] += 1;
            }
        }
    }
    uses
}

/// The instructions that the nodes `ends` need, in recording order; a product whose only use is in an addition
/// is fused with it.
pub(super) fn fuse(ops: &[Op], ends: &[Node], units: Units) -> Vec<Step> {
    let uses = count_uses(ops, ends);
    let mut fused = vec![false; uses.len()];
    let mut steps = Vec::new();
    for i in (0..uses.len()).filter(|&i| uses[i] > 0) {
        if let Op::Add(a, b) | Op::Sub(a, b) = ops[i] {
            let terms = [b, a].map(|node| behind(ops, node));
            // In a difference only the subtrahend can be a fused product.
            let terms = if matches!(ops[i], Op::Add(..)) { &terms[..] } else { &terms[..1] };
            let lone = |node: &&Node| matches!(ops[node.index()], Op::Mul(..)) && uses[node.index()] == 1;
            if let Some(product) = terms.iter().find(lone) {
                fused[product.index()] = true;
            }
        }
    }
    let mut turned = HashSet::new();
    for i in (0..uses.len()).filter(|&i| uses[i] > 0 && !fused[i]) {
        let node = Node(i as u32);
        if let Op::Sin(a) | Op::Cos(a) = ops[i]
            && !turned.insert(a)
        {
            continue;
        }
        steps.extend(step(ops, node, &fused, units));
    }
    pair_sines(&mut steps, ops, &uses);
    steps
}

/// The instruction of one node.
fn step(ops: &[Op], to: Node, fused: &[bool], units: Units) -> Option<Step> {
    let make = |kind, negative, operands: [Option<Node>; 3]| {
        Some(Step { kind, to, second: None, operands: padded(operands.map(|node| Some(behind(ops, node?)))), negative })
    };
    let one = |kind, a| make(kind, false, [Some(a), None, None]);
    let fuse = |negative, (a, b), c| make(Kind::MulAdd, negative, [Some(a), Some(b), Some(c)]);
    // The factors of a product that is part of this instruction.
    let product = |node: Node| match ops[behind(ops, node).index()] {
        Op::Mul(a, b) if fused[behind(ops, node).index()] => Some((a, b)),
        _ => None,
    };
    let Units { zero, one: unit, minus_one } = units;
    match ops[to.index()] {
        Op::Constant(_)
        | Op::Entry { .. }
        | Op::Parameter(_)
        | Op::Opaque(..)
        | Op::Variable(_)
        | Op::Repeated { .. } => None,
        Op::Add(a, b) => match (product(a), product(b)) {
            (_, Some(factors)) => fuse(false, factors, a),
            (Some(factors), _) => fuse(false, factors, b),
            _ => fuse(false, (a, unit), b),
        },
        Op::Sub(a, b) => match product(b) {
            Some(factors) => fuse(true, factors, a),
            None => fuse(false, (b, minus_one), a),
        },
        Op::Mul(a, b) => fuse(false, (a, b), zero),
        Op::Neg(a) => fuse(false, (a, minus_one), zero),
        Op::Recip(a) => one(Kind::Recip, a),
        Op::Sqrt(a) => one(Kind::Sqrt, a),
        Op::Sin(a) | Op::Cos(a) => one(Kind::SinCos, a),
        Op::Atan2(a, b) => make(Kind::Atan2, false, [Some(a), Some(b), None]),
        Op::Exp(a) => one(Kind::Exp, a),
        Op::Ln(a) => one(Kind::Ln, a),
        Op::Tanh(a) => one(Kind::Tanh, a),
        Op::ExpM1(a) => one(Kind::ExpM1, a),
        Op::Ln1p(a) => one(Kind::Ln1p, a),
        Op::Select(a, b, c) => make(Kind::Select, false, [Some(a), Some(b), Some(c)]),
    }
}

/// The nodes 0, 1 and -1.
#[derive(Clone, Copy)]
pub(super) struct Units {
    pub zero: Node,
    pub one: Node,
    pub minus_one: Node,
}

/// The same instructions without negative products: one factor of each is negated beforehand, and shared.
pub(super) fn without_negatives(steps: Vec<Step>, units: Units) -> Vec<Step> {
    let mut wanted: Table<usize> = Table::new();
    for step in steps.iter().filter(|step| step.negative) {
        for &node in step.operands[..2].iter().flatten() {
            wanted.insert(node, wanted.get(node).unwrap_or(0) + 1);
        }
    }
    let mut made = Table::new();
    for step in &steps {
        made.insert(step.to, ());
    }
    let mut negated: Table<Node> = Table::new();
    let mut out = Vec::with_capacity(steps.len());
    for mut step in steps {
        if let (true, [Some(a), Some(b), c, ..]) = (step.negative, step.operands) {
            // Negating a constant is free; otherwise prefer the factor that most other products need.
            let rank = |node: Node| (node.known().is_some(), negated.get(node).is_some(), wanted.get(node));
            let (factor, other) = if rank(b) > rank(a) { (b, a) } else { (a, b) };
            let negative = match factor.known() {
                Some(value) => Node::constant(-value),
                None => negated.get(factor).unwrap_or_else(|| {
                    let to = factor.negative();
                    // The graph may already contain this negative later on; it may then be computed twice.
                    let to = if made.get(to).is_some() { to.opaque() } else { to };
                    let operands = padded([Some(factor), Some(units.minus_one), Some(units.zero)]);
                    out.push(Step { kind: Kind::MulAdd, to, second: None, operands, negative: false });
                    negated.insert(factor, to);
                    to
                }),
            };
            step.operands = padded([Some(negative), Some(other), c]);
            step.negative = false;
        }
        out.push(step);
    }
    out
}

/// The same instructions, with sums of products whose partial sums have no other use merged into one instruction each, for
/// as many products as the kinds allow. The order of the arithmetic is unchanged.
pub(super) fn chain(steps: Vec<Step>, ends: &[Node]) -> Vec<Step> {
    let mut uses: Table<u32> = Table::new();
    for node in steps.iter().flat_map(Step::reads).chain(ends.iter().copied()) {
        uses.insert(node, uses.get(node).unwrap_or(0) + 1);
    }
    let mut out: Vec<Option<Step>> = Vec::with_capacity(steps.len());
    let mut made: Table<usize> = Table::new();
    for mut step in steps {
        if let (Kind::MulAdd, [a, b, Some(sum), ..]) = (step.kind, step.operands)
            && uses.get(sum) == Some(1)
            && let Some(place) = made.get(sum)
            && let Some(before) = out[place]
            && let Some(kind) = before.kind.with_product()
        {
            out[place] = None;
            let first = before.kind.places() - 1;
            step.kind = kind;
            step.operands = before.operands;
            step.operands[first..first + 2].copy_from_slice(&[a, b]);
        }
        made.insert(step.to, out.len());
        out.push(Some(step));
    }
    out.into_iter().flatten().collect()
}

/// The same instructions, reduced to kinds with fewer operands if equivalent: factors 1 and terms 0 are not read.
pub(super) fn plain(mut steps: Vec<Step>, Units { zero, one, minus_one }: Units) -> Vec<Step> {
    for step in &mut steps {
        let [a, b, c, ..] = step.operands;
        let (kind, operands) = match step.kind {
            Kind::MulAdd if b == Some(one) => (Kind::Add, padded([a, c])),
            Kind::MulAdd if b == Some(minus_one) && c != Some(zero) => (Kind::Sub, padded([a, c])),
            Kind::MulAdd | Kind::MulAdd2 | Kind::MulAdd3 if c == Some(zero) => {
                let kind = match step.kind {
                    Kind::MulAdd => Kind::Mul,
                    Kind::MulAdd2 => Kind::Mul2,
                    _ => Kind::Mul3,
                };
                let [_, _, _, d, e, f, g] = step.operands;
                (kind, padded([a, b, d, e, f, g]))
            }
            _ => continue,
        };
        (step.kind, step.operands) = (kind, operands);
    }
    steps
}

/// Merges sine and cosine of one angle into one instruction with two results. An opaque node counts as a separate angle:
/// its sine differs from that of the node behind it.
fn pair_sines(steps: &mut [Step], ops: &[Op], uses: &[u32]) {
    let used = ops[..uses.len()].iter().enumerate().filter(|&(i, _)| uses[i] > 0);
    let sines: Map<Node, Node> = used
        .clone()
        .filter_map(|(i, op)| if let Op::Sin(a) = op { Some((*a, Node(i as u32))) } else { None })
        .collect();
    let cosines: Map<Node, Node> =
        used.filter_map(|(i, op)| if let Op::Cos(a) = op { Some((*a, Node(i as u32))) } else { None }).collect();
    for step in steps.iter_mut().filter(|step| step.kind == Kind::SinCos) {
        let (Op::Sin(angle) | Op::Cos(angle)) = ops[step.to.index()] else { continue };
        match (sines.get(&angle), cosines.get(&angle)) {
            (Some(&sine), cosine) => (step.to, step.second) = (sine, cosine.copied()),
            (None, Some(&cosine)) => (step.kind, step.to) = (Kind::Cos, cosine),
            (None, None) => {}
        }
    }
}

/// The same instructions in an order in which a processor rarely stalls. Of the instructions ready at a time the most urgent
/// is first: the one with the longest path to the end. To keep loops over a kind long, and restarts of the sequence of
/// kinds rare, an instruction of the same kind as the last counts as more urgent by [`SAME_WORTH`], one of a later kind by
/// [`LATER_WORTH`].
pub(super) fn schedule(steps: Vec<Step>) -> Vec<Step> {
    let mut made = Table::new();
    for (i, step) in steps.iter().enumerate() {
        [Some(step.to), step.second].into_iter().flatten().for_each(|node| made.insert(node, i));
    }
    let readers = Readers::of(&steps, &made);
    let mut waits_for: Vec<usize> =
        steps.iter().map(|step| step.reads().filter(|&node| made.get(node).is_some()).count()).collect();
    // The time from the start of each to the end of all that depend on it. Operands come before their readers.
    let mut urgency = vec![0; steps.len()];
    for (i, step) in steps.iter().enumerate().rev() {
        let after = readers.of_step(i).iter().map(|&reader| urgency[reader]).max().unwrap_or(0);
        urgency[i] = step.kind.latency() + after;
    }
    let mut clock = Clock { now: 0, last: None, ready: Default::default(), occupied: 0, coming: BinaryHeap::new() };
    let mut possible_at = vec![0; steps.len()];
    for i in (0..steps.len()).filter(|&i| waits_for[i] == 0) {
        clock.coming.push(Reverse((0, i)));
    }
    let mut order = Vec::with_capacity(steps.len());
    while let Some(i) = clock.next(&steps, &urgency) {
        order.push(steps[i]);
        for &reader in readers.of_step(i) {
            possible_at[reader] = possible_at[reader].max(clock.now + steps[i].kind.latency());
            waits_for[reader] -= 1;
            if waits_for[reader] == 0 {
                clock.coming.push(Reverse((possible_at[reader], reader)));
            }
        }
    }
    order
}

/// Cycles: the fastest for robots' programs among several values tried.
const SAME_WORTH: usize = 100;
const LATER_WORTH: usize = 50;

/// Cycles that a change of kind costs.
const SWITCH: usize = 8;

/// Which instructions read the results of each.
struct Readers {
    all: Vec<usize>,
    /// Those of instruction i are `all[ends[i]..ends[i + 1]]`.
    ends: Vec<usize>,
}

impl Readers {
    fn of(steps: &[Step], made: &Table<usize>) -> Self {
        let mut ends = vec![0; steps.len() + 1];
        for maker in steps.iter().flat_map(Step::reads).filter_map(|node| made.get(node)) {
            ends[maker + 1] += 1;
        }
        for i in 0..steps.len() {
            ends[i + 1] += ends[i];
        }
        let (mut all, mut next) = (vec![0; ends[steps.len()]], ends.clone());
        for (i, step) in steps.iter().enumerate() {
            for maker in step.reads().filter_map(|node| made.get(node)) {
                all[next[maker]] = i;
                next[maker] += 1;
            }
        }
        Self { all, ends }
    }

    fn of_step(&self, i: usize) -> &[usize] {
        &self.all[self.ends[i]..self.ends[i + 1]]
    }
}

/// A processor that runs one instruction at a time, and the instructions it could run next.
struct Clock {
    now: usize,
    last: Option<Kind>,
    /// By kind, instructions whose operands are ready: the most urgent on top, then in recording order.
    ready: [BinaryHeap<(usize, Reverse<usize>)>; KINDS],
    /// A bit for every kind that has ready instructions.
    occupied: u32,
    /// Instructions whose operands become ready at a later time.
    coming: BinaryHeap<Reverse<(usize, usize)>>,
}

impl Clock {
    /// The instruction to run now; none once all have been.
    fn next(&mut self, steps: &[Step], urgency: &[usize]) -> Option<usize> {
        if self.occupied == 0 {
            let Reverse((time, _)) = *self.coming.peek()?;
            self.now = self.now.max(time);
        }
        while let Some(&Reverse((time, i))) = self.coming.peek()
            && time <= self.now
        {
            self.coming.pop();
            self.ready[steps[i].kind as usize].push((urgency[i], Reverse(i)));
            self.occupied |= 1 << steps[i].kind as usize;
        }
        let last = self.last;
        let worth = |kind: Kind, urgency: usize| match last {
            Some(last) if last == kind => urgency + SAME_WORTH,
            Some(last) if last < kind => urgency + LATER_WORTH,
            _ => urgency,
        };
        let mut best = None;
        let mut left = self.occupied;
        while let Some(bit) = left.checked_ilog2() {
            left &= !(1 << bit);
            if let Some(&(urgency, Reverse(i))) = self.ready[bit as usize].peek() {
                best = best.max(Some((worth(steps[i].kind, urgency), Reverse(i))));
            }
        }
        let (_, Reverse(i)) = best?;
        let kind = steps[i].kind;
        let heap = &mut self.ready[kind as usize];
        heap.pop();
        if heap.is_empty() {
            self.occupied &= !(1 << kind as usize);
        }
        if last != Some(kind) {
            self.now += SWITCH;
        }
        self.last = Some(kind);
        self.now += kind.issue();
        Some(i)
    }
}
