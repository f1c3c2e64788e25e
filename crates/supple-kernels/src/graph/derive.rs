use super::node::{Node, Op, operations};
use crate::Scalar;

/// For each of the first `len` nodes, whether it is one of `nodes`.
fn marks(len: usize, nodes: impl Iterator<Item = Node>) -> Vec<bool> {
    let mut marks = vec![false; len];
    for node in nodes.filter(|node| node.index() < len) {
        marks[node.index()] = true;
    }
    marks
}

/// For every node up to the last of `ends`: whether it depends on any of `wrt`, which count as independent of one
/// another and of all else.
fn dependents(ends: impl Iterator<Item = Node>, wrt: &[Node]) -> Vec<bool> {
    let len = ends.map(|node| node.index() + 1).max().unwrap_or(0);
    let mut active = marks(len, wrt.iter().copied());
    operations(|ops| {
        for (i, op) in ops[..len].iter().enumerate() {
            active[i] |= op.operands().any(|operand| active[operand.index()]);
        }
    });
    active
}

/// Whether any of `outputs` depends on `variable`.
pub fn depends(outputs: &[Node], variable: Node) -> bool {
    let active = dependents(outputs.iter().copied(), &[variable]);
    outputs.iter().any(|output| active[output.index()])
}

/// The gradient of `sum cotangent output` over the pairs `(output, cotangent)` by each of `wrt`, the cotangents held
/// fixed: reverse differentiation.
///
/// The nodes `wrt` are variables: each counts as independent of the others, even where the graph makes it of them.
pub fn vjp(outputs: &[(Node, Node)], wrt: &[Node]) -> Vec<Node> {
    let zero = Node::constant(0.0);
    let active = dependents(outputs.iter().map(|&(output, _)| output), wrt);
    let mut adjoint = vec![zero; active.len()];
    for &(output, cotangent) in outputs {
        adjoint[output.index()] += cotangent;
    }
    let leaf = marks(active.len(), wrt.iter().copied());
    for i in (0..active.len()).rev() {
        if active[i] && !leaf[i] && !adjoint[i].is_zero() {
            propagate(Node(i as u32), adjoint[i], &active, &mut adjoint);
        }
    }
    wrt.iter().map(|node| adjoint.get(node.index()).copied().unwrap_or(zero)).collect()
}

/// Adds the adjoint `g` of a node to those of its operands.
fn propagate(node: Node, g: Node, active: &[bool], adjoint: &mut [Node]) {
    let mut give = |to: Node, share: &dyn Fn() -> Node| {
        if active[to.index()] {
            adjoint[to.index()] += share();
        }
    };
    match node.op() {
        Op::Constant(_) | Op::Entry { .. } | Op::Parameter(_) => {}
        Op::Add(a, b) => {
            give(a, &|| g);
            give(b, &|| g);
        }
        Op::Sub(a, b) => {
            give(a, &|| g);
            give(b, &|| -g);
        }
        Op::Mul(a, b) => {
            give(a, &|| g * b);
            give(b, &|| g * a);
        }
        Op::Atan2(y, x) => {
            let scaled = g / (y * y + x * x);
            give(y, &|| scaled * x);
            give(x, &|| -(scaled * y));
        }
        Op::Select(condition, positive, otherwise) => {
            give(positive, &|| condition.select(g, Node::zero()));
            give(otherwise, &|| condition.select(Node::zero(), g));
        }
        Op::Opaque(a, _) => give(a, &|| g),
        op => {
            if let Some((a, slope)) = slope(node, op) {
                give(a, &|| g * slope);
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

/// The derivatives of `outputs` along the direction that moves each variable of `seeds` at its rate: forward
/// differentiation. Variables count as independent, as in [`vjp`].
pub fn tangent(outputs: &[Node], seeds: &[(Node, Node)]) -> Vec<Node> {
    let zero = Node::constant(0.0);
    let variables: Vec<Node> = seeds.iter().map(|&(variable, _)| variable).collect();
    let active = dependents(outputs.iter().copied(), &variables);
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
        Op::Constant(_) | Op::Entry { .. } | Op::Parameter(_) => Node::zero(),
        Op::Add(a, b) => rate(a) + rate(b),
        Op::Sub(a, b) => rate(a) - rate(b),
        Op::Mul(a, b) => rate(a) * b + a * rate(b),
        Op::Atan2(y, x) => (rate(y) * x - rate(x) * y) / (y * y + x * x),
        Op::Select(condition, positive, otherwise) => condition.select(rate(positive), rate(otherwise)),
        Op::Opaque(a, _) => rate(a),
        op => slope(node, op).map_or(Node::zero(), |(a, slope)| rate(a) * slope),
    }
}
