use std::any::Any;

use super::node::{Node, Op, Repetition, operations, record, repetitions};
use super::repetition::bodies;
use crate::Scalar;

/// A numeric function behind a trait object.
///
/// A generic function cannot be called through a trait object. Written for plain numbers and for nodes, a function can be
/// called with every scalar: see [`call`].
///
/// ```
/// use supple_kernels::graph::{Function, Node, call};
/// use supple_kernels::{Dual, Scalar};
///
/// struct Square;
///
/// impl Function for Square {
///     fn number(&self, inputs: &[&[f64]], outputs: &mut [f64]) {
///         outputs[0] = inputs[0][0] * inputs[0][0];
///     }
///     fn node(&self, inputs: &[&[Node]], outputs: &mut [Node]) {
///         outputs[0] = inputs[0][0] * inputs[0][0];
///     }
/// }
///
/// // With a scalar that it was not written for.
/// let mut found = [Dual::<f64, 1>::constant(0.0)];
/// call(&Square, &[&[Dual::variable(3.0, 0)]], &mut found);
/// assert_eq!((found[0].value, found[0].tangents[0]), (9.0, 6.0));
/// ```
pub trait Function {
    /// Computes its outputs for plain numbers.
    fn number(&self, inputs: &[&[f64]], outputs: &mut [f64]);

    /// The same for nodes: records the operations.
    fn node(&self, inputs: &[&[Node]], outputs: &mut [Node]);
}

/// The outputs of a function with any scalar. Scalars other than `f64` and [`Node`] replay what the function records.
///
/// Example: [`Function`].
pub fn call<S: Scalar>(function: &dyn Function, inputs: &[&[S]], outputs: &mut [S]) {
    let called = call_as(inputs, outputs, |inputs, outputs| function.number(inputs, outputs))
        || call_as(inputs, outputs, |inputs, outputs| function.node(inputs, outputs));
    if !called {
        replay(function, inputs, outputs);
    }
}

/// A value as type `B`, if that is its type.
fn same<A: Copy + 'static, B: Copy + 'static>(value: A) -> Option<B> {
    (&value as &dyn Any).downcast_ref::<B>().copied()
}

/// Calls a function of the scalar `B` if that is the scalar at hand, and returns whether it is.
fn call_as<S: Scalar, B: Scalar>(inputs: &[&[S]], outputs: &mut [S], function: impl FnOnce(&[&[B]], &mut [B])) -> bool {
    if same::<S, B>(S::zero()).is_none() {
        return false;
    }
    let own = |list: &[S]| list.iter().filter_map(|&value| same(value)).collect::<Vec<B>>();
    let given: Vec<Vec<B>> = inputs.iter().map(|list| own(list)).collect();
    let given: Vec<&[B]> = given.iter().map(Vec::as_slice).collect();
    let mut found = own(outputs);
    function(&given, &mut found);
    for (output, value) in outputs.iter_mut().zip(found.into_iter().filter_map(same)) {
        *output = value;
    }
    true
}

/// Records a function and evaluates it with any scalar.
fn replay<S: Scalar>(function: &dyn Function, inputs: &[&[S]], outputs: &mut [S]) {
    // The operations are copied out of the recording before they are replayed, as the scalar may record too.
    let (ops, repetitions, results) = record(|| {
        let entries = |(source, input): (usize, &&[S])| (0..input.len()).map(|i| Node::entry(source, i)).collect();
        let nodes: Vec<Vec<Node>> = inputs.iter().enumerate().map(entries).collect();
        let nodes: Vec<&[Node]> = nodes.iter().map(Vec::as_slice).collect();
        let mut results = vec![Node::zero(); outputs.len()];
        function.node(&nodes, &mut results);
        (operations(<[Op]>::to_vec), repetitions(), results)
    });
    let mut needed = vec![false; ops.len()];
    for result in &results {
        needed[result.index()] = true;
    }
    for i in (0..ops.len()).rev() {
        if needed[i] {
            ops[i].operands().for_each(|operand| needed[operand.index()] = true);
            if let Op::Repeated { repetition, .. } = ops[i] {
                repetitions[repetition as usize].needs().for_each(|node| needed[node.index()] = true);
            }
        }
    }
    let bodies = bodies(&ops, &repetitions);
    let mut values: Vec<Option<S>> = vec![None; ops.len()];
    let mut ended: Vec<Option<Vec<S>>> = vec![None; repetitions.len()];
    for i in (0..ops.len()).filter(|&i| needed[i] && bodies[i].is_none()) {
        values[i] = Some(match ops[i] {
            Op::Repeated { repetition, index } => {
                let number = repetition as usize;
                let body = || (0..ops.len()).filter(|&i| needed[i] && bodies[i] == Some(number));
                let run = || replay_repetition(&ops, &repetitions[number], body, inputs, values.clone());
                ended[number].get_or_insert_with(run)[index as usize]
            }
            op => evaluate(op, inputs, |node| values[node.index()].unwrap_or_else(S::zero)),
        });
    }
    for (output, result) in outputs.iter_mut().zip(results) {
        *output = values[result.index()].unwrap_or_else(S::zero);
    }
}

/// The final variables of a repetition whose body consists of `ops`, given the values of all nodes before it.
fn replay_repetition<S: Scalar, I: Iterator<Item = usize>>(
    ops: &[Op],
    repetition: &Repetition,
    body: impl Fn() -> I,
    inputs: &[&[S]],
    mut values: Vec<Option<S>>,
) -> Vec<S> {
    let all = |nodes: &[Node], values: &[Option<S>]| -> Vec<S> {
        nodes.iter().map(|node| values[node.index()].unwrap_or_else(S::zero)).collect()
    };
    let mut variables = all(&repetition.start, &values);
    for _ in 0..repetition.most {
        for (variable, &value) in repetition.variables.iter().zip(&variables) {
            values[variable.index()] = Some(value);
        }
        for i in body().filter(|&i| !matches!(ops[i], Op::Variable(_))) {
            values[i] = Some(evaluate(ops[i], inputs, |node| values[node.index()].unwrap_or_else(S::zero)));
        }
        variables = all(&repetition.next, &values);
    }
    variables
}

/// The value of one operation, given those of its operands.
fn evaluate<S: Scalar>(op: Op, inputs: &[&[S]], value: impl Fn(Node) -> S) -> S {
    match op {
        Op::Constant(bits) => S::constant(f64::from_bits(bits)),
        Op::Entry { source, offset } => inputs[source as usize][offset as usize],
        // A function records no parameters: its inputs are entries. The others are replayed with their repetition.
        Op::Parameter(_) | Op::Variable(_) | Op::Repeated { .. } => S::zero(),
        Op::Add(a, b) => value(a) + value(b),
        Op::Sub(a, b) => value(a) - value(b),
        Op::Mul(a, b) => value(a) * value(b),
        Op::Atan2(y, x) => value(y).atan2(value(x)),
        Op::Neg(a) => -value(a),
        Op::Recip(a) => value(a).recip(),
        Op::Sqrt(a) => value(a).sqrt(),
        Op::Sin(a) => value(a).sin(),
        Op::Cos(a) => value(a).cos(),
        Op::Exp(a) => value(a).exp(),
        Op::Ln(a) => value(a).ln(),
        Op::Tanh(a) => value(a).tanh(),
        Op::ExpM1(a) => value(a).exp_m1(),
        Op::Ln1p(a) => value(a).ln_1p(),
        Op::Select(sign, positive, otherwise) => value(sign).select(value(positive), value(otherwise)),
        Op::Opaque(a, _) => value(a),
    }
}
