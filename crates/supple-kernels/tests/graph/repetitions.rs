//! Arithmetic that runs again and again.

use supple_kernels::graph::{Batch, Function, Node, Program, call, depends, jacobian, record, vjp};
use supple_kernels::{Dual, Matrices, Scalar, Scratch};

use super::{Setting, hold_level, nodes, set};

/// A step of Newton's method for `x + 0.3 sin x = a`.
fn step<S: Scalar>(x: S, a: S) -> S {
    let (sin, cos) = x.sin_cos();
    x - (x + sin * 0.3 - a) / (cos * 0.3 + 1.0)
}

/// `x` with `x + 0.3 sin x = a`, with two steps more for the first three orders of derivatives.
pub(crate) fn solved<S: Scalar>(a: S) -> S {
    let body = |x: &[S]| {
        let next = step(x[0], a);
        (vec![next], (next - x[0]).abs() - 1e-9)
    };
    let found = S::repeat(vec![a], 40, body)[0];
    step(step(found, a), a)
}

/// How often a number can be halved until it is at most 1, at most eight times, and what is left.
fn halvings<S: Scalar>(number: S) -> Vec<S> {
    let halve = |x: &[S]| {
        let half = x[1] * 0.5;
        (vec![x[0] + 1.0, half], half - 1.0)
    };
    S::repeat(vec![S::zero(), number], 8, halve)
}

#[test]
fn numbers_stop_on_their_own_and_at_the_most() {
    // At least once.
    for (number, count) in [(0.1, 1.0), (1.0, 1.0), (2.0, 1.0), (2.5, 2.0), (100.0, 7.0), (1e9, 8.0), (f64::NAN, 1.0)] {
        let found = halvings(number);
        let dual = halvings(Dual::<f64, 1>::variable(number, 0));
        assert_eq!(found[0], count, "{number}");
        assert_eq!((dual[0].value, dual[0].tangents), (count, [0.0]));
        if !number.is_nan() {
            assert_eq!(found[1], number * 0.5f64.powf(count));
            assert_eq!((dual[1].value, dual[1].tangents), (found[1], [0.5f64.powf(count)]));
        }
    }
}

/// A number has the same bits beside whatever others, though others run on.
#[test]
fn lanes_stop_on_their_own() {
    let _guard = hold_level();
    let program = record(|| {
        let inputs = nodes();
        let found = halvings((inputs[0] * 4.0).exp());
        Program::compile(&set(&[found[0], found[1], found[1] * inputs[1], solved(inputs[2])]))
    });
    let setting = Setting::new(77, 3);
    let (all, _) = setting.run(&program, 4, 0, 77);
    let mut counts = [0; 9];
    for t in 0..77 {
        let [x, y, a, ..] = setting.at(t);
        let expected = halvings((x * 4.0).exp());
        let row = all.vector(t);
        assert_eq!(row[0], expected[0]);
        counts[row[0] as usize] += 1;
        for (found, expected) in row[1..4].iter().zip([expected[1], expected[1] * y, solved(a)]) {
            assert!((found - expected).abs() < 1e-14, "{t}: {found} {expected}");
        }
        let mut alone = Matrices::vectors(77, 4);
        let inputs = (&setting.sources()[..], &setting.parameters[..]);
        program.run(Batch { first: t, count: 1 }, inputs, (Some(&mut alone), &mut []), &mut Scratch::new());
        assert_eq!(alone.vector(t), row);
        let single = setting.run_single(&program, 4, t);
        single.iter().zip(row).for_each(|(single, found)| assert!((single - found).abs() < 1e-14));
    }
    assert!(counts[1] > 0 && counts.iter().filter(|&&count| count > 0).count() > 4, "{counts:?}");
}

/// Repetitions that read the results of others, what both read, and results that are read much later.
#[test]
fn repetitions_follow_one_another() {
    fn formula<S: Scalar>([a, b, c, d]: [S; 4]) -> Vec<S> {
        let shared = (a * b).sin();
        let first = halvings(shared.exp() * 9.0);
        let kept = shared * c + first[1];
        let second = halvings(first[0] * 3.0 + shared.square() + d);
        // Begins with what the first ends with, twice; the second variable only passes.
        let third = S::repeat(vec![first[1], first[1], d], 5, |x| (vec![x[0] * 0.7 + shared * 0.1, x[1], x[0]], x[0]));
        vec![second[0], second[1] * kept, third[0] + shared.cos(), third[1], third[2] * second[1], S::constant(2.5), a]
    }
    let _guard = hold_level();
    let program = record(|| {
        let [a, b, c, d, ..] = nodes();
        Program::compile(&set(&formula([a, b, c, d])))
    });
    let setting = Setting::new(40, 8);
    let (all, _) = setting.run(&program, 7, 0, 40);
    for t in 0..40 {
        let [a, b, c, d, ..] = setting.at(t);
        for (i, (found, expected)) in all.vector(t).iter().zip(formula([a, b, c, d])).enumerate() {
            assert!((found - expected).abs() < 1e-13, "{t}, {i}: {found} {expected}");
        }
    }
}

/// Programs of derivatives make only what they need, and slots are used again.
#[test]
fn what_is_not_needed_does_not_run() {
    record(|| {
        let inputs = nodes();
        let found = halvings(inputs[0]);
        let without = Program::compile(&set(&[inputs[0] * inputs[1]]));
        assert_eq!(without.len(), 1);
        let all = Program::compile(&set(&found));
        assert!(all.len() > 4 && all.len() < 12, "{}", all.len());
    });
}

#[test]
fn results_are_constants_to_derivatives_but_depend() {
    record(|| {
        let inputs = nodes();
        let found = halvings(inputs[0] * inputs[1]);
        let sum = found[1] * inputs[2];
        assert_eq!(jacobian(&[sum], &inputs[..3])[0], [Node::zero(), Node::zero(), found[1]]);
        assert_eq!(vjp(&[(found[1].opaque(), Node::one())], &inputs[..1]), [Node::zero()]);
        let dependent = inputs.map(|input| depends(&[sum], input));
        assert_eq!(dependent, [true, true, true, false, false, false, false, false]);
    });
}

/// Functions that repeat, called with scalars that replay them.
#[test]
fn functions_that_repeat_are_replayed() {
    struct Halvings;
    impl Function for Halvings {
        fn number(&self, inputs: &[&[f64]], outputs: &mut [f64]) {
            outputs.copy_from_slice(&halvings(inputs[0][0]));
        }
        fn node(&self, inputs: &[&[Node]], outputs: &mut [Node]) {
            outputs.copy_from_slice(&halvings(inputs[0][0]));
        }
    }
    for number in [0.3, 5.0, 77.0] {
        let mut outputs = [Dual::<f64, 1>::zero(); 2];
        call(&Halvings, &[&[Dual::variable(number, 0)]], &mut outputs);
        let expected = halvings(Dual::<f64, 1>::variable(number, 0));
        for (found, expected) in outputs.iter().zip(expected) {
            assert_eq!((found.value, found.tangents), (expected.value, expected.tangents));
        }
    }
}
