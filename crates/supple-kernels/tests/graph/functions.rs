//! Functions that are objects, with every scalar.

use supple_kernels::graph::{Function, Node, call, record};
use supple_kernels::{Dual, Scalar};

/// `a b + 3`, `sin(a)` where `b > 0` and else `tanh(a)`, and 7.
struct Objects;

fn formulas<S: Scalar>(inputs: &[&[S]], outputs: &mut [S]) {
    let (a, b) = (inputs[0][0], inputs[1][1]);
    outputs.copy_from_slice(&[a.mul_add(b, S::constant(3.0)), b.select(a.sin(), a.tanh()), S::constant(7.0)]);
}

impl Function for Objects {
    fn number(&self, inputs: &[&[f64]], outputs: &mut [f64]) {
        formulas(inputs, outputs);
    }
    fn node(&self, inputs: &[&[Node]], outputs: &mut [Node]) {
        formulas(inputs, outputs);
    }
}

#[test]
fn functions_that_are_objects_have_the_same_values_with_every_scalar() {
    for b in [-0.5, 0.5] {
        let (mut called, mut expected) = ([0.0; 3], [0.0; 3]);
        call(&Objects, &[&[0.3], &[0.0, b]], &mut called);
        formulas(&[&[0.3], &[0.0, b]], &mut expected);
        assert_eq!(called, expected);

        // Dual numbers replay what nodes record, also where they are made of nodes themselves.
        let a = Dual::<f64, 1>::variable(0.3, 0);
        let rest = [0.0, b].map(Dual::fixed);
        let (mut called, mut expected) = ([a; 3], [a; 3]);
        call(&Objects, &[&[a], &rest], &mut called);
        formulas(&[&[a], &rest], &mut expected);
        for (called, expected) in called.iter().zip(expected) {
            assert_eq!((called.value, called.tangents), (expected.value, expected.tangents));
        }
        record(|| {
            let a = Dual::<Node, 1>::variable(Node::entry(0, 0), 0);
            let rest = [0.0, b].map(|value| Dual::fixed(Node::constant(value)));
            let (mut called, mut expected) = ([a; 3], [a; 3]);
            call(&Objects, &[&[a], &rest], &mut called);
            formulas(&[&[a], &rest], &mut expected);
            for (called, expected) in called.iter().zip(expected) {
                assert_eq!((called.value, called.tangents), (expected.value, expected.tangents));
            }
        });

        // Recording is that of the function itself: the same nodes.
        record(|| {
            let (a, b) = (Node::entry(0, 0), Node::constant(b));
            let (mut called, mut expected) = ([a; 3], [a; 3]);
            call(&Objects, &[&[a], &[b, b]], &mut called);
            formulas(&[&[a], &[b, b]], &mut expected);
            assert_eq!(called, expected);
        });
    }
}

/// Differences, negatives and every function, which are replayed for scalars that are neither numbers nor nodes.
struct Everything;

fn everything<S: Scalar>(inputs: &[&[S]], outputs: &mut [S]) {
    let (a, b) = (inputs[0][0], inputs[0][1]);
    let positive = a.square() + 0.5;
    outputs.copy_from_slice(&[
        a - b * b,
        -(a * b),
        b.atan2(positive),
        positive.recip(),
        positive.sqrt(),
        positive.ln(),
        a.exp(),
        a.exp_m1(),
        positive.ln_1p(),
        a.cos(),
        a,
    ]);
}

impl Function for Everything {
    fn number(&self, inputs: &[&[f64]], outputs: &mut [f64]) {
        everything(inputs, outputs);
        // Tells apart who was called.
        outputs[10] = 77.0;
    }
    fn node(&self, inputs: &[&[Node]], outputs: &mut [Node]) {
        everything(inputs, outputs);
    }
}

#[test]
fn every_operation_is_replayed() {
    for (a, b) in [(0.3, -1.2), (-0.9, 0.4)] {
        let inputs = [Dual::<f64, 2>::variable(a, 0), Dual::variable(b, 1)];
        let (mut called, mut expected) = ([inputs[0]; 11], [inputs[0]; 11]);
        call(&Everything, &[&inputs], &mut called);
        everything(&[&inputs], &mut expected);
        for (called, expected) in called.iter().zip(expected) {
            assert!((called.value - expected.value).abs() < 1e-15);
            assert!(called.tangents.iter().zip(expected.tangents).all(|(a, b)| (a - b).abs() < 1e-14));
        }
        // Plain numbers are not replayed.
        let mut called = [0.0; 11];
        call(&Everything, &[&[a, b]], &mut called);
        assert_eq!((called[0], called[10]), (a - b * b, 77.0));
    }
}
