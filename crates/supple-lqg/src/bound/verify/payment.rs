//! That what a regulator prices is paid for (theory, "Proof").

use super::elimination::{Row, gains};
use super::frame::WORDS;
use super::interval::Interval;
use super::law::{AlongStep, paid_within};
use super::matrix::{Enclosure, Matrix, enclosed};
use super::regulator::{Back, ROUNDING, rows};
use super::wide::Wide;
use super::wides::Wides;

/// Directions of `S` below this share, in units of its diagonal, have no price.
const NO_PRICE: f64 = 1e-9;

/// Numbers below this share of what they are summed from are 0.
const ZERO: f64 = 1e-12;

/// `c` of `V >= c S`. Any number above 0 would do.
const SHARE: f64 = 1e-8;

/// By this share of their sizes costs of states are lowered: nothing counts as paid that rounding of the cost may have
/// made.
const LOWERED: f64 = 1e-10;

/// Steps within which states are to be paid for.
const MOST_STEPS: usize = 150;

/// What changes coordinates.
type Long = Wides<WORDS>;

/// Proves that every state that the `S` of a step which repeats for ever prices is paid for within some steps, whatever the controls do: `V >= c S`, where
/// `x'Vx / 2` is the least cost of these steps. Then `x'Sx` of a controller with a finite average cost is finite on
/// average, and it pays at least `1/2 Tr(S W) + Tr(Theta P)` per step.
///
/// Returns by how much numbers differ, relatively, from those for which that is proved: 0 if `S` prices all directions.
///
/// # Errors
/// Why it could not be proved.
pub(crate) fn payment_distance(step: &Back) -> Result<f64, String> {
    let roots = Roots::new(step.here);
    let r = roots.rows.rows;
    if r == 0 {
        return Ok(roots.left);
    }
    let priced = if r == step.here.rows { Priced::all(step, &roots) } else { Priced::some(step, &roots) }?;
    let shares = |below: &Enclosure| {
        let left = below.minus(&enclosed(&priced.s).scaled(Interval::point(SHARE)));
        enclosed(&priced.units).transpose().around(&left).is_positive_semidefinite()
    };
    let mut step = priced.step;
    for i in 0..step.dynamics.rows {
        step.cost.set(i, i, step.cost.at(i, i) * (1.0 - LOWERED));
    }
    let mut steps = r;
    loop {
        if paid_within(&step, steps).as_ref().is_some_and(shares) {
            return Ok(priced.distance);
        }
        if steps >= MOST_STEPS {
            return Err("the regulator stabilises states that may not affect the cost".into());
        }
        steps = (4 * steps).min(MOST_STEPS);
    }
}

/// `R` of `S = R'R`, without directions that have no price.
struct Roots {
    rows: Matrix,
    /// The columns of its pivots.
    places: Vec<usize>,
    /// What is left of `S`, relatively.
    left: f64,
}

impl Roots {
    fn new(s: &Matrix) -> Self {
        let n = s.rows;
        let unit: Vec<f64> = (0..n).map(|i| s.at(i, i).max(0.0).sqrt()).collect();
        let by = |i: usize| if unit[i] > 0.0 { 1.0 / unit[i] } else { 0.0 };
        let mut left = Matrix::from_fn(n, n, |i, j| s.at(i, j) * by(i) * by(j));
        let (mut rows, mut places): (Vec<Vec<f64>>, _) = (Vec::new(), Vec::new());
        for _ in 0..n {
            let free = (0..n).filter(|i| !places.contains(i));
            let Some(k) = free.max_by(|&a, &b| left.at(a, a).total_cmp(&left.at(b, b))) else { break };
            let pivot = left.at(k, k);
            if pivot.is_nan() || pivot <= NO_PRICE {
                break;
            }
            let row: Vec<f64> =
                (0..n).map(|i| if places.contains(&i) { 0.0 } else { left.at(i, k) / pivot.sqrt() }).collect();
            left = Matrix::from_fn(n, n, |i, j| left.at(i, j) - row[i] * row[j]);
            places.push(k);
            rows.push(row);
        }
        let left = left.entries.iter().fold(0.0, |most: f64, entry| most.max(entry.abs()));
        Self { rows: Matrix::from_fn(rows.len(), n, |i, j| rows[i][j] * unit[j]), places, left }
    }
}

/// A system of the states that `S` prices.
struct Priced {
    step: AlongStep,
    s: Matrix,
    /// By columns, coordinates in which `S` is about the identity.
    units: Matrix,
    distance: f64,
}

impl Priced {
    /// As given, where `S` prices all directions.
    fn all(step: &Back, roots: &Roots) -> Result<Self, String> {
        let n = step.here.rows;
        let units = basis(roots)?;
        let units = Matrix::from_fn(n, n, |i, j| units.at(i, j).rounded());
        let s = step.here.clone();
        Ok(Self { step: quiet(step.dynamics.clone(), step.cost.clone()), s, units, distance: 0.0 })
    }

    /// In coordinates `xi = R x` and controls `u = K x + v` by the regulator: what stands beside them, `eta`, neither
    /// costs anything nor moves them, but for rounding.
    fn some(step: &Back, roots: &Roots) -> Result<Self, String> {
        let (n, joint, r) = (step.here.rows, step.cost.rows, roots.rows.rows);
        let of_control = |(control, row): (usize, Vec<f64>)| Row {
            control,
            weight: Wide::new(row[control]).inverse(),
            entries: row.into_iter().map(Wide::new).collect(),
        };
        let gains = gains::<WORDS>(&rows(step).into_iter().map(of_control).collect::<Vec<_>>(), n, joint);
        // `z = (x, u)` of `(xi, eta, v)`.
        let basis = basis(roots)?;
        let followed = Long::from_fn(joint - n, n, |i, j| gains[i][j]).times(&basis);
        let one = Long::identity(joint);
        let follow = Long::from_fn(joint, joint, |i, j| match (i < n, j < n) {
            (true, true) => basis.at(i, j),
            (false, true) => followed.at(i - n, j),
            (_, false) => one.at(i, j),
        });
        let (moved, moved_size) = product(&[&roots.rows, step.dynamics], &follow);
        let (half, half_size) = product(&[step.cost], &follow);
        let paid = follow.transpose().times(&half);
        let paid_size = follow.magnitude().transpose().times(&half_size);
        let mut distance = roots.left.max(f64::EPSILON);
        let mut clean = |entry: f64, size: f64, is_beside: bool| {
            if entry != 0.0 && (is_beside || entry.abs() <= ZERO * size) {
                distance = distance.max(entry.abs() / size);
                return 0.0;
            }
            entry
        };
        let beside = |j: usize| (r..n).contains(&j);
        let kept: Vec<usize> = (0..joint).filter(|&j| !beside(j)).collect();
        let mut moves = Vec::new();
        for i in 0..r {
            for j in 0..joint {
                let entry = clean(moved.at(i, j).rounded(), moved_size.at(i, j), beside(j));
                moves.extend((!beside(j)).then_some(entry));
            }
        }
        let mut pays = Vec::new();
        for i in 0..joint {
            for j in 0..joint {
                let size = (paid_size.at(i, i) * paid_size.at(j, j)).sqrt();
                let entry = clean(paid.at(i, j).rounded(), size, beside(i) || beside(j));
                pays.extend((!beside(i) && !beside(j)).then_some(entry));
            }
        }
        if distance.is_nan() || distance > ROUNDING {
            return Err(format!("states that may not affect the cost are coupled to those that do by {distance:.1e}"));
        }
        let dynamics = Matrix { rows: r, cols: kept.len(), entries: moves };
        let cost = Matrix { rows: kept.len(), cols: kept.len(), entries: pays };
        Ok(Self { step: quiet(dynamics, cost), s: Matrix::identity(r), units: Matrix::identity(r), distance })
    }
}

/// Columns `[X, M]` with `R X = I` and `R M = 0`.
fn basis(roots: &Roots) -> Result<Long, String> {
    let Roots { rows, places, .. } = roots;
    let (r, n) = (rows.rows, rows.cols);
    let wide = Long::new(rows);
    let pivots = Long::from_fn(r, r, |i, j| wide.at(i, places[j]));
    let back = pivots.solve(&Long::identity(r)).ok_or("the regulator's cost could not be factored")?;
    let along = back.times(&wide);
    let others: Vec<usize> = (0..n).filter(|place| !places.contains(place)).collect();
    let place = |i: usize| places.iter().position(|&place| place == i);
    Ok(Long::from_fn(n, n, |i, j| match (place(i), j < r) {
        (Some(row), true) => back.at(row, j),
        (Some(row), false) => -along.at(row, others[j - r]),
        (None, false) if others[j - r] == i => Wide::power_of_two(0),
        (None, _) => Wide::ZERO,
    }))
}

/// The product of all, and of their absolute values.
fn product(factors: &[&Matrix], last: &Long) -> (Long, Matrix) {
    let first = (last.clone(), last.magnitude());
    factors
        .iter()
        .rev()
        .fold(first, |(product, size), factor| (Long::new(factor).times(&product), factor.abs().times(&size)))
}

/// A step without noise.
fn quiet(dynamics: Matrix, cost: Matrix) -> AlongStep {
    let n = dynamics.rows;
    AlongStep { dynamics, cost, process: Matrix::from_fn(n, n, |_, _| 0.0) }
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
            bounded = Matrix::from_fn(2, 2, |i, j| h.at(i, j) - h.at(i, 2) * h.at(2, j) / h.at(2, 2));
        }
        for (s, accepted) in [(&least, true), (&bounded, false)] {
            let h = dynamics.transpose().times(s).times(&dynamics);
            let h = Matrix::from_fn(3, 3, |i, j| cost.at(i, j) + h.at(i, j));
            let price = Matrix::from_fn(2, 2, |i, j| 0.5 * h.at(i, 2) * h.at(2, j) / h.at(2, 2));
            let back = Back { dynamics: &dynamics, cost: &cost, next: s, here: s, price: &price };
            assert!(super::super::regulator::distance(&back).is_ok(), "{s:?}");
            let found = payment_distance(&back);
            assert_eq!(found.is_ok(), accepted, "{s:?}: {found:?}");
        }
        assert!(bounded.at(1, 1) > 2.0 * least.at(1, 1), "{bounded:?}");
    }

    /// Two controls without a price hold both combinations of states that cost something at 0.
    #[test]
    fn costs_that_controls_remove_in_one_step_are_paid_once() {
        let entries = vec![1.1, 0.3, -0.2, 0.7, 0.1, 0.4, -0.6, 0.9, -0.3, 1.3, 0.2, 0.8, 0.5, 0.6, -0.9];
        let dynamics = Matrix { rows: 3, cols: 5, entries };
        let rows = [[0.3, -1.7, 0.9], [1.1, 0.2, -0.4]];
        let price = |i: usize, j: usize| rows.iter().map(|row| row[i] * row[j]).sum::<f64>();
        let s = Matrix::from_fn(3, 3, price);
        let cost = Matrix::from_fn(5, 5, |i, j| if i < 3 && j < 3 { price(i, j) } else { 0.0 });
        let none = Matrix::from_fn(3, 3, |_, _| 0.0);
        let found_of = |s| payment_distance(&Back { dynamics: &dynamics, cost: &cost, next: s, here: s, price: &none });
        let found = found_of(&s);
        assert!(found.as_ref().is_ok_and(|&distance| distance < 1e-12), "{found:?}");
        // The third direction costs nothing.
        let all = Matrix::from_fn(3, 3, |i, j| s.at(i, j) + f64::from(u8::from(i == j)));
        assert!(found_of(&all).is_err());
    }
}
