use std::cell::RefCell;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::Scalar;
use crate::scalar::{self, derive_operators};

/// A number not yet known: a node of the graph that this thread is recording.
///
/// Nodes are meaningful only inside the [`record`] that made them, on its thread.
///
/// Example: the [front page](crate).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Node(pub(super) u32);

/// What a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Op {
    /// The number with these bits.
    Constant(u64),
    /// Entry `offset` of the matrix of source number `source`, at the knot.
    Entry {
        source: u32,
        offset: u32,
    },
    /// A parameter: the same at every knot.
    Parameter(u32),
    Add(Node, Node),
    Sub(Node, Node),
    Mul(Node, Node),
    /// Angle of the point (second, first).
    Atan2(Node, Node),
    Neg(Node),
    Recip(Node),
    Sqrt(Node),
    Sin(Node),
    Cos(Node),
    Exp(Node),
    Ln(Node),
    Tanh(Node),
    ExpM1(Node),
    Ln1p(Node),
    /// The second where the first is above 0, else the third.
    Select(Node, Node, Node),
    /// The node itself, treated as unknown; the number makes it different from all other nodes.
    Opaque(Node, u32),
    /// A variable of a repetition: the result of its last run.
    Variable(u32),
    /// Entry `index` of the final values of repetition number `repetition`.
    Repeated {
        repetition: u32,
        index: u32,
    },
}

impl Op {
    /// The operands of the node; none for a repetition, because derivatives do not go through it.
    pub fn operands(self) -> impl Iterator<Item = Node> {
        let (list, len) = match self {
            Self::Constant(_) | Self::Entry { .. } | Self::Parameter(_) | Self::Variable(_) | Self::Repeated { .. } => {
                ([Node(0); 3], 0)
            }
            Self::Neg(a)
            | Self::Recip(a)
            | Self::Sqrt(a)
            | Self::Sin(a)
            | Self::Cos(a)
            | Self::Exp(a)
            | Self::Ln(a)
            | Self::Tanh(a)
            | Self::ExpM1(a)
            | Self::Ln1p(a) => ([a; 3], 1),
            Self::Opaque(a, _) => ([a; 3], 1),
            Self::Add(a, b) | Self::Sub(a, b) | Self::Mul(a, b) | Self::Atan2(a, b) => ([a, b, b], 2),
            Self::Select(a, b, c) => ([a, b, c], 3),
        };
        list.into_iter().take(len)
    }
}

impl Op {
    /// Whether no operation computes it: it is an input, or the result of a repetition.
    pub fn is_given(self) -> bool {
        matches!(
            self,
            Self::Constant(_) | Self::Entry { .. } | Self::Parameter(_) | Self::Variable(_) | Self::Repeated { .. }
        )
    }
}

/// A fast hash for small keys that no attacker controls.
#[derive(Default)]
pub(super) struct Mix(u64);

impl Hasher for Mix {
    fn finish(&self) -> u64 {
        self.0
    }
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }
    fn write_u32(&mut self, value: u32) {
        self.write_u64(u64::from(value));
    }
    fn write_u64(&mut self, value: u64) {
        self.0 = (self.0.rotate_left(5) ^ value).wrapping_mul(0x517c_c1b7_2722_0a95);
        self.0 ^= self.0 >> 32;
    }
    fn write_usize(&mut self, value: usize) {
        self.write_u64(value as u64);
    }
    fn write_isize(&mut self, value: isize) {
        self.write_u64(value as u64);
    }
}

/// A map whose keys no attacker controls. The order of its entries is unspecified.
pub(super) type Map<K, V> = HashMap<K, V, BuildHasherDefault<Mix>>;

/// A table of values for some nodes, indexed by node number (numbers have no gaps).
#[derive(Debug)]
pub(super) struct Table<T>(Vec<Option<T>>);

impl<T: Copy> Table<T> {
    /// Of no node.
    pub fn new() -> Self {
        Self(Vec::new())
    }

    pub fn get(&self, node: Node) -> Option<T> {
        self.0.get(node.index()).copied().flatten()
    }

    pub fn insert(&mut self, node: Node, value: T) {
        if node.index() >= self.0.len() {
            self.0.resize(node.index() + 1, None);
        }
        self.0[node.index()] = Some(value);
    }

    pub fn remove(&mut self, node: Node) {
        if let Some(entry) = self.0.get_mut(node.index()) {
            *entry = None;
        }
    }

    /// The nodes that have a value, in order.
    pub fn nodes(&self) -> impl Iterator<Item = Node> {
        self.0.iter().enumerate().filter(|(_, entry)| entry.is_some()).map(|(i, _)| Node(i as u32))
    }
}

/// Arithmetic that is repeated until the first of its variables is no longer above 0.
#[derive(Clone, Debug)]
pub(super) struct Repetition {
    pub variables: Vec<Node>,
    /// Their initial values.
    pub start: Vec<Node>,
    /// Their values after each run.
    pub next: Vec<Node>,
    /// Maximum number of runs.
    pub most: usize,
}

impl Repetition {
    /// The nodes in its body and its initial values.
    pub fn needs(&self) -> impl Iterator<Item = Node> {
        self.start.iter().chain(&self.next).copied()
    }
}

/// All nodes that a thread has recorded.
#[derive(Default)]
pub(super) struct Graph {
    pub ops: Vec<Op>,
    known: Map<Op, Node>,
    /// How many nodes have been given a number to make them unique.
    numbered: u32,
    repetitions: Vec<Repetition>,
}

thread_local! {
    static GRAPH: RefCell<Graph> = RefCell::default();
}

/// Runs `build` with a new graph, in which its nodes live.
///
/// Example: the [front page](crate).
pub fn record<T>(build: impl FnOnce() -> T) -> T {
    let outer = GRAPH.take();
    let result = build();
    GRAPH.replace(outer);
    result
}

/// The operations of the graph that is being recorded, up to now.
pub(super) fn operations<T>(read: impl FnOnce(&[Op]) -> T) -> T {
    GRAPH.with_borrow(|graph| read(&graph.ops))
}

/// The repetitions of the graph that is being recorded, up to now.
pub(super) fn repetitions() -> Vec<Repetition> {
    GRAPH.with_borrow(|graph| graph.repetitions.clone())
}

/// A number that no other node has.
fn number() -> u32 {
    GRAPH.with_borrow_mut(|graph| {
        graph.numbered += 1;
        graph.numbered
    })
}

fn intern(op: Op) -> Node {
    GRAPH.with_borrow_mut(|graph| {
        let Graph { ops, known, .. } = graph;
        *known.entry(op).or_insert_with(|| {
            ops.push(op);
            Node((ops.len() - 1) as u32)
        })
    })
}

impl Node {
    pub(super) fn index(self) -> usize {
        self.0 as usize
    }

    pub(super) fn op(self) -> Op {
        GRAPH.with_borrow(|graph| graph.ops[self.index()])
    }

    /// Entry `offset` of the matrix of source number `source`, at the knot that the program is run for.
    #[must_use]
    pub fn entry(source: usize, offset: usize) -> Self {
        intern(Op::Entry { source: source as u32, offset: offset as u32 })
    }

    /// Parameter `index`: the same at every knot.
    #[must_use]
    pub fn parameter(index: usize) -> Self {
        intern(Op::Parameter(index as u32))
    }

    /// The node itself, as a separate variable: nothing is folded through it, and it is different from any other node.
    #[must_use]
    pub fn opaque(self) -> Self {
        intern(Op::Opaque(self, number()))
    }

    /// The negative of this node, without folding.
    pub(super) fn negative(self) -> Self {
        intern(Op::Neg(self))
    }

    /// The constant value of this node, if it is constant.
    #[must_use]
    pub fn known(self) -> Option<f64> {
        match self.op() {
            Op::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// The offset of this node if it is an entry of source number `source`.
    #[must_use]
    pub fn entry_of(self, source: usize) -> Option<usize> {
        match self.op() {
            Op::Entry { source: other, offset } if other as usize == source => Some(offset as usize),
            _ => None,
        }
    }

    /// Whether this node is always 0.
    #[must_use]
    pub fn is_zero(self) -> bool {
        self.known() == Some(0.0)
    }

    /// Folds a function of one known number.
    fn map(self, op: Op, fold: impl FnOnce(f64) -> f64) -> Self {
        match self.known() {
            Some(value) => Self::constant(fold(value)),
            None => intern(op),
        }
    }
}

impl Add for Node {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        match (self.known(), other.known()) {
            (Some(a), Some(b)) => return Self::constant(a + b),
            (Some(0.0), _) => return other,
            (_, Some(0.0)) => return self,
            _ => {}
        }
        match (self.op(), other.op()) {
            (_, Op::Neg(b)) => self - b,
            (Op::Neg(a), _) => other - a,
            _ => intern(Op::Add(self.min(other), self.max(other))),
        }
    }
}

impl Sub for Node {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        if self == other {
            return Self::constant(0.0);
        }
        match (self.known(), other.known()) {
            (Some(a), Some(b)) => return Self::constant(a - b),
            (Some(0.0), _) => return -other,
            (_, Some(0.0)) => return self,
            _ => {}
        }
        match (self.op(), other.op()) {
            (_, Op::Neg(b)) => self + b,
            (Op::Neg(a), _) => -(a + other),
            _ => intern(Op::Sub(self, other)),
        }
    }
}

impl Mul for Node {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        match (self.known(), other.known()) {
            (Some(a), Some(b)) => return Self::constant(a * b),
            (Some(0.0), _) | (_, Some(0.0)) => return Self::constant(0.0),
            (Some(1.0), _) => return other,
            (_, Some(1.0)) => return self,
            (Some(-1.0), _) => return -other,
            (_, Some(-1.0)) => return -self,
            _ => {}
        }
        match (self.op(), other.op()) {
            (Op::Neg(a), Op::Neg(b)) => a * b,
            (Op::Neg(a), _) => -(a * other),
            (_, Op::Neg(b)) => -(self * b),
            _ => intern(Op::Mul(self.min(other), self.max(other))),
        }
    }
}

impl Div for Node {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        match (self.known(), other.known()) {
            (Some(a), Some(b)) => Self::constant(a / b),
            // Reciprocals are slow, and often shared.
            _ => self * other.recip(),
        }
    }
}

impl Neg for Node {
    type Output = Self;
    fn neg(self) -> Self {
        match self.op() {
            Op::Constant(bits) => Self::constant(-f64::from_bits(bits)),
            Op::Neg(a) => a,
            Op::Sub(a, b) => intern(Op::Sub(b, a)),
            _ => intern(Op::Neg(self)),
        }
    }
}

impl Mul<f64> for Node {
    type Output = Self;
    fn mul(self, other: f64) -> Self {
        self * Self::constant(other)
    }
}

impl Div<f64> for Node {
    type Output = Self;
    fn div(self, other: f64) -> Self {
        self / Self::constant(other)
    }
}

derive_operators!([] Node);

impl Scalar for Node {
    fn constant(value: f64) -> Self {
        // Merges -0 into +0.
        intern(Op::Constant((value + 0.0).to_bits()))
    }
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    fn recip(self) -> Self {
        self.map(Op::Recip(self), |v| 1.0 / v)
    }
    fn sqrt(self) -> Self {
        self.map(Op::Sqrt(self), f64::sqrt)
    }
    fn sin_cos(self) -> (Self, Self) {
        (self.map(Op::Sin(self), <f64 as Scalar>::sin), self.map(Op::Cos(self), <f64 as Scalar>::cos))
    }
    fn exp(self) -> Self {
        self.map(Op::Exp(self), <f64 as Scalar>::exp)
    }
    fn ln(self) -> Self {
        self.map(Op::Ln(self), <f64 as Scalar>::ln)
    }
    fn tanh(self) -> Self {
        self.map(Op::Tanh(self), <f64 as Scalar>::tanh)
    }
    fn exp_m1(self) -> Self {
        self.map(Op::ExpM1(self), <f64 as Scalar>::exp_m1)
    }
    fn ln_1p(self) -> Self {
        self.map(Op::Ln1p(self), <f64 as Scalar>::ln_1p)
    }
    fn atan2(self, x: Self) -> Self {
        match (self.known(), x.known()) {
            (Some(y), Some(x)) => Self::constant(Scalar::atan2(y, x)),
            _ => intern(Op::Atan2(self, x)),
        }
    }
    fn repeat(start: Vec<Self>, most: usize, body: impl Fn(&[Self]) -> (Vec<Self>, Self)) -> Vec<Self> {
        let start: Vec<Self> = [vec![Self::one()], start].concat();
        let variables: Vec<Self> = start.iter().map(|_| intern(Op::Variable(number()))).collect();
        let next = scalar::once_more(variables[0], &variables[1..], &body);
        let count = start.len();
        let repetition = GRAPH.with_borrow_mut(|graph| {
            graph.repetitions.push(Repetition { variables, start, next, most });
            graph.repetitions.len() - 1
        });
        let entry = |index| intern(Op::Repeated { repetition: repetition as u32, index: index as u32 });
        (1..count).map(entry).collect()
    }
    fn select(self, positive: Self, otherwise: Self) -> Self {
        match self.known() {
            _ if positive == otherwise => positive,
            Some(value) => {
                if value > 0.0 {
                    positive
                } else {
                    otherwise
                }
            }
            None => intern(Op::Select(self, positive, otherwise)),
        }
    }
}
