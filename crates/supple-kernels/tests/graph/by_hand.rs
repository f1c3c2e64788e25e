//! Nodes that are known, alike or hidden, and their derivatives, by hand.

use supple_kernels::graph::{Node, Program, depends, jacobian, record, tangent, vjp};
use supple_kernels::{Dual, Scalar};

use super::{assert_near, nodes, results, set};

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
