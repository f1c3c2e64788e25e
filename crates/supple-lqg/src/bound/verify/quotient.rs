//! A system without the states that cost nothing up to rounding: exact for a nearby system in which they cost nothing.

use super::matrix::Matrix;
use super::wide::Wide;
use super::wides::Wides;

/// The number of words of the numbers with which it is computed and compared.
const WORDS: usize = 4;

/// Their relative rounding error, with a margin.
const ROUNDING: f64 = 1e-60;

/// Coordinates `xi = R x` of `x+ = F z + w`, `z = (x, u)`: they equal the `kept` states if the other states are 0.
pub(crate) struct Quotient {
    /// `R`, r x n.
    rows: Matrix,
    /// The r states that these coordinates equal if the other states are 0.
    kept: Vec<usize>,
}

/// A system in these coordinates.
#[derive(Clone, Debug)]
pub(crate) struct Fewer {
    /// `F`, r x (r + m).
    pub dynamics: Matrix,
    /// `L`, r + m.
    pub cost: Matrix,
    /// `W`, r x r.
    pub process: Matrix,
}

impl Quotient {
    /// From the rows of `R`; `None` if these do not contain the identity.
    pub fn new(rows: &Matrix) -> Option<Self> {
        let (r, n) = (rows.rows, rows.cols);
        let is_unit = |i: usize, j: usize| (0..r).all(|k| rows.at(k, j) == f64::from(u8::from(i == k)));
        let kept: Vec<usize> = (0..r).map(|i| (0..n).find(|&j| is_unit(i, j))).collect::<Option<_>>()?;
        Some(Self { rows: rows.clone(), kept })
    }

    /// The states in which `R` is the identity.
    pub fn kept(&self) -> &[usize] {
        &self.kept
    }

    /// `M`, n x (n - r), with `R M = 0`: the directions left out, by columns that are the identity in the other states.
    pub fn beside(&self) -> Matrix {
        let n = self.rows.cols;
        let others: Vec<usize> = (0..n).filter(|j| !self.kept.contains(j)).collect();
        Matrix::from_fn(n, others.len(), |i, k| match self.kept.iter().position(|&kept| kept == i) {
            Some(row) => -self.rows.at(row, others[k]),
            None => f64::from(u8::from(i == others[k])),
        })
    }

    /// The indices of `(xi, u)` in `z`.
    fn places(&self, joint: usize) -> Vec<usize> {
        self.kept.iter().copied().chain(self.rows.cols..joint).collect()
    }

    /// `diag(R, I)`.
    fn both(&self, joint: usize) -> Matrix {
        let (r, n) = (self.rows.rows, self.rows.cols);
        Matrix::from_fn(r + joint - n, joint, |i, j| match (i < r, j < n) {
            (true, true) => self.rows.at(i, j),
            (false, false) => f64::from(u8::from(i - r == j - n)),
            _ => 0.0,
        })
    }

    /// The system in `xi`, rounded.
    pub fn of(&self, dynamics: &Matrix, cost: &Matrix, process: &Matrix) -> Fewer {
        let rows = Wides::<WORDS>::new(&self.rows);
        let places = self.places(dynamics.cols);
        let moved = rows.times(&Wides::new(dynamics));
        let noise = rows.times(&Wides::new(process)).times(&rows.transpose()).symmetric();
        let (r, m) = (self.kept.len(), places.len());
        Fewer {
            dynamics: Matrix::from_fn(r, m, |i, j| moved.at(i, places[j]).rounded()),
            cost: Matrix::from_fn(m, m, |i, j| cost.at(places[i], places[j])),
            process: Matrix::from_fn(r, r, |i, j| noise.at(i, j).rounded()),
        }
    }

    /// A price in `xi`.
    pub fn price(&self, price: &Matrix) -> Matrix {
        let r = self.kept.len();
        Matrix::from_fn(r, r, |i, j| price.at(self.kept[i], self.kept[j]))
    }

    /// How far a system is from one that is exactly this in `xi`, so that the directions left out
    /// neither affect it nor cost anything: each entry relative to the terms it is summed from.
    pub fn distance(&self, fewer: &Fewer, dynamics: &Matrix, cost: &Matrix, process: &Matrix) -> f64 {
        let both = self.both(dynamics.cols);
        let moved = share(&self.rows, dynamics, &fewer.dynamics, &both);
        let paid = self.difference(cost, &fewer.cost, &both);
        let noise = {
            let half = Wides::<WORDS>::new(&self.rows).times(&Wides::new(process));
            let size = self.rows.abs().times(&process.abs()).times(&self.rows.transpose().abs());
            let whole = half.times(&Wides::new(&self.rows.transpose()));
            largest(&whole, &Wides::new(&fewer.process), &size)
        };
        moved.max(paid).max(noise)
    }

    /// The same of a price.
    pub fn price_distance(&self, price: &Matrix) -> f64 {
        self.difference(price, &self.price(price), &self.rows)
    }

    /// Relative distance of a quadratic form from one that depends on `rows z` alone.
    fn difference(&self, whole: &Matrix, fewer: &Matrix, rows: &Matrix) -> f64 {
        let wide = Wides::<WORDS>::new(rows);
        let form = wide.transpose().times(&Wides::new(fewer)).times(&wide);
        let of_form = rows.transpose().abs().times(&fewer.abs()).times(&rows.abs());
        let size = Matrix::from_fn(whole.rows, whole.cols, |i, j| of_form.at(i, j) + whole.at(i, j).abs());
        largest(&Wides::new(whole), &form, &size)
    }

    /// Whether the directions left out have exactly no effect on `xi`.
    pub fn is_exact(&self, dynamics: &Matrix, cost: &Matrix) -> bool {
        debug_assert_eq!(cost.rows, dynamics.cols);
        let of_states = |a: &Matrix| Matrix::from_fn(a.rows, self.rows.cols, |i, j| a.at(i, j));
        let beside = Wides::<WORDS>::new(&self.beside());
        let carried = Wides::new(&self.rows).times(&Wides::new(&of_states(dynamics))).times(&beside);
        let paid = Wides::new(&of_states(cost)).times(&beside);
        carried.entries.iter().chain(&paid.entries).all(|entry| entry.is_zero())
    }
}

/// Relative distance of `R F` from `F_xi diag(R, I)`.
fn share(rows: &Matrix, dynamics: &Matrix, fewer: &Matrix, both: &Matrix) -> f64 {
    let whole = Wides::<WORDS>::new(rows).times(&Wides::new(dynamics));
    let led = Wides::new(fewer).times(&Wides::new(both));
    let (one, two) = (rows.abs().times(&dynamics.abs()), fewer.abs().times(&both.abs()));
    let size = Matrix::from_fn(one.rows, one.cols, |i, j| one.at(i, j) + two.at(i, j));
    largest(&whole, &led, &size)
}

/// The largest difference of entries relative to their sizes.
fn largest(one: &Wides<WORDS>, other: &Wides<WORDS>, size: &Matrix) -> f64 {
    let mut largest = 0.0f64;
    for i in 0..size.rows {
        for j in 0..size.cols {
            let off: Wide<WORDS> = one.at(i, j) - other.at(i, j);
            if !off.is_zero() {
                let share = 1.01 * off.magnitude() / size.at(i, j) + ROUNDING;
                largest = if share.is_nan() { f64::INFINITY } else { largest.max(share) };
            }
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two masses on a line: their common position costs nothing, except for the last digit of a decimal.
    #[test]
    fn what_is_left_out_is_nothing_but_rounding() {
        let rows = Matrix { rows: 1, cols: 2, entries: vec![1.0, -1.0] };
        let quotient = Quotient::new(&rows).unwrap_or_else(|| panic!("no coordinates"));
        let cost = Matrix { rows: 3, cols: 3, entries: vec![1.0, -1.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, 0.5] };
        let of = |last: f64| Matrix { rows: 2, cols: 3, entries: vec![0.9, 0.1, 1.0, 0.3, last, 0.0] };
        let noise = Matrix::identity(2);
        for (last, low, high) in [(0.7, 0.0, 1e-15), (0.7 + 1e-9, 1e-10, 1e-9), (0.5, 0.05, 1.0)] {
            let fewer = quotient.of(&of(last), &cost, &noise);
            let found = quotient.distance(&fewer, &of(last), &cost, &noise);
            assert!((low..high).contains(&found), "{last}: {found:e}");
            assert!((fewer.dynamics.at(0, 0) - 0.6).abs() < 1e-15 && fewer.process.at(0, 0) == 2.0, "{fewer:?}");
        }
        let exact = Matrix { rows: 2, cols: 3, entries: vec![0.75, 0.25, 1.0, 0.5, 0.5, 0.0] };
        assert!(quotient.is_exact(&exact, &cost) && !quotient.is_exact(&of(0.7), &cost));
        assert!(Quotient::new(&Matrix { rows: 1, cols: 2, entries: vec![0.5, -1.0] }).is_none());
    }
}
