//! That the cost with the state known, and the price of not knowing it, are those of the problem (theory, equation
//! L.31).

use super::interval::Interval;
use super::matrix::{Enclosure, Matrix, enclosed};

/// What a regulator rests on: one step back from `S'` to `S`.
pub(crate) struct Back<'a> {
    /// `[A, B]`, n x (n + m).
    pub dynamics: &'a Matrix,
    /// `L` of `1/2 z' L z`.
    pub cost: &'a Matrix,
    /// `S'` of the next step.
    pub next: &'a Matrix,
    /// `S`.
    pub here: &'a Matrix,
    /// `Theta`.
    pub price: &'a Matrix,
}

/// Controls whose price is below this share of what it is summed from have none.
const PRICELESS: f64 = 1e-10;

/// How far, relatively, the cost is from one for which the step is exact and every price is paid.
const ROUNDING: f64 = 1e-8;

/// How much less a cost counts a step later, where it is asked whether a state is ever paid for.
const DISCOUNT: f64 = 0.8;

/// Steps of that.
const STEPS: usize = 150;

/// How many times that cost, and which share of everything, the cost to go may be.
const SEEN: (f64, f64) = (1e8, 1e-6);

/// Costs of steps below this share of the cost to go are rounding: much less than the least that counts as paid.
const PAID: f64 = 1e-10;

/// By how much `L`, relatively, must change so that `L + F'S'F - diag(S, 0) = U'U` and `Theta = U_x'U_x / 2` exactly:
/// then every controller pays `1/2 Tr(W S') + Tr(Theta P)` at this step.
pub(crate) fn distance(step: &Back) -> Result<f64, String> {
    let (n, joint) = (step.here.rows, step.cost.rows);
    let f = enclosed(step.dynamics);
    let mut h = enclosed(step.cost).plus(&f.transpose().around(&enclosed(step.next)));
    let mut sizes = step.cost.abs();
    let moved = step.dynamics.abs();
    let added = moved.transpose().times(&step.next.abs()).times(&moved);
    for i in 0..joint {
        for j in 0..joint {
            let here = if i < n && j < n { step.here.at(i, j) } else { 0.0 };
            h.entries[i * joint + j] = h.at(i, j) - Interval::point(here);
            sizes.entries[i * joint + j] += added.at(i, j) + here.abs();
        }
    }
    let rows = eliminated(&h.middle(), &sizes, n);
    let u = enclosed(&rows);
    let square = u.transpose().times(&u);
    let mut worst = relative(&h.minus(&square), &sizes);
    let prices = square.block(0..n, 0..n).scaled(Interval::point(0.5)).minus(&enclosed(step.price));
    worst = worst.max(relative(&prices, &sizes));
    if worst.is_nan() || worst > ROUNDING {
        return Err(format!("the relative residual of the Riccati equation is {worst:.1e}"));
    }
    Ok(worst)
}

/// The largest entry beside the root of those on the diagonal of its sizes.
fn relative(of: &Enclosure, sizes: &Matrix) -> f64 {
    let places = (0..of.rows).flat_map(|i| (0..of.cols).map(move |j| (i, j)));
    let share = |(i, j): (usize, usize)| {
        let found = of.at(i, j).magnitude();
        if found == 0.0 { 0.0 } else { found / (sizes.at(i, i).sqrt() * sizes.at(j, j).sqrt()) }
    };
    places.map(share).fold(0.0, |a, b| if b.is_nan() || b > a { b } else { a })
}

/// Rows `u` with `H - sum u'u` without controls: Cholesky's, the dearest control first.
fn eliminated(h: &Matrix, sizes: &Matrix, n: usize) -> Matrix {
    let joint = h.rows;
    let (mut left, mut rows) = (h.clone(), Vec::new());
    let mut controls: Vec<usize> = (n..joint).collect();
    let share = |left: &Matrix, k: usize| {
        let pivot = left.at(k, k);
        if pivot > 0.0 { pivot / sizes.at(k, k) } else { 0.0 }
    };
    while let Some(place) =
        (0..controls.len()).max_by(|&a, &b| share(&left, controls[a]).total_cmp(&share(&left, controls[b])))
    {
        let k = controls.swap_remove(place);
        if share(&left, k) <= PRICELESS {
            break;
        }
        let root = left.at(k, k).sqrt();
        let row: Vec<f64> = (0..joint).map(|j| left.at(k, j) / root).collect();
        left = Matrix::from_fn(joint, joint, |i, j| left.at(i, j) - row[i] * row[j]);
        rows.push(row);
    }
    Matrix::from_fn(rows.len(), joint, |i, j| rows[i][j])
}

/// Whether every state that `S` prices is paid for within some steps, whatever the controls do: then no controller
/// pays less on average than `1/2 Tr(W S)`, and `S` is not of one that keeps bounded what costs nothing.
///
/// By steps of the discounted problem from 0, rounded; not a proof. Along motions without a cost rounding would grow
/// until it looks like one: what is small beside `S` is dropped after each step, so that what is left is rather too
/// low.
pub(crate) fn is_paid(dynamics: &Matrix, cost: &Matrix, s: &Matrix) -> bool {
    let (n, joint) = (s.rows, cost.rows);
    let unit: Vec<f64> = (0..n).map(|i| s.at(i, i).max(0.0).sqrt()).collect();
    let by: Vec<f64> = unit.iter().map(|&unit| if unit > 0.0 { 1.0 / unit } else { 0.0 }).collect();
    // In units of `S`, and as it is.
    let (mut paid, mut value) = (Matrix::from_fn(n, n, |_, _| 0.0), Matrix::from_fn(n, n, |_, _| 0.0));
    let moved = dynamics.abs();
    for _ in 0..STEPS {
        let carried = dynamics.transpose().times(&value).times(dynamics);
        let sized = moved.transpose().times(&value.abs()).times(&moved);
        let h = Matrix::from_fn(joint, joint, |i, j| cost.at(i, j) + DISCOUNT * carried.at(i, j));
        let sizes = Matrix::from_fn(joint, joint, |i, j| cost.at(i, j).abs() + DISCOUNT * sized.at(i, j));
        let u = eliminated(&h, &sizes, n);
        let saved = u.transpose().times(&u);
        let left = |i: usize, j: usize| 0.5 * (h.at(i, j) - saved.at(i, j) + h.at(j, i) - saved.at(j, i));
        paid = without_small(&Matrix::from_fn(n, n, |i, j| left(i, j) * by[i] * by[j]), PAID);
        value = Matrix::from_fn(n, n, |i, j| paid.at(i, j) * unit[i] * unit[j]);
    }
    let (times, share) = SEEN;
    let left = Matrix::from_fn(n, n, |i, j| {
        let all = times * paid.at(i, j) - s.at(i, j) * by[i] * by[j];
        if i == j { all + share * n as f64 } else { all }
    });
    left.cholesky().is_some()
}

/// A positive semidefinite matrix without what is left of it once Cholesky's pivots, the largest first, are below
/// `least`.
fn without_small(a: &Matrix, least: f64) -> Matrix {
    let n = a.rows;
    let (mut left, mut kept) = (a.clone(), Matrix::from_fn(n, n, |_, _| 0.0));
    for _ in 0..n {
        let Some(k) = (0..n).max_by(|&a, &b| left.at(a, a).total_cmp(&left.at(b, b))) else { break };
        let pivot = left.at(k, k);
        if pivot.is_nan() || pivot <= least {
            break;
        }
        let column: Vec<f64> = (0..n).map(|i| left.at(i, k) / pivot.sqrt()).collect();
        left = Matrix::from_fn(n, n, |i, j| left.at(i, j) - column[i] * column[j]);
        kept = Matrix::from_fn(n, n, |i, j| kept.at(i, j) + column[i] * column[j]);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `c'x` costs and the control does not; with `c'x` held at 0 the states grow by 1.9 per step, at no cost.
    #[test]
    fn motions_without_a_cost_may_grow_and_need_not_be_stopped() {
        let dynamics = Matrix { rows: 2, cols: 3, entries: vec![0.0, 1.0, 0.0, 0.3, -0.7, 1.1] };
        let c = [-1.9 * 0.7, 0.7, 0.0];
        let cost = Matrix::from_fn(3, 3, |i, j| c[i] * c[j]);
        let least = Matrix::from_fn(2, 2, |i, j| c[i] * c[j]);
        // Steps from the identity lead to the regulator that keeps the states bounded, and pays for it.
        let mut bounded = Matrix::identity(2);
        for _ in 0..300 {
            let carried = dynamics.transpose().times(&bounded).times(&dynamics);
            let h = Matrix::from_fn(3, 3, |i, j| cost.at(i, j) + carried.at(i, j));
            let u = eliminated(&h, &h.abs(), 2);
            let paid = u.transpose().times(&u);
            bounded = Matrix::from_fn(2, 2, |i, j| h.at(i, j) - paid.at(i, j));
        }
        for (s, accepted) in [(&least, true), (&bounded, false)] {
            let h = dynamics.transpose().times(s).times(&dynamics);
            let h = Matrix::from_fn(3, 3, |i, j| cost.at(i, j) + h.at(i, j));
            let u = eliminated(&h, &h.abs(), 2);
            let price = u.transpose().times(&u);
            let price = Matrix::from_fn(2, 2, |i, j| 0.5 * price.at(i, j));
            let back = Back { dynamics: &dynamics, cost: &cost, next: s, here: s, price: &price };
            assert!(distance(&back).is_ok(), "{s:?}");
            assert_eq!(is_paid(&dynamics, &cost, s), accepted, "{s:?}");
        }
        assert!(bounded.at(1, 1) > 2.0 * least.at(1, 1), "{bounded:?}");
    }
}
