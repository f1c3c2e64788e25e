//! A number that records the expression it comes from, drops multiplications by 0 and 1 and the like, and keeps equal
//! expressions once: it tells what is constant, and how many operations a result takes.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use supple_kernels::Scalar;

/// Index of an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recorded(usize);

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Node {
    Variable(usize),
    /// Its bits.
    Constant(u64),
    /// Name and operands.
    Operation(&'static str, usize, usize),
}

#[derive(Default)]
struct Tape {
    nodes: Vec<Node>,
    known: HashMap<Node, usize>,
}

thread_local! {
    static TAPE: RefCell<Tape> = RefCell::default();
}

fn push(node: Node) -> Recorded {
    TAPE.with_borrow_mut(|tape| {
        let next = tape.nodes.len();
        let index = *tape.known.entry(node).or_insert(next);
        if index == next {
            tape.nodes.push(node);
        }
        Recorded(index)
    })
}

fn node(number: Recorded) -> Node {
    TAPE.with_borrow(|tape| tape.nodes[number.0])
}

/// A variable of its own.
pub fn variable(index: usize) -> Recorded {
    push(Node::Variable(index))
}

/// The value of a constant.
pub fn constant(number: Recorded) -> Option<f64> {
    match node(number) {
        Node::Constant(bits) => Some(f64::from_bits(bits)),
        _ => None,
    }
}

/// How many operations the numbers take, each counted once however often it is used.
pub fn operations(numbers: impl IntoIterator<Item = Recorded>) -> usize {
    let mut waiting: Vec<_> = numbers.into_iter().map(|number| number.0).collect();
    let mut seen: HashSet<usize> = waiting.iter().copied().collect();
    let mut count = 0;
    while let Some(index) = waiting.pop() {
        if let Node::Operation(_, a, b) = node(Recorded(index)) {
            count += 1;
            waiting.extend([a, b].into_iter().filter(|&operand| seen.insert(operand)));
        }
    }
    count
}

fn unary(name: &'static str, of: Recorded, f: impl Fn(f64) -> f64) -> Recorded {
    match constant(of) {
        Some(value) => Recorded::constant(f(value)),
        None => push(Node::Operation(name, of.0, of.0)),
    }
}

/// What a number is the negative of.
fn negated(number: Recorded) -> Option<Recorded> {
    match node(number) {
        Node::Operation("neg", of, _) => Some(Recorded(of)),
        _ => None,
    }
}

impl Add for Recorded {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        match (constant(self), constant(other)) {
            (Some(a), Some(b)) => Self::constant(a + b),
            (Some(0.0), _) => other,
            (_, Some(0.0)) => self,
            _ => match (negated(self), negated(other)) {
                (_, Some(b)) => self - b,
                (Some(a), _) => other - a,
                _ => push(Node::Operation("add", self.0.min(other.0), self.0.max(other.0))),
            },
        }
    }
}

impl Sub for Recorded {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        match (constant(self), constant(other)) {
            (Some(a), Some(b)) => Self::constant(a - b),
            (Some(0.0), _) => -other,
            (_, Some(0.0)) => self,
            _ if self == other => Self::zero(),
            _ => match negated(other) {
                Some(b) => self + b,
                None => push(Node::Operation("sub", self.0, other.0)),
            },
        }
    }
}

impl Mul for Recorded {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        match (constant(self), constant(other)) {
            (Some(a), Some(b)) => Self::constant(a * b),
            (Some(0.0), _) | (_, Some(0.0)) => Self::zero(),
            (Some(1.0), _) => other,
            (_, Some(1.0)) => self,
            (Some(-1.0), _) => -other,
            (_, Some(-1.0)) => -self,
            _ => push(Node::Operation("mul", self.0.min(other.0), self.0.max(other.0))),
        }
    }
}

impl Div for Recorded {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        match (constant(self), constant(other)) {
            (Some(a), Some(b)) => Self::constant(a / b),
            (Some(0.0), _) => self,
            (_, Some(1.0)) => self,
            _ => push(Node::Operation("div", self.0, other.0)),
        }
    }
}

impl Neg for Recorded {
    type Output = Self;
    fn neg(self) -> Self {
        negated(self).unwrap_or_else(|| unary("neg", self, |value| -value))
    }
}

macro_rules! with_f64 {
    ($($trait:ident $function:ident),*) => {
        $(impl $trait<f64> for Recorded {
            type Output = Self;
            fn $function(self, other: f64) -> Self {
                self.$function(Self::constant(other))
            }
        })*
    };
}
with_f64!(Add add, Sub sub, Mul mul, Div div);

impl AddAssign for Recorded {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Recorded {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Scalar for Recorded {
    fn constant(value: f64) -> Self {
        // One zero, whatever its sign.
        push(Node::Constant((value + 0.0).to_bits()))
    }
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    fn recip(self) -> Self {
        Self::one() / self
    }
    fn sqrt(self) -> Self {
        unary("sqrt", self, f64::sqrt)
    }
    fn sin_cos(self) -> (Self, Self) {
        (unary("sin", self, f64::sin), unary("cos", self, f64::cos))
    }
    fn exp(self) -> Self {
        unary("exp", self, f64::exp)
    }
    fn ln(self) -> Self {
        unary("ln", self, f64::ln)
    }
    fn tanh(self) -> Self {
        unary("tanh", self, f64::tanh)
    }
    fn exp_m1(self) -> Self {
        unary("exp_m1", self, f64::exp_m1)
    }
    fn ln_1p(self) -> Self {
        unary("ln_1p", self, f64::ln_1p)
    }
    fn atan2(self, x: Self) -> Self {
        push(Node::Operation("atan2", self.0, x.0))
    }
    fn select(self, positive: Self, otherwise: Self) -> Self {
        let chosen = push(Node::Operation("choices", positive.0, otherwise.0));
        push(Node::Operation("select", self.0, chosen.0))
    }
}
