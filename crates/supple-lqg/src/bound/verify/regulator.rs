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
pub(super) const ROUNDING: f64 = 1e-8;

/// `H = L + F'S'F - diag(S, 0)`, and the sums of the absolute values of its terms.
fn remainder(step: &Back) -> (Enclosure, Matrix) {
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
    (h, sizes)
}

/// Rows `u`, each with the control that it is of: at the controls where `u z = 0` of all, the least is paid.
pub(super) fn rows(step: &Back) -> Vec<(usize, Vec<f64>)> {
    let (h, sizes) = remainder(step);
    eliminated(&h.middle(), &sizes, step.here.rows)
}

/// By how much `L`, relatively, must change so that `L + F'S'F - diag(S, 0) = U'U` and `Theta = U_x'U_x / 2` exactly:
/// then every controller pays `1/2 Tr(W S') + Tr(Theta P)` at this step.
pub(crate) fn distance(step: &Back) -> Result<f64, String> {
    let (n, joint) = (step.here.rows, step.cost.rows);
    let (h, sizes) = remainder(step);
    let rows = eliminated(&h.middle(), &sizes, n);
    let u = enclosed(&Matrix::from_fn(rows.len(), joint, |i, j| rows[i].1[j]));
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

/// Rows `u` with `H - sum u'u` without controls, each with the control that it is of: Cholesky's, the dearest control first.
fn eliminated(h: &Matrix, sizes: &Matrix, n: usize) -> Vec<(usize, Vec<f64>)> {
    let joint = h.rows;
    let (mut left, mut rows): (_, Vec<(usize, Vec<f64>)>) = (h.clone(), Vec::new());
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
        rows.push((k, row));
    }
    rows
}
