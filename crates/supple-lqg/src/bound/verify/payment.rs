//! Proves that every price of a regulator is paid (theory, "Proof").

use super::interval::Interval;
use super::law::{AlongStep, STOPPED, paid_within};
use super::matrix::{Enclosure, Matrix, enclosed};
use super::steady_law::{ROUNDING, Regulated, Unsettled, first, nothing, widths};
use super::wide::Wide;
use super::wides::Wides;

/// Directions of `S` below this share, in units of its diagonal, have no price.
const NO_PRICE: f64 = 1e-40;

/// Below this share, prices are not compared in coordinates of the states themselves.
const ILL_CONDITIONED: f64 = 1e-9;

/// Numbers below this share of the terms that they are summed from count as 0.
const ZERO: f64 = 1e-12;

/// Values of `c` to try in `V >= c S`; any positive one suffices.
const SHARES: [f64; 4] = [1e-8, 1e-14, 1e-20, 1e-28];

/// The share of their magnitude by which state costs are lowered: nothing may count as paid that only rounding of the
/// cost created.
const LOWERED: f64 = 1e-10;

/// Maximum number of steps within which states must incur their cost.
const MOST_STEPS: usize = 150;

/// The relative change of the cost after which the optimal regulator is exact, `Theta` is its price, and every
/// price is paid.
///
/// # Errors
/// The reason why that could not be proved.
pub(crate) fn steady_law_distance(
    dynamics: &Matrix,
    cost: &Matrix,
    price: &Matrix,
    is_stopped: &dyn Fn() -> bool,
) -> Result<f64, String> {
    fn proved<const K: usize>(law: &Regulated<K>, price: &Matrix, stop: &dyn Fn() -> bool) -> Result<f64, String> {
        Ok(law.distance(price)?.max(payment_distance(law, stop)?))
    }
    let of = |words| match words {
        4 => Regulated::<4>::least(dynamics, cost, is_stopped).map(|law| proved(&law, price, is_stopped)),
        16 => Regulated::<16>::least(dynamics, cost, is_stopped).map(|law| proved(&law, price, is_stopped)),
        _ => Regulated::<64>::least(dynamics, cost, is_stopped).map(|law| proved(&law, price, is_stopped)),
    };
    first(widths(dynamics), of).map_err(|why| match why {
        Unsettled::Stopped => STOPPED.to_owned(),
        Unsettled::Grows | Unsettled::Digits => "rounding leaves the optimal regulator unknown".to_owned(),
    })?
}

/// Proves that every state with a cost in the `S` of a regulator incurs it within some steps, whatever the controls do:
/// `V >= c S`, where `x'Vx / 2` is the least cost of these steps. Then `x'Sx` of a controller with a finite average cost is
/// finite on average, and its cost is at least `1/2 Tr(S W) + Tr(Theta P)` per step.
///
/// Returns the relative distance of the numbers from those for which that is proved: 0 if `S` prices all directions.
///
/// # Errors
/// The reason why it could not be proved.
fn payment_distance<const K: usize>(law: &Regulated<K>, is_stopped: &dyn Fn() -> bool) -> Result<f64, String> {
    let roots = Roots::new(&law.s);
    let r = roots.rows.rows;
    if r == 0 {
        return Ok(roots.left);
    }
    let is_as_given = r == law.dynamics.rows && roots.least > ILL_CONDITIONED;
    if is_as_given {
        return Priced::all(law, &roots)?.paid_distance(r, is_stopped);
    }
    let some = |of_states| Priced::some(law, &roots, of_states).and_then(|priced| priced.paid_distance(r, is_stopped));
    match some(false) {
        Err(why) if why != STOPPED => some(true).map_err(|other| if other == STOPPED { other } else { why }),
        ended => ended,
    }
}

/// `R` of `S = R' c R`, with a diagonal `c` whose entries are from 1 to 4, without directions that have no price.
struct Roots<const K: usize> {
    rows: Wides<K>,
    weights: Vec<Wide<K>>,
    /// The columns of its pivots.
    places: Vec<usize>,
    /// The least pivot and the largest remaining entry of `S`, both relative.
    least: f64,
    left: f64,
}

impl<const K: usize> Roots<K> {
    fn new(s: &Wides<K>) -> Self {
        let n = s.rows;
        let unit: Vec<f64> = (0..n).map(|i| s.at(i, i).rounded().max(0.0).sqrt()).collect();
        let share = |left: &Wides<K>, i: usize, j: usize| {
            let size = unit[i] * unit[j];
            if size > 0.0 { left.at(i, j).rounded() / size } else { 0.0 }
        };
        let (mut left, mut rows, mut weights) = (s.clone(), Vec::new(), Vec::new());
        let (mut places, mut least) = (Vec::new(), 1.0f64);
        for _ in 0..n {
            let free = (0..n).filter(|i| !places.contains(i));
            let of = |i: usize| share(&left, i, i);
            let Some(k) = free.max_by(|&a, &b| of(a).total_cmp(&of(b))) else { break };
            if of(k).is_nan() || of(k) <= NO_PRICE {
                break;
            }
            least = least.min(of(k));
            let pivot = left.at(k, k);
            // Half the pivot's exponent, to scale by a power of 2 near its square root.
            let half = (pivot.exponent() + 1).div_euclid(2);
            let is_rounding = |i: usize| share(&left, i, k).abs() <= NO_PRICE;
            let along = |i: usize| if places.contains(&i) || is_rounding(i) { Wide::ZERO } else { left.at(i, k) };
            let row: Vec<Wide<K>> = (0..n).map(|i| along(i) * Wide::power_of_two(-half)).collect();
            let weight = pivot.inverse() * Wide::power_of_two(2 * half);
            left = Wides::from_fn(n, n, |i, j| left.at(i, j) - row[i] * row[j] * weight);
            places.push(k);
            rows.push(row);
            weights.push(weight);
        }
        let every = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let left = every.map(|(i, j)| share(&left, i, j).abs()).fold(0.0, f64::max);
        Self { rows: Wides::from_fn(rows.len(), n, |i, j| rows[i][j]), weights, places, least, left }
    }
}

/// The system restricted to the states that have a cost in `S`.
struct Priced {
    step: AlongStep,
    s: Enclosure,
    /// Coordinates, as columns, in which `S` is about the identity.
    units: Matrix,
    distance: f64,
}

impl Priced {
    /// The system as given, if `S` prices all directions.
    fn all<const K: usize>(law: &Regulated<K>, roots: &Roots<K>) -> Result<Self, String> {
        let n = law.dynamics.rows;
        let units = basis(roots)?;
        let units = Matrix::from_fn(n, n, |i, j| units.at(i, j).rounded());
        let s = law.s.enclosed(&Matrix::from_fn(n, n, |_, _| 0.0));
        Ok(Self { step: quiet(law.dynamics.clone(), law.given.clone()), s, units, distance: 0.0 })
    }

    /// In coordinates `xi = R x` and controls `u = K x + v` of the regulator: the remaining states, `eta`, have no cost
    /// and do not affect these, up to rounding. `R` is that of the roots, or the same in units of some of the states:
    /// this preserves the zeros of the given matrices.
    fn some<const K: usize>(law: &Regulated<K>, roots: &Roots<K>, of_states: bool) -> Result<Self, String> {
        let (n, joint, r) = (law.dynamics.rows, law.dynamics.cols, roots.rows.rows);
        // The map from `(xi, eta, v)` to `z = (x, u)`.
        let mut basis = basis(roots)?;
        let mut rows = roots.rows.clone();
        let mut s = Enclosure::from_fn(r, r, |i, j| if i == j { interval(roots.weights[i]) } else { Interval::ZERO });
        let mut units = Matrix::identity(r);
        if of_states {
            let places = &roots.places;
            let back = Wides::from_fn(r, r, |i, j| basis.at(places[i], j));
            rows = back.times_without_rounding(&rows, nothing::<K>());
            let one = Wides::<K>::identity(n);
            basis = Wides::from_fn(n, n, |i, j| if j < r { one.at(i, places[j]) } else { basis.at(i, j) });
            s = Enclosure::from_fn(r, r, |i, j| interval(law.s.at(places[i], places[j])));
            units = Matrix::from_fn(r, r, |i, j| back.at(i, j).rounded());
        }
        let exactly = |one: &Wides<K>, other: &Wides<K>| one.times_without_rounding(other, nothing::<K>());
        let followed = exactly(&law.gains(), &basis);
        let one = Wides::identity(joint);
        let follow = Wides::from_fn(joint, joint, |i, j| match (i < n, j < n) {
            (true, true) => basis.at(i, j),
            (false, true) => followed.at(i - n, j),
            (_, false) => one.at(i, j),
        });
        let reached = exactly(&Wides::new(law.dynamics), &follow);
        let moved = exactly(&rows, &reached);
        let moved_size = rows.magnitude().times(&reached.magnitude());
        let half = exactly(&law.cost, &follow);
        let paid = exactly(&follow.transpose(), &half);
        let paid_size = follow.magnitude().transpose().times(&law.given.abs().times(&follow.magnitude()));
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
        Ok(Self { step: quiet(dynamics, cost), s, units, distance })
    }

    /// Relative distance of the numbers from those for which `V >= c S` holds within a number of steps, at least `first`.
    fn paid_distance(mut self, first: usize, is_stopped: &dyn Fn() -> bool) -> Result<f64, String> {
        let shares = |below: &Enclosure| {
            SHARES.into_iter().any(|share| {
                let left = below.minus(&self.s.scaled(Interval::point(share)));
                enclosed(&self.units).transpose().around(&left).is_positive_semidefinite()
            })
        };
        for i in 0..self.step.dynamics.rows {
            self.step.cost.set(i, i, self.step.cost.at(i, i) * (1.0 - LOWERED));
        }
        let mut steps = first;
        loop {
            if paid_within(&self.step, steps, is_stopped)?.as_ref().is_some_and(shares) {
                return Ok(self.distance);
            }
            if steps >= MOST_STEPS {
                return Err(format!("could not prove that the regulator's price is paid within {MOST_STEPS} steps"));
            }
            steps = (4 * steps).min(MOST_STEPS);
        }
    }
}

fn interval<const K: usize>(value: Wide<K>) -> Interval {
    let (low, high) = value.around(0.0);
    Interval { low, high }
}

/// Columns `[X, M]` with `R X = I` and `R M = 0`.
fn basis<const K: usize>(roots: &Roots<K>) -> Result<Wides<K>, String> {
    let Roots { rows, places, .. } = roots;
    let (r, n) = (rows.rows, rows.cols);
    let pivots = Wides::from_fn(r, r, |i, j| rows.at(i, places[j]));
    let back = pivots.solve(&Wides::identity(r)).ok_or("the regulator's cost could not be factored")?;
    let along = back.times_without_rounding(rows, nothing::<K>());
    let others: Vec<usize> = (0..n).filter(|place| !places.contains(place)).collect();
    let place = |i: usize| places.iter().position(|&place| place == i);
    Ok(Wides::from_fn(n, n, |i, j| match (place(i), j < r) {
        (Some(row), true) => back.at(row, j),
        (Some(row), false) => -along.at(row, others[j - r]),
        (None, false) if others[j - r] == i => Wide::power_of_two(0),
        (None, _) => Wide::ZERO,
    }))
}

/// A step without noise.
fn quiet(dynamics: Matrix, cost: Matrix) -> AlongStep {
    let n = dynamics.rows;
    AlongStep { dynamics, cost, process: Matrix::from_fn(n, n, |_, _| 0.0) }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// A state that never costs anything, in other coordinates and units.
    #[test]
    fn states_that_cost_nothing_need_not_be_paid_for() {
        // z1+ = .75 z1 + u, z2+ = 3 z2 + z1; only z1 costs; x = (z1 + z2, z2).
        let dynamics = Matrix { rows: 2, cols: 3, entries: vec![1.75, 1.25, 1.0, 1.0, 2.0, 0.0] };
        let entries = vec![1.0, -1.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, 0.25];
        let cost = Matrix { rows: 3, cols: 3, entries };
        let law = Regulated::<16>::least(&dynamics, &cost, &|| false).unwrap_or_else(|why| panic!("{why:?}"));
        let law = law.rounded(&Matrix::identity(2));
        let distance = steady_law_distance(&dynamics, &cost, &law.price, &|| false);
        assert!(distance.as_ref().is_ok_and(|&distance| distance < 1e-14), "{distance:?}");
        // Doubling the price must make the proof fail.
        let dearer = Matrix::from_fn(2, 2, |i, j| 2.0 * law.price.at(i, j));
        assert!(steady_law_distance(&dynamics, &cost, &dearer, &|| false).is_err());
    }

    /// Only `c'x` has a cost, the control has none; with `c'x` held at 0 the states grow by 1.875 per step, at no cost.
    #[test]
    fn motions_without_a_cost_may_grow_and_need_not_be_stopped() {
        let dynamics = Matrix { rows: 2, cols: 3, entries: vec![0.0, 1.0, 0.0, 0.3, -0.7, 1.1] };
        let c = [-1.875 * 0.75, 0.75, 0.0];
        let cost = Matrix::from_fn(3, 3, |i, j| c[i] * c[j]);
        let least = Matrix::from_fn(2, 2, |i, j| c[i] * c[j]);
        // Steps from the identity converge to the regulator that keeps the states bounded, at a higher cost.
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
            let law = Regulated::<16>::at(&dynamics, &cost, Wides::new(s)).unwrap();
            assert!(law.distance(&price).is_ok(), "{s:?}");
            let found = payment_distance(&law, &|| false);
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
        let found_of = |s| payment_distance(&Regulated::<16>::at(&dynamics, &cost, Wides::new(s)).unwrap(), &|| false);
        let found = found_of(&s);
        assert!(found.as_ref().is_ok_and(|&distance| distance < 1e-12), "{found:?}");
        // The third direction costs nothing.
        let all = Matrix::from_fn(3, 3, |i, j| s.at(i, j) + f64::from(u8::from(i == j)));
        assert!(found_of(&all).is_err());
    }

    /// The search for the regulator and the sweeps of its payment check for a stop at every step; nothing runs after a stop.
    #[test]
    fn a_stop_ends_the_proof_of_payment_at_the_next_step() {
        let dynamics = Matrix { rows: 2, cols: 3, entries: vec![0.0, 1.0, 0.0, 0.3, -0.7, 1.1] };
        let c = [-1.875 * 0.75, 0.75, 0.0];
        let cost = Matrix::from_fn(3, 3, |i, j| c[i] * c[j]);
        let law = Regulated::<16>::least(&dynamics, &cost, &|| false).unwrap_or_else(|why| panic!("{why:?}"));
        let price = law.rounded(&Matrix::identity(2)).price;
        let asked = Cell::new(0);
        let until = |last: usize| {
            asked.set(0);
            steady_law_distance(&dynamics, &cost, &price, &|| asked.replace(asked.get() + 1) >= last)
        };
        assert!(until(usize::MAX).is_ok());
        let (all, of_law) = (asked.get(), {
            asked.set(0);
            let count = || asked.replace(asked.get() + 1) == usize::MAX;
            assert!(Regulated::<4>::least(&dynamics, &cost, &count).is_ok());
            asked.get()
        });
        assert!(all > of_law, "the payment of {all} steps, {of_law} of them of the law, is never asked to stop");
        for last in 0..all {
            assert_eq!(until(last), Err(STOPPED.to_owned()), "{last} of {all}");
            assert_eq!(asked.get(), last + 1, "steps of {all} went on after a stop");
        }
    }
}
