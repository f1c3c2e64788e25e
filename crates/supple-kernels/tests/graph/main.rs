//! Graphs and their programs against the same expressions evaluated directly: values, derivatives, batches, levels.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod by_hand;
mod functions;
mod programs;
mod repetitions;

use std::sync::{Mutex, MutexGuard};

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use supple_kernels::graph::{Batch, Node, Program, Source, Target, depends, record, tangent, vjp};
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

const OPERATIONS: u8 = 25;

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
            23 => (repetitions::solved(a), size_a + 0.3),
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
