use super::node::{Node, Op, Repetition, operations, repetitions};
use crate::Scalar;

/// For each of the first `len` nodes, whether it is one of `nodes`.
fn marks(len: usize, nodes: impl Iterator<Item = Node>) -> Vec<bool> {
    let mut marks = vec![false; len];
    for node in nodes.filter(|node| node.index() < len) {
        marks[node.index()] = true;
    }
    marks
}

/// For every node up to the last of `ends`: whether it depends on any of `wrt`, which count as independent of each
/// other and of all other nodes; also through these repetitions, although derivatives do not go through them.
fn dependents(ends: impl Iterator<Item = Node>, wrt: &[Node], repetitions: &[Repetition]) -> Vec<bool> {
    let len = ends.map(|node| node.index() + 1).max().unwrap_or(0);
    let mut active = marks(len, wrt.iter().copied());
    operations(|ops| {
        for (i, &op) in ops[..len].iter().enumerate() {
            active[i] |= match op {
                Op::Repeated { repetition, .. } => repetitions
                    .get(repetition as usize)
                    .is_some_and(|repetition| repetition.needs().any(|node| active[node.index()])),
                op => op.operands().any(|operand| active[operand.index()]),
            };
        }
    });
    active
}

/// Whether any of `outputs` depends on `variable`, directly or through a repetition.
///
/// Example: [`jacobian`].
#[must_use]
pub fn depends(outputs: &[Node], variable: Node) -> bool {
    let active = dependents(outputs.iter().copied(), &[variable], &repetitions());
    outputs.iter().any(|output| active[output.index()])
}

/// The gradient of `sum cotangent output` over the pairs `(output, cotangent)` with respect to each of `wrt`, with fixed
/// cotangents: reverse differentiation.
///
/// The nodes `wrt` are variables: each counts as independent of the others, even if the graph computes it from them.
///
/// Example: [`jacobian`].
#[must_use]
pub fn vjp(outputs: &[(Node, Node)], wrt: &[Node]) -> Vec<Node> {
    Reverse::new(outputs.iter().map(|&(output, _)| output), wrt).gradient(outputs)
}

/// The matrix whose rows are the derivatives of each of `outputs` by `wrt`, by reverse differentiation as in [`vjp`].
///
/// ```
/// use supple_kernels::Scalar;
/// use supple_kernels::graph::{Node, depends, jacobian, record, tangent, vjp};
///
/// record(|| {
///     let [x, y] = [0, 1].map(|offset| Node::entry(0, offset));
///     let (product, three) = (x * y, Node::constant(3.0));
///     assert_eq!(jacobian(&[product], &[x, y]), [[y, x]]);
///     assert_eq!(vjp(&[(product, three)], &[x]), [three * y]);
///     assert_eq!(tangent(&[product], &[(x, three)]), [three * y]);
///     assert!(depends(&[product], y) && !depends(&[x], y));
/// });
/// ```
#[must_use]
pub fn jacobian(outputs: &[Node], wrt: &[Node]) -> Vec<Vec<Node>> {
    let mut reverse = Reverse::new(outputs.iter().copied(), wrt);
    outputs.iter().map(|&output| reverse.gradient(&[(output, Node::one())])).collect()
}

/// Reverse differentiation of some outputs by the same variables, one gradient after the other: each takes time
/// proportional to the graph of its outputs, not to the whole graph.
struct Reverse<'a> {
    wrt: &'a [Node],
    active: Vec<bool>,
    leaf: Vec<bool>,
    /// The adjoint of every node; 0 between two gradients.
    adjoint: Vec<Node>,
    /// A bit for every node whose adjoint is not 0.
    reached: Vec<u64>,
}

impl<'a> Reverse<'a> {
    fn new(outputs: impl Iterator<Item = Node>, wrt: &'a [Node]) -> Self {
        let active = dependents(outputs, wrt, &[]);
        let len = active.len();
        let leaf = marks(len, wrt.iter().copied());
        Self { wrt, active, leaf, adjoint: vec![Node::zero(); len], reached: vec![0; len.div_ceil(64)] }
    }

    fn gradient(&mut self, outputs: &[(Node, Node)]) -> Vec<Node> {
        for &(output, cotangent) in outputs {
            self.give(output, || cotangent);
        }
        let mut leaves = Vec::new();
        // Operands come before the nodes that use them, so nodes are only reached in words not yet processed.
        for word in (0..self.reached.len()).rev() {
            while let Some(bit) = self.reached[word].checked_ilog2() {
                self.reached[word] &= !(1 << bit);
                let i = 64 * word + bit as usize;
                if self.leaf[i] {
                    leaves.push(i);
                    continue;
                }
                let g = std::mem::replace(&mut self.adjoint[i], Node::zero());
                if !g.is_zero() {
                    self.propagate(Node(i as u32), g);
                }
            }
        }
        let gradient = self.wrt.iter().map(|node| self.adjoint.get(node.index()).copied().unwrap_or(Node::zero()));
        let gradient = gradient.collect();
        leaves.into_iter().for_each(|i| self.adjoint[i] = Node::zero());
        gradient
    }

    /// Adds a contribution to the adjoint of a node that depends on a variable.
    fn give(&mut self, to: Node, share: impl FnOnce() -> Node) {
        let i = to.index();
        if self.active[i] {
            self.adjoint[i] += share();
            self.reached[i / 64] |= 1 << (i % 64);
        }
    }

    /// Adds the adjoint `g` of a node to those of its operands.
    fn propagate(&mut self, node: Node, g: Node) {
        match node.op() {
            Op::Constant(_) | Op::Entry { .. } | Op::Parameter(_) | Op::Variable(_) | Op::Repeated { .. } => {}
            Op::Add(a, b) => {
                self.give(a, || g);
                self.give(b, || g);
            }
            Op::Sub(a, b) => {
                self.give(a, || g);
                self.give(b, || -g);
            }
            Op::Mul(a, b) => {
                self.give(a, || g * b);
                self.give(b, || g * a);
            }
            Op::Atan2(y, x) => {
                let scaled = g / (y * y + x * x);
                self.give(y, || scaled * x);
                self.give(x, || -(scaled * y));
            }
            Op::Select(condition, positive, otherwise) => {
                self.give(positive, || condition.select(g, Node::zero()));
                self.give(otherwise, || condition.select(Node::zero(), g));
            }
            Op::Opaque(a, _) => self.give(a, || g),
            op => {
                if let Some((a, slope)) = slope(node, op) {
                    self.give(a, || g * slope);
                }
            }
        }
    }
}

/// The operand of a function of one variable, and its slope there.
fn slope(node: Node, op: Op) -> Option<(Node, Node)> {
    Some(match op {
        Op::Neg(a) => (a, Node::constant(-1.0)),
        Op::Recip(a) => (a, -(node * node)),
        Op::Sqrt(a) => (a, node.recip() * 0.5),
        Op::Sin(a) => (a, a.cos()),
        Op::Cos(a) => (a, -a.sin()),
        Op::Exp(a) => (a, node),
        Op::Ln(a) => (a, a.recip()),
        Op::Tanh(a) => (a, Node::one() - node * node),
        Op::ExpM1(a) => (a, node + 1.0),
        Op::Ln1p(a) => (a, (a + 1.0).recip()),
        _ => return None,
    })
}

/// The derivatives of `outputs` along the direction in which each variable of `seeds` changes at its rate: forward
/// differentiation. Variables count as independent, as in [`vjp`].
///
/// Example: [`jacobian`].
#[must_use]
pub fn tangent(outputs: &[Node], seeds: &[(Node, Node)]) -> Vec<Node> {
    let zero = Node::constant(0.0);
    let variables: Vec<Node> = seeds.iter().map(|&(variable, _)| variable).collect();
    let active = dependents(outputs.iter().copied(), &variables, &[]);
    let mut rates = vec![zero; active.len()];
    let leaf = marks(active.len(), variables.iter().copied());
    for &(variable, rate) in seeds.iter().filter(|(variable, _)| variable.index() < leaf.len()) {
        rates[variable.index()] = rate;
    }
    for i in 0..active.len() {
        if active[i] && !leaf[i] {
            rates[i] = rate_of(Node(i as u32), &rates);
        }
    }
    outputs.iter().map(|output| rates[output.index()]).collect()
}

fn rate_of(node: Node, rates: &[Node]) -> Node {
    let rate = |of: Node| rates[of.index()];
    match node.op() {
        Op::Constant(_) | Op::Entry { .. } | Op::Parameter(_) | Op::Variable(_) | Op::Repeated { .. } => Node::zero(),
        Op::Add(a, b) => rate(a) + rate(b),
        Op::Sub(a, b) => rate(a) - rate(b),
        Op::Mul(a, b) => rate(a) * b + a * rate(b),
        Op::Atan2(y, x) => (rate(y) * x - rate(x) * y) / (y * y + x * x),
        Op::Select(condition, positive, otherwise) => condition.select(rate(positive), rate(otherwise)),
        Op::Opaque(a, _) => rate(a),
        op => slope(node, op).map_or(Node::zero(), |(a, slope)| rate(a) * slope),
    }
}
