//! Graphs and their programs against the same expressions evaluated directly: values, derivatives, batches, levels.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::sync::{Mutex, MutexGuard};

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use supple_kernels::graph::{
    Batch, Function, Node, Program, Source, Target, call, depends, jacobian, record, tangent, vjp,
};
use supple_kernels::{Dual, Level, Matrices, Scalar, Scratch, padded};

/// What expressions are evaluated over; a node can be hidden, which must not show in results.
trait Number: Scalar {
    fn hidden(self) -> Self {
        self
    }
}

impl Number for f64 {}
impl<const K: usize> Number for Dual<f64, K> {}
impl Number for Node {
    fn hidden(self) -> Self {
        self.opaque()
    }
}

/// Numbers that an expression starts from: five entries at the knot, one of the knot after, two parameters.
const INPUTS: usize = 8;

/// Steps of an expression: what is done to which earlier values.
type Expression = Vec<(u8, usize, usize, usize)>;

const OPERATIONS: u8 = 24;

/// All values of an expression; those that can be larger than 8 are squeezed by a sine.
fn evaluate<S: Number>(expression: &Expression, inputs: [S; INPUTS]) -> Vec<S> {
    let mut values: Vec<(S, f64)> = inputs.into_iter().map(|input| (input, 1.5)).collect();
    for &(operation, a, b, c) in expression {
        let [(a, size_a), (b, size_b), (c, size_c)] = [a, b, c].map(|place| values[place % values.len()]);
        let (value, size) = match operation {
            0 => (a + b, size_a + size_b),
            1 => (a - b, size_a + size_b),
            2 => (a * b, size_a * size_b),
            3 => (a / (b * b + 0.5), 2.0 * size_a),
            4 => (-a, size_a),
            5 => ((a.square() + 0.7).recip(), 1.5),
            6 => ((a * a + 0.3).sqrt(), size_a + 0.6),
            7 => (a.sin(), 1.0),
            8 => (a.cos(), 1.0),
            9 => ((a.sin() * 0.5).exp(), 2.0),
            10 => ((a * a + 0.5).ln(), 5.0),
            11 => (a.atan2(b * b + 0.4), 1.6),
            12 => ((a + 0.377).select(b, c), size_b.max(size_c)),
            13 => (a.mul_add(b, c), size_a * size_b + size_c),
            14 => (c - a * b, size_a * size_b + size_c),
            15 => (a * b - c, size_a * size_b + size_c),
            16 => (a * 0.75 - 0.25, size_a + 0.25),
            17 => ((a - 0.213).abs() / 2.0, size_a),
            18 => (a.hidden(), size_a),
            19 => (a.smooth_positive_part(S::constant(0.2)), size_a + 0.1),
            20 => (a.tanh(), 1.0),
            21 => ((a.sin() * 0.5).exp_m1(), 1.0),
            22 => ((a * a * 0.7).ln_1p(), 5.0),
            _ => (S::constant(0.6), 0.6),
        };
        values.push(if size > 8.0 { (value.sin(), 1.0) } else { (value, size) });
    }
    values.into_iter().map(|(value, _)| value).collect()
}

/// Numbers at all knots, and parameters.
struct Setting {
    knots: Matrices,
    others: Matrices,
    parameters: [f64; 2],
}

impl Setting {
    fn new(count: usize, seed: u64) -> Self {
        // A plain linear congruential generator: any spread of numbers in [-1.5, 1.5] will do.
        let mut state = seed.wrapping_mul(2).wrapping_add(1);
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            3.0 * (state >> 11) as f64 * 2f64.powi(-53) - 1.5
        };
        let (mut knots, mut others) = (Matrices::zeros(count, 2, 3), Matrices::vectors(count + 1, 2));
        for t in 0..count {
            (0..6).for_each(|i| knots.set(t, i / 3, i % 3, next()));
        }
        for t in 0..=count {
            (0..2).for_each(|i| others.vector_mut(t)[i] = next());
        }
        Self { knots, others, parameters: [next(), next()] }
    }

    fn at(&self, t: usize) -> [f64; INPUTS] {
        let entry = |i, j| self.knots.get(t, i, j);
        let [p, q] = self.parameters;
        [entry(0, 0), entry(0, 2), entry(1, 0), entry(1, 1), entry(1, 2), self.others.vector(t + 1)[1], p, q]
    }

    fn sources(&self) -> [Source<'_>; 2] {
        [(&self.knots).into(), Source { matrices: &self.others, shift: 1 }]
    }

    /// Results of a program at every knot, one row each; sums; results at every knot by single runs.
    fn run(&self, program: &Program, outputs: usize, first: usize, count: usize) -> (Matrices, Vec<f64>) {
        let mut out = Matrices::vectors(self.knots.count(), outputs);
        let mut sums = vec![0.0; outputs];
        let batch = Batch { first, count };
        let inputs = (&self.sources()[..], &self.parameters[..]);
        program.run(batch, inputs, (Some(&mut out), &mut sums), &mut Scratch::new());
        (out, sums)
    }

    fn run_single(&self, program: &Program, outputs: usize, t: usize) -> Vec<f64> {
        let mut out = vec![0.0; outputs];
        let size = self.knots.rows() * self.knots.stride();
        let knot = &self.knots.as_slice()[t * size..(t + 1) * size];
        program.run_single(&[knot, self.others.vector(t + 1)], &self.parameters, &mut [&mut out]);
        out
    }
}

/// The inputs as nodes; what [`Setting::at`] gives at a knot.
fn nodes() -> [Node; INPUTS] {
    let entry = |i: usize, j: usize| Node::entry(0, i * padded(3) + j);
    let (p, q) = (Node::parameter(0), Node::parameter(1));
    [entry(0, 0), entry(0, 2), entry(1, 0), entry(1, 1), entry(1, 2), Node::entry(1, 1), p, q]
}

fn set(nodes: &[Node]) -> Vec<(Node, Target)> {
    nodes.iter().enumerate().map(|(offset, &node)| (node, Target::Set { sink: 0, offset })).collect()
}

/// Values and derivatives by all inputs.
fn duals(inputs: [f64; INPUTS]) -> [Dual<f64, INPUTS>; INPUTS] {
    let mut direction = 0..;
    inputs.map(|input| Dual::variable(input, direction.next().unwrap()))
}

/// Keeps other tests from choosing other instructions until it is dropped.
fn hold_level() -> MutexGuard<'static, ()> {
    static LEVEL: Mutex<()> = Mutex::new(());
    LEVEL.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Does something at each level of vector instructions that this machine has.
fn at_every_level(mut action: impl FnMut(Level) -> Result<(), TestCaseError>) -> Result<(), TestCaseError> {
    let _guard = hold_level();
    let before = Level::current();
    let result = Level::ALL.into_iter().filter(|level| level.force()).try_for_each(&mut action);
    before.force();
    result
}

/// The largest of some numbers, and 1.
fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers.into_iter().fold(1.0, |most: f64, number| most.max(number.abs()))
}

/// Cases whose rounding errors grow little on the way.
fn tame(expression: &Expression, setting: &Setting) -> bool {
    (0..setting.knots.count())
        .flat_map(|t| evaluate(expression, duals(setting.at(t))))
        .all(|value| largest(value.tangents) < 1e4)
}

fn expressions() -> impl Strategy<Value = Expression> {
    prop::collection::vec((0..OPERATIONS, 0usize..1000, 0usize..1000, 0usize..1000), 1..60)
}

fn config() -> ProptestConfig {
    let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(500) };
    let rng_seed = match config.rng_seed {
        RngSeed::Random => RngSeed::Fixed(1),
        fixed => fixed,
    };
    ProptestConfig { rng_seed, ..config }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn programs_give_what_the_expression_does(expression in expressions(), count in 1usize..=20, seed in any::<u64>()) {
        let setting = Setting::new(count, seed);
        prop_assume!(tame(&expression, &setting));
        let len = INPUTS + expression.len();
        let program = record(|| Program::compile(&set(&evaluate(&expression, nodes()))));
        at_every_level(|level| {
            let (out, _) = setting.run(&program, len, 0, count);
            for t in 0..count {
                let direct = evaluate(&expression, setting.at(t));
                for (i, (&found, expected)) in out.vector(t).iter().zip(direct).enumerate() {
                    prop_assert!((found - expected).abs() < 1e-10, "{:?}, value {}: {} {}", level, i, found, expected);
                }
                let single = setting.run_single(&program, len, t);
                let same = single.iter().zip(out.vector(t)).all(|(a, b)| a.to_bits() == b.to_bits());
                prop_assert!(same, "{:?}: single {:?} and batch {:?}", level, single, out.vector(t));
            }
            Ok(())
        })?;
    }

    /// One value alone: most of the graph is left out, and products are fused that otherwise are results.
    #[test]
    fn the_last_value_alone_is_the_same(expression in expressions(), count in 1usize..=20, seed in any::<u64>()) {
        let setting = Setting::new(count, seed);
        prop_assume!(tame(&expression, &setting));
        let program = record(|| Program::compile(&set(evaluate(&expression, nodes()).last_chunk::<1>().unwrap())));
        prop_assert!(program.len() <= 12 * expression.len());
        at_every_level(|level| {
            let (out, _) = setting.run(&program, 1, 0, count);
            for t in 0..count {
                let (found, direct) = (out.vector(t)[0], evaluate(&expression, setting.at(t)));
                prop_assert!((found - direct[direct.len() - 1]).abs() < 1e-10, "{level:?}");
                prop_assert_eq!(found.to_bits(), setting.run_single(&program, 1, t)[0].to_bits());
            }
            Ok(())
        })?;
    }

    /// The gradient of a weighted sum of the last values: reverse, and forward along each input, and dual numbers.
    #[test]
    fn derivatives_equal_those_of_dual_numbers(expression in expressions(), count in 1usize..=9, seed in any::<u64>()) {
        let setting = Setting::new(count, seed);
        prop_assume!(tame(&expression, &setting));
        const WEIGHTS: [f64; 4] = [1.0, -0.7, 0.3, 2.0];
        let program = record(|| {
            let inputs = nodes();
            let values = evaluate(&expression, inputs);
            let weighed: Vec<_> = values.iter().rev().zip(WEIGHTS).map(|(&v, w)| (v, Node::constant(w))).collect();
            let outputs: Vec<_> = weighed.iter().map(|&(value, _)| value).collect();
            let mut results = vjp(&weighed, &inputs);
            for input in inputs {
                let rates = tangent(&outputs, &[(input, Node::one())]);
                let sum = rates.into_iter().zip(WEIGHTS).fold(Node::zero(), |sum, (rate, w)| sum + rate * w);
                assert!(depends(&outputs, input) || sum.is_zero());
                results.push(sum);
            }
            Program::compile(&set(&results))
        });
        at_every_level(|level| {
            let (out, _) = setting.run(&program, 2 * INPUTS, 0, count);
            for t in 0..count {
                let values = evaluate(&expression, duals(setting.at(t)));
                let weighed = || values.iter().rev().zip(WEIGHTS);
                let size = largest(values.iter().flat_map(|value| value.tangents));
                for i in 0..INPUTS {
                    let expected: f64 = weighed().map(|(value, weight)| weight * value.tangents[i]).sum();
                    let [reverse, forward] = [i, INPUTS + i].map(|place| out.vector(t)[place]);
                    prop_assert!((reverse - expected).abs() < 1e-9 * size, "{level:?}: {reverse}, not {expected}");
                    prop_assert!((forward - expected).abs() < 1e-9 * size, "{level:?}: {forward}, not {expected}");
                }
            }
            Ok(())
        })?;
    }

    /// Second derivatives: reverse over reverse and forward over reverse, against nested dual numbers.
    #[test]
    fn second_derivatives_equal_nested_dual_numbers(expression in expressions(), seed in any::<u64>()) {
        let setting = Setting::new(1, seed);
        prop_assume!(expression.len() < 25 && tame(&expression, &setting));
        let program = record(|| {
            let inputs = nodes();
            let last = *evaluate(&expression, inputs).last().unwrap();
            let gradient = vjp(&[(last, Node::one())], &inputs);
            let mut results: Vec<Node> =
                gradient.iter().flat_map(|&entry| vjp(&[(entry, Node::one())], &inputs)).collect();
            results.extend(inputs.iter().flat_map(|&input| tangent(&gradient, &[(input, Node::one())])));
            Program::compile(&set(&results))
        });
        let (out, _) = setting.run(&program, 2 * INPUTS * INPUTS, 0, 1);
        let at = setting.at(0);
        for i in 0..INPUTS {
            let mut direction = 0..;
            let inputs = at.map(|value| {
                let inner = Dual::<f64, 1> { value, tangents: [f64::from(direction.start == i)] };
                Dual::<Dual<f64, 1>, INPUTS>::variable(inner, direction.next().unwrap())
            });
            let values = evaluate(&expression, inputs);
            let size = largest(values.iter().flat_map(|value| value.tangents.map(|tangent| tangent.tangents[0])));
            let last = values[values.len() - 1];
            for (j, expected) in last.tangents.iter().map(|tangent| tangent.tangents[0]).enumerate() {
                let places = [j * INPUTS + i, (INPUTS + i) * INPUTS + j];
                for found in places.map(|place| out.vector(0)[place]) {
                    prop_assert!((found - expected).abs() < 1e-8 * size, "{i}, {j}: {found}, not {expected}");
                }
            }
        }
    }

    /// Every kind of target, over parts of what there is.
    #[test]
    fn batches_touch_their_own_knots_only(
        expression in expressions(), first in 0usize..10, count in 1usize..=20, seed in any::<u64>(),
    ) {
        let setting = Setting::new(first + count + 3, seed);
        prop_assume!(tame(&expression, &setting));
        let program = record(|| {
            let last = *evaluate(&expression, nodes()).last().unwrap();
            let set = Target::Set { sink: 0, offset: 0 };
            let add = |node| (node, Target::Add { sink: 0, offset: 1 });
            let once = Node::entry(1, 1) * 2.0;
            Program::compile(&[(last, set), add(last), add(once), (last, Target::Sum { index: 1 })])
        });
        let (out, sums) = setting.run(&program, 2, first, count);
        let mut sum = 0.0;
        for t in 0..first + count + 3 {
            let direct = evaluate(&expression, setting.at(t));
            let (last, once) = (direct[direct.len() - 1], 2.0 * setting.at(t)[5]);
            let inside = (first..first + count).contains(&t);
            let expected = if inside { [last, last + once] } else { [0.0, 0.0] };
            sum += if inside { last } else { 0.0 };
            for (found, expected) in out.vector(t).iter().zip(expected) {
                prop_assert!((found - expected).abs() < 1e-10, "knot {t}: {found}, not {expected}");
            }
        }
        prop_assert_eq!(sums[0], 0.0);
        prop_assert!((sums[1] - sum).abs() < 1e-9);
    }
}

impl Number for Dual<Dual<f64, 1>, INPUTS> {}

/// Results of a program of one knot, at the level in use.
fn results(build: impl FnOnce([Node; INPUTS]) -> Vec<Node>) -> (Setting, Vec<f64>) {
    let _guard = hold_level();
    let setting = Setting::new(1, 7);
    let mut outputs = 0;
    let program = record(|| {
        let list = build(nodes());
        outputs = list.len();
        Program::compile(&set(&list))
    });
    let found = setting.run_single(&program, outputs, 0);
    let (out, _) = setting.run(&program, outputs, 0, 1);
    assert_eq!(found, out.vector(0));
    (setting, found)
}

fn assert_near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!((found - expected).abs() < 1e-14, "result {i}: {found} instead of {expected}");
    }
}

#[test]
fn results_may_be_constants_inputs_and_one_node_several_times() {
    let (setting, found) = results(|[x, y, _, _, _, after, p, q]| {
        let sum = x + y;
        vec![Node::constant(3.5), x, p, sum, sum, after, x, Node::zero(), q.opaque(), sum.opaque(), Node::constant(3.5)]
    });
    let [x, y, _, _, _, after, p, q] = setting.at(0);
    assert_near(&found, &[3.5, x, p, x + y, x + y, after, x, 0.0, q, x + y, 3.5]);
}

#[test]
fn products_used_twice_are_made_once_and_right() {
    let (setting, found) = results(|[x, y, z, ..]| {
        let product = x * y;
        let hidden = (y * z).opaque();
        // Twice in one sum, in a sum and a difference, beside another product, and through an opaque node.
        vec![product + product, product + z, z - product, x * z + y * z, hidden + x, hidden - x, product]
    });
    let [x, y, z, ..] = setting.at(0);
    let expected = [2.0 * x * y, x * y + z, z - x * y, x * z + y * z, y * z + x, y * z - x, x * y];
    assert_near(&found, &expected);
}

#[test]
fn products_of_one_sum_may_both_be_needed_elsewhere() {
    let (setting, found) = results(|[x, y, z, ..]| {
        let (a, b) = (x * y, y * z);
        let sum = a + b;
        vec![sum, a * sum, sum - a, b.sin()]
    });
    let [x, y, z, ..] = setting.at(0);
    let (a, b) = (x * y, y * z);
    assert_near(&found, &[a + b, a * (a + b), b, b.sin()]);
}

#[test]
fn sines_and_cosines_of_an_angle_and_of_the_same_hidden() {
    let (setting, found) = results(|[x, y, ..]| {
        let hidden = x.opaque();
        let again = x.opaque();
        vec![x.sin(), hidden.sin(), hidden.cos(), again.cos(), y.cos(), (x + y).sin()]
    });
    let [x, y, ..] = setting.at(0);
    assert_near(&found, &[x.sin(), x.sin(), x.cos(), x.cos(), y.cos(), (x + y).sin()]);
}

#[test]
fn opaque_nodes_are_variables_of_their_own() {
    let (setting, found) = results(|[x, y, ..]| {
        let w = (x * y).opaque();
        let other = (x * y).opaque();
        assert!(w != other && !(w - other).is_zero() && !Node::zero().opaque().is_zero());
        let f = x * w + w * w + other;
        let [held, through] = [vec![x, w, other], vec![x]].map(|wrt| vjp(&[(f, Node::one())], &wrt));
        let along = tangent(&[f], &[(x, Node::constant(2.0)), (w, y)]);
        [held, through, along].concat()
    });
    let [x, y, ..] = setting.at(0);
    let w = x * y;
    let [by_x, by_w] = [w, x + 2.0 * w];
    // `other` is no variable of the last two: it moves with x.
    assert_near(&found, &[by_x, by_w, 1.0, by_x + by_w * y + y, 2.0 * (by_x + y) + by_w * y]);
}

#[test]
fn what_is_known_is_folded() {
    record(|| {
        let [x, y, ..] = nodes();
        let zero = Node::zero();
        for node in [x * zero, zero / x, x - x, zero * (x / y), vjp(&[(y * y, Node::one())], &[x])[0]] {
            assert!(node.is_zero());
        }
        assert_eq!(x * y, y * x);
        assert_eq!(x + y, y + x);
        assert_eq!((x + zero, x * Node::one(), -(-x), x / Node::one()), (x, x, x, x));
        assert_eq!(-(x - y), y - x);
        assert_eq!(Node::constant(2.0).sqrt().known(), Some(2f64.sqrt()));
        assert_eq!(Node::constant(-0.0), Node::zero());
        assert!(depends(&[x * y], x) && !depends(&[x * y, zero], Node::parameter(0)));
        assert_eq!(Program::compile(&set(&[x, Node::one()])).len(), 0);
        assert_eq!(Program::compile(&set(&[x * y + x, x * y - y])).len(), 3, "a product needed twice is made once");
        assert_eq!(Program::compile(&set(&[x * y + x])).len(), 1, "a product that is only added is fused");
    });
    assert!(Program::compile(&[]).is_empty());
}

/// Long batches are shared by the threads of the pool, in whatever pieces.
#[test]
fn threads_do_not_change_a_bit() {
    let _guard = hold_level();
    let program = record(|| {
        let inputs = nodes();
        let mut x = inputs[0];
        for _ in 0..200 {
            x = (x * inputs[1] + inputs[5]).sin() * inputs[6] + inputs[2];
        }
        Program::compile(&set(&[x, x * x]))
    });
    let setting = Setting::new(9_001, 5);
    let run = |threads: usize, first: usize, count: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut out = Matrices::vectors(setting.knots.count(), 2);
        pool.install(|| {
            let inputs = (&setting.sources()[..], &setting.parameters[..]);
            program.run(Batch { first, count }, inputs, (Some(&mut out), &mut []), &mut Scratch::new());
        });
        out
    };
    let alone = run(1, 3, 8_997);
    assert_eq!(alone.get(2, 0, 0), 0.0);
    assert_eq!(alone.get(9_000, 0, 0), 0.0);
    for threads in [2, 3, 7] {
        assert!(run(threads, 3, 8_997) == alone, "{threads} threads");
    }
}

/// A program of millions of instructions was divided among threads even at a single knot, without end.
#[test]
fn long_programs_at_few_knots_end() {
    let _guard = hold_level();
    let program = record(|| {
        let inputs = nodes();
        let mut x = inputs[0];
        for _ in 0..2_000_001 {
            x = x * inputs[1] + inputs[2];
        }
        Program::compile(&set(&[x]))
    });
    assert!(program.len() > 2_000_000);
    let setting = Setting::new(20, 5);
    let run = |threads: usize, count: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut out = Matrices::vectors(setting.knots.count(), 1);
        let inputs = (&setting.sources()[..], &setting.parameters[..]);
        let batch = Batch { first: 0, count };
        pool.install(|| program.run(batch, inputs, (Some(&mut out), &mut []), &mut Scratch::new()));
        out
    };
    for count in [1, 2, 16, 17, 19] {
        assert!(run(2, count) == run(1, count), "{count} knots");
    }
}

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

/// Constants are computed, neutral ones leave no trace, and signs are gathered where they may cancel.
#[test]
fn constants_and_signs_leave_no_operations() {
    record(|| {
        let [x, y, z, ..] = nodes();
        let c = Node::constant;
        let (zero, one) = (Node::zero(), Node::one());
        let known = [c(2.0) + c(3.0), c(2.0) - c(3.0), c(2.0) * c(3.0), c(2.0) / c(4.0), -c(2.0), c(4.0).recip()];
        assert_eq!(known.map(Node::known), [5.0, -1.0, 6.0, 0.5, -2.0, 0.25].map(Some));
        assert_eq!((c(5.0) / c(3.0)).known(), Some(5.0 / 3.0), "rounded once");
        assert_eq!(c(1.0).atan2(c(-1.0)).known(), Some(f64::atan2(1.0, -1.0)));
        assert_eq!((one.recip(), x.known()), (one, None));
        assert_eq!((zero + x, x + zero, zero - x, x - zero), (x, x, -x, x));
        assert_eq!((one * x, x * one, c(-1.0) * x, x * c(-1.0)), (x, x, -x, -x));
        assert_eq!((x + -y, -x + y, x - -y, -x - y), (x - y, y - x, x + y, -(x + y)));
        assert_eq!((-x * -y, -x * y, x * -y), (x * y, -(x * y), -(x * y)));
        assert_eq!((x.select(y, y), one.select(x, y), zero.select(x, y), c(-1.0).select(x, y)), (y, x, y, y));
        assert!(x.select(y, z) != y && x.select(y, z) != z);
        assert_eq!((x.opaque() == x.opaque(), Node::entry(0, 3) == Node::entry(0, 3)), (false, true));
    });
}

#[test]
fn entries_are_known_by_their_source() {
    record(|| {
        let (entry, other) = (Node::entry(2, 7), Node::entry(0, 0));
        assert_eq!([0, 1, 2, 3].map(|source| entry.entry_of(source)), [None, None, Some(7), None]);
        assert_eq!((other.entry_of(0), other.entry_of(2)), (Some(0), None));
        assert_eq!((Node::parameter(2).entry_of(2), (entry + other).entry_of(2)), (None, None));
    });
}

/// Rows of a Jacobian are gradients of its outputs, each as if it were made alone.
#[test]
fn jacobians_are_rows_of_gradients() {
    let (setting, found) = results(|inputs| {
        let [x, y, z, ..] = inputs;
        let shared = (x * y).sin();
        // More nodes than one word of marks, and outputs of which some depend on no variable.
        let long = (0..90).fold(shared, |sum, k| sum * z + y * (0.1 * f64::from(k)));
        let outputs = [shared, long, Node::constant(2.0), shared * shared, z, long - z];
        let rows = jacobian(&outputs, &inputs[..3]);
        assert_eq!(rows.len(), outputs.len());
        for (row, &output) in rows.iter().zip(&outputs) {
            assert_eq!(row, &vjp(&[(output, Node::one())], &inputs[..3]));
        }
        assert!(jacobian(&[], &inputs).is_empty());
        // A variable that was recorded after all outputs.
        assert!(jacobian(&[x], &[Node::parameter(9)])[0][0].is_zero());
        assert!(tangent(&[x], &[(Node::parameter(9), Node::one())])[0].is_zero());
        rows.concat()
    });
    let [x, y, z, ..] = setting.at(0);
    let (sine, slope) = ((x * y).sin(), (x * y).cos());
    assert_near(&found[..3], &[y * slope, x * slope, 0.0]);
    assert_near(&found[6..9], &[0.0; 3]);
    assert_near(&found[9..15], &[2.0 * sine * y * slope, 2.0 * sine * x * slope, 0.0, 0.0, 0.0, 1.0]);
    let mut expected = [0.0; 3];
    for (i, expected) in expected.iter_mut().enumerate() {
        let [x, y, z] = std::array::from_fn(|j| Dual::<f64, 1> { value: [x, y, z][j], tangents: [f64::from(i == j)] });
        let long = (0..90).fold((x * y).sin(), |sum, k| sum * z + y * (0.1 * f64::from(k)));
        *expected = long.tangents[0];
    }
    for (i, expected) in expected.into_iter().enumerate() {
        assert!((found[3 + i] - expected).abs() < 1e-12 * (1.0 + expected.abs()), "{i}");
        assert!((found[15 + i] - expected + f64::from(i == 2)).abs() < 1e-12 * (1.0 + expected.abs()), "{i}");
    }
}

/// Variables that are recorded only after all outputs, the very next node among them.
#[test]
fn what_depends_on_nothing_has_no_derivatives() {
    record(|| {
        let (x, next, later) = (Node::entry(0, 0), Node::entry(0, 1), Node::entry(0, 2));
        let variables = [next, later];
        assert_eq!(tangent(&[x], &variables.map(|variable| (variable, Node::one()))), [Node::zero()]);
        assert_eq!(jacobian(&[x], &variables), [[Node::zero(); 2]]);
        assert!(variables.iter().all(|&variable| !depends(&[x], variable)));
        assert_eq!((tangent(&[], &[(x, Node::one())]), vjp(&[], &[x])), (vec![], vec![Node::zero()]));
    });
}

/// One knot at a time, a program does with its sinks what it does with those of batches.
#[test]
fn single_runs_add_to_what_is_there() {
    let _guard = hold_level();
    let setting = Setting::new(1, 3);
    let program = record(|| {
        let [x, y, ..] = nodes();
        let add = Target::Add { sink: 1, offset: 2 };
        Program::compile(&[(x + y, Target::Set { sink: 1, offset: 0 }), (x * y, add), (y, Target::Sum { index: 1 })])
    });
    let [x, y, ..] = setting.at(0);
    let (mut sums, mut sink) = ([10.0, 20.0], [30.0, 40.0, 50.0]);
    let knot = setting.knots.as_slice();
    program.run_single(&[knot, setting.others.vector(1)], &setting.parameters, &mut [&mut sums, &mut sink]);
    assert_eq!(sums, [10.0, 20.0 + y]);
    assert_eq!((sink[0], sink[1]), (x + y, 40.0));
    assert!((sink[2] - (50.0 + x * y)).abs() < 1e-14);
}

/// Nothing is read or written where there is nothing to do, wherever that is.
#[test]
fn batches_of_no_knots_do_nothing() {
    let _guard = hold_level();
    let setting = Setting::new(2, 3);
    let program = record(|| Program::compile(&set(&[nodes()[0] * nodes()[1]])));
    let mut out = Matrices::vectors(2, 1);
    for first in [0, 2, 7] {
        let given = (&setting.sources()[..], &setting.parameters[..]);
        program.run(Batch { first, count: 0 }, given, (Some(&mut out), &mut []), &mut Scratch::new());
    }
    assert_eq!(out, Matrices::vectors(2, 1));
    let nothing = record(|| Program::compile(&[]));
    nothing.run(Batch { first: 7, count: 3 }, (&[], &[]), (Some(&mut out), &mut []), &mut Scratch::new());
    assert_eq!(out, Matrices::vectors(2, 1));
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

/// The two sides of a program that sums may be shared with: neither threads nor their absence change what sums hold.
#[test]
fn sums_of_long_batches_are_in_the_order_of_the_knots() {
    let _guard = hold_level();
    let program = record(|| {
        let inputs = nodes();
        let x = (0..300).fold(inputs[0], |x, _| (x * inputs[1]).sin() + inputs[2]);
        Program::compile(&[(x, Target::Set { sink: 0, offset: 0 }), (x, Target::Sum { index: 0 })])
    });
    let setting = Setting::new(9_001, 6);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let (out, sums) = pool.install(|| setting.run(&program, 1, 1, 9_000));
    let in_order = (1..9_001).fold(0.0, |sum, t| sum + out.get(t, 0, 0));
    assert_eq!(sums[0].to_bits(), f64::to_bits(in_order));
    assert_eq!(out.get(0, 0, 0), 0.0);
}
