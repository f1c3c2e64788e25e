//! The optimal regulator of a time-invariant system, in as many digits as necessary (theory, equations L.14 and L.31).

use super::elimination::{Row, Symmetric, eliminated, gains};
use super::matrix::Matrix;
use super::riccati::Steps;
use super::wide::Wide;
use super::wides::Wides;

/// Maximum number of doublings, and the usual number.
const DOUBLINGS: usize = 110;
const MOSTLY: usize = 40;

/// The limit is reached when the last doubling changes the cost of no state by more than these powers of 2, relatively:
/// to stop at once, and to accept when doublings or digits are exhausted.
const EXACT: i32 = -100;
const STEADY: i32 = -36;

/// A cost that exceeds that of the first steps by this power of 2 grows without limit.
const UNBOUNDED: i64 = 400;

/// Entries below this power of 2, per word, relative to the terms that they are summed from, are 0.
const NOTHING: i32 = -32;

/// The same for the cost of a state relative to that of the most expensive one.
const FREE: i32 = -44;

/// How far, relatively, the cost is from one for which the law is exact and every price is paid.
pub(super) const ROUNDING: f64 = 1e-8;

/// Multiplications of words that may be spent on more digits: some seconds.
const MOST_WORK: f64 = 3e9;

/// The optimal regulator of `x+ = F z + w` with the cost `1/2 z' L z` per step of `z = (x, u)`.
pub(crate) struct SteadyLaw {
    /// `S`: `x'Sx / 2` is the cost-to-go of a state beyond the average cost.
    pub s: Matrix,
    /// `Theta`: the cost of state uncertainty.
    pub price: Matrix,
    /// `1/2 Tr(S W)`: the cost per step with the state known.
    pub least: f64,
    /// States that never cost anything, known or not, by columns.
    pub unpriced: Matrix,
}

/// Why there is no regulator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unsettled {
    /// Its cost grows without limit, or has not converged after the maximum number of steps.
    Grows,
    /// Rounding leaves it unknown.
    Digits,
    /// The computation was stopped.
    Stopped,
}

/// The optimal regulator: the limit of the laws of ever longer horizons without a cost at their end.
pub(crate) fn steady_law(
    dynamics: &Matrix,
    cost: &Matrix,
    process: &Matrix,
    is_stopped: &dyn Fn() -> bool,
) -> Result<SteadyLaw, Unsettled> {
    let of = |words| match words {
        4 => Regulated::<4>::least(dynamics, cost, is_stopped).map(|found| found.rounded(process)),
        16 => Regulated::<16>::least(dynamics, cost, is_stopped).map(|found| found.rounded(process)),
        _ => Regulated::<64>::least(dynamics, cost, is_stopped).map(|found| found.rounded(process)),
    };
    first(widths(dynamics), of)
}

/// The result with the fewest words that determine it.
pub(super) fn first<T>(
    mut widths: impl Iterator<Item = u32>,
    of: impl Fn(u32) -> Result<T, Unsettled>,
) -> Result<T, Unsettled> {
    let found = widths.find_map(|words| match of(words) {
        Err(Unsettled::Digits) => None,
        found => Some(found),
    });
    found.unwrap_or(Err(Unsettled::Digits))
}

pub(super) fn widths(dynamics: &Matrix) -> impl Iterator<Item = u32> {
    let (n, joint) = (dynamics.rows, dynamics.cols);
    let products = (10 * MOSTLY * n * n * joint) as f64;
    [4, 16, 64].into_iter().take_while(move |&words| words == 4 || products * f64::from(words * words) <= MOST_WORK)
}

/// A system with an `S` that one step back maps to itself, up to rounding.
pub(super) struct Regulated<'a, const K: usize> {
    pub dynamics: &'a Matrix,
    /// `L` as given.
    pub given: &'a Matrix,
    /// `L`, made semidefinite despite rounding.
    pub cost: Wides<K>,
    pub s: Wides<K>,
    /// `L + F'S F`, and the sums of absolute values of the terms of its entries.
    form: Wides<K>,
    sizes: Matrix,
    /// The rows of `U' c U` for the controls, and the remainder of the form.
    pub rows: Vec<Row<K>>,
    left: Wides<K>,
}

impl<'a, const K: usize> Regulated<'a, K> {
    /// One step back from `S`; `None` if rounding decides which controls have a price.
    pub fn at(dynamics: &'a Matrix, given: &'a Matrix, s: Wides<K>) -> Option<Self> {
        let (n, joint) = (dynamics.rows, dynamics.cols);
        let cost = semidefinite(given);
        let f = Wides::new(dynamics);
        let form = cost.plus(&f.transpose().times(&s.times(&f))).symmetric();
        let f = dynamics.abs();
        let carried = f.transpose().times(&s.magnitude()).times(&f);
        let of_cost = given.abs();
        let sizes =
            Matrix::from_fn(joint, joint, |i, j| 1.01 * (carried.at(i, j) + of_cost.at(i, j).max(of_cost.at(j, i))));
        if !sizes.entries.iter().all(|size| size.is_finite()) {
            return None;
        }
        let (mut rows, left, _) = eliminated(Symmetric::from_fn(joint, |i, j| form.at(i, j)), &sizes, n).ok()?;
        // What cancels is 0.
        let kept = |entry: Wide<K>, i: usize, j: usize| {
            let size = sizes.at(i, i).sqrt() * sizes.at(j, j).sqrt();
            if entry.magnitude() <= size * nothing::<K>() { Wide::ZERO } else { entry }
        };
        for row in &mut rows {
            row.entries = row.entries.iter().enumerate().map(|(j, &entry)| kept(entry, row.control, j)).collect();
        }
        let left = Wides::from_fn(n, n, |i, j| kept(left.at(i, j), i, j));
        Some(Self { dynamics, given, cost, s, form, sizes, rows, left })
    }

    /// The limit of steps from 0: as many steps as there are states give every control its price; from there on
    /// their number is doubled.
    pub fn least(dynamics: &'a Matrix, given: &'a Matrix, is_stopped: &dyn Fn() -> bool) -> Result<Self, Unsettled> {
        let n = dynamics.rows;
        let go_on = || if is_stopped() { Err(Unsettled::Stopped) } else { Ok(()) };
        let step = |s| go_on().and_then(|()| Self::at(dynamics, given, s).ok_or(Unsettled::Digits));
        let mut here = step(Wides::from_fn(n, n, |_, _| Wide::ZERO))?;
        for _ in 0..n {
            here = step(here.left)?;
        }
        let (a, g) = here.closed_loop().ok_or(Unsettled::Digits)?;
        let q = here.left.plus(&here.s.scaled(-Wide::power_of_two(0)));
        let mut steps = Steps::new(a, g, q);
        let most = |s: &Wides<K>| (0..n).map(|i| s.at(i, i)).filter(|s| s.is_positive()).map(Wide::exponent).max();
        let first = most(&here.left).unwrap_or(0);
        let mut change = f64::INFINITY;
        for _ in 0..DOUBLINGS {
            go_on()?;
            let next = steps.twice().ok_or(Unsettled::Digits)?;
            // More growth than this loses the digits of entries that are 0.
            if next.growth() > 6 * i64::from(K as u32) {
                break;
            }
            let total = here.s.plus(&next.from_zero);
            let nothing = free::<K>(&total);
            if most(&total).is_some_and(|most| most > first.max(0) + UNBOUNDED) {
                return Err(Unsettled::Grows);
            }
            let share = |i: usize| {
                let more = (next.from_zero.at(i, i) - steps.from_zero.at(i, i)).magnitude();
                if more <= nothing { 0.0 } else { more / total.at(i, i).magnitude() }
            };
            change = (0..n).map(share).fold(0.0, f64::max);
            steps = next;
            if change <= 2f64.powi(EXACT) {
                break;
            }
        }
        if change <= 2f64.powi(STEADY) {
            let s = here.s.plus(&steps.from_zero);
            let nothing = free::<K>(&s);
            let costs = |i: usize| s.at(i, i).magnitude() > nothing;
            let s = Wides::from_fn(n, n, |i, j| if costs(i) && costs(j) { s.at(i, j) } else { Wide::ZERO });
            return step(step(s)?.left);
        }
        // More digits might make up for those lost to growth.
        Err(if steps.growth() > 2 * i64::from(K as u32) { Unsettled::Digits } else { Unsettled::Grows })
    }

    /// `A + B K`, and `B (Q_uu)^-1 B'`, for the controls that have a price.
    fn closed_loop(&self) -> Option<(Wides<K>, Wides<K>)> {
        let n = self.dynamics.rows;
        let a = Wides::from_fn(n, n, |i, j| Wide::new(self.dynamics.at(i, j)));
        let used: Vec<usize> = self.rows.iter().map(|row| row.control).collect();
        let b = Wides::from_fn(n, used.len(), |i, k| Wide::new(self.dynamics.at(i, used[k])));
        let prices = Wides::from_fn(used.len(), used.len(), |i, j| self.form.at(used[i], used[j]));
        let along = Wides::from_fn(used.len(), n, |i, j| self.form.at(used[i], j));
        let both = prices.solve(&along.beside(&b.transpose()))?;
        let removed = b.times(&both.columns(0, n)).scaled(-Wide::power_of_two(0));
        Some((a.plus(&removed), b.times(&both.columns(n, n)).symmetric()))
    }

    /// `u = K x`, one row for each control.
    pub fn gains(&self) -> Wides<K> {
        let (n, joint) = (self.dynamics.rows, self.dynamics.cols);
        let gains = gains(&self.rows, n, joint);
        Wides::from_fn(joint - n, n, |i, j| gains[i][j])
    }

    /// `1/2 U_x' c U_x`.
    fn price(&self, i: usize, j: usize) -> Wide<K> {
        let sum = self.rows.iter().fold(Wide::ZERO, |sum, row| sum + row.entries[i] * row.entries[j] * row.weight);
        sum * Wide::power_of_two(-1)
    }

    /// The geometric mean of the sizes of two diagonal entries.
    fn size(&self, i: usize, j: usize) -> f64 {
        self.sizes.at(i, i).sqrt() * self.sizes.at(j, j).sqrt()
    }

    pub fn rounded(&self, process: &Matrix) -> SteadyLaw {
        let n = self.dynamics.rows;
        let round = |entry: Wide<K>, size: f64| {
            if entry.magnitude() <= size * nothing::<K>() { 0.0 } else { entry.rounded() }
        };
        let (mut sum, mut size) = (Wide::ZERO, 0.0);
        for i in 0..n {
            for j in 0..n {
                sum = sum + self.s.at(i, j) * Wide::new(process.at(i, j));
                size += self.size(i, j) * process.at(i, j).abs();
            }
        }
        SteadyLaw {
            s: Matrix::from_fn(n, n, |i, j| round(self.s.at(i, j), self.size(i, j))),
            price: Matrix::from_fn(n, n, |i, j| round(self.price(i, j), self.size(i, j))),
            least: round(sum * Wide::power_of_two(-1), size),
            unpriced: self.unpriced(),
        }
    }

    /// States `x` with `U_x A^k x = 0` for all `k`, as columns: the null space of these rows after Gauss-Jordan
    /// elimination.
    fn unpriced(&self) -> Matrix {
        let n = self.dynamics.rows;
        let a = Wides::from_fn(n, n, |i, j| Wide::new(self.dynamics.at(i, j)));
        let mut waiting: Vec<Vec<Wide<K>>> = self.rows.iter().map(|row| row.entries[..n].to_vec()).collect();
        let mut reduced: Vec<(usize, Vec<Wide<K>>)> = Vec::new();
        let minus = |row: &[Wide<K>], place: usize, by: &[Wide<K>]| -> Vec<Wide<K>> {
            let factor = row[place];
            let taken = row.iter().zip(by).map(|(&entry, &by)| {
                let (term, size) = (factor * by, entry.magnitude());
                let left = entry - term;
                let cancels = left.magnitude() <= (size + term.magnitude()) * nothing::<K>();
                if cancels { Wide::ZERO } else { left }
            });
            taken.collect()
        };
        while let Some(mut row) = waiting.pop() {
            for (place, by) in &reduced {
                row = minus(&row, *place, by);
            }
            let Some(place) = (0..n).max_by_key(|&j| if row[j].is_zero() { i64::MIN } else { row[j].exponent() })
            else {
                break;
            };
            if row[place].is_zero() {
                continue;
            }
            let by = row[place].inverse();
            let one: Vec<Wide<K>> = row
                .iter()
                .enumerate()
                .map(|(j, &entry)| if j == place { Wide::power_of_two(0) } else { entry * by })
                .collect();
            for (_, other) in &mut reduced {
                *other = minus(other, place, &one);
            }
            let row = Wides::from_fn(1, n, |_, j| one[j]);
            waiting.push(row.times_without_rounding(&a, nothing::<K>()).entries);
            reduced.push((place, one));
        }
        let free: Vec<usize> = (0..n).filter(|j| reduced.iter().all(|(place, _)| place != j)).collect();
        Matrix::from_fn(n, free.len(), |i, k| match reduced.iter().find(|(place, _)| *place == i) {
            Some((_, row)) => -row[free[k]].rounded(),
            None => f64::from(u8::from(i == free[k])),
        })
    }

    /// The relative change of `L` after which `L + F'S F - diag(S, 0) = U' c U` and `Theta = 1/2 U_x' c U_x` hold
    /// exactly: then every controller costs at least `1/2 Tr(W S) + Tr(Theta P)` per step, beyond the change of `x'Sx / 2`.
    pub fn distance(&self, price: &Matrix) -> Result<f64, String> {
        let (n, joint) = (self.dynamics.rows, self.dynamics.cols);
        let words = i32::try_from(K.min(15)).unwrap_or(15);
        let rounding = (n * n + 2 * joint + 16) as f64 * 2f64.powi(6 - 64 * words);
        let mut worst = 0.0f64;
        let mut count = |off: Wide<K>, i: usize, j: usize| {
            let of_s = |i: usize| if i < n { self.s.at(i, i).magnitude() } else { 0.0 };
            let size = ((self.sizes.at(i, i) + of_s(i)) * (self.sizes.at(j, j) + of_s(j))).sqrt();
            if !off.is_zero() || size > 0.0 {
                let share = off.magnitude() / size + rounding;
                worst = if share.is_nan() { f64::INFINITY } else { worst.max(share) };
            }
        };
        for i in 0..joint {
            for j in 0..joint {
                let taken =
                    self.rows.iter().fold(Wide::ZERO, |sum, row| sum + row.entries[i] * row.entries[j] * row.weight);
                let here = if i < n && j < n { self.s.at(i, j) } else { Wide::ZERO };
                count(self.form.at(i, j) - here - taken, i, j);
                let given = (Wide::new(self.given.at(i, j)) + Wide::new(self.given.at(j, i))) * Wide::power_of_two(-1);
                count(given - self.cost.at(i, j), i, j);
                if i < n && j < n {
                    count(self.price(i, j) - Wide::new(price.at(i, j)), i, j);
                }
            }
        }
        if worst > ROUNDING {
            return Err(format!("the relative residual of the Riccati equation is {worst:.1e}"));
        }
        Ok(worst)
    }
}

/// A cost without the directions that cost something only by rounding: `sum row row' / pivot` of its rows. A cost that is
/// exactly semidefinite stays as it is.
fn semidefinite<const K: usize>(given: &Matrix) -> Wides<K> {
    let n = given.rows;
    let whole = Wides::<K>::new(given).symmetric();
    let (mut left, mut kept) = (whole.clone(), Wides::from_fn(n, n, |_, _| Wide::ZERO));
    let mut free: Vec<usize> = (0..n).collect();
    let share = |left: &Wides<K>, i: usize| {
        if whole.at(i, i).is_positive() { left.at(i, i).rounded() / whole.at(i, i).rounded() } else { 0.0 }
    };
    while let Some(place) = (0..free.len()).max_by(|&a, &b| share(&left, free[a]).total_cmp(&share(&left, free[b]))) {
        let k = free.swap_remove(place);
        if share(&left, k) <= 16.0 * n as f64 * f64::EPSILON {
            break;
        }
        let by = left.at(k, k).inverse();
        let taken = Wides::from_fn(n, n, |i, j| left.at(i, k) * left.at(k, j) * by);
        kept = kept.plus(&taken);
        left = left.plus(&taken.scaled(-Wide::power_of_two(0)));
    }
    // An exact one would be rounded in its last digits; keep it as it is.
    let is_exact = (0..n * n).all(|place| {
        let size = (whole.at(place / n, place / n) * whole.at(place % n, place % n)).magnitude().sqrt();
        left.entries[place].magnitude() <= size * nothing::<K>()
    });
    if is_exact { whole } else { kept }
}

/// States that cost less than this count as costing nothing, whatever their units.
fn free<const K: usize>(s: &Wides<K>) -> f64 {
    let largest = (0..s.rows).map(|i| s.at(i, i).magnitude()).fold(0.0, f64::max);
    largest * 2f64.powi(FREE * i32::try_from(K.min(20)).unwrap_or(20))
}

/// Entries below this share of the terms that they are summed from count as 0.
pub(super) fn nothing<const K: usize>() -> f64 {
    2f64.powi(NOTHING * i32::try_from(K.min(24)).unwrap_or(24))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(rows: usize, entries: &[f64]) -> Matrix {
        Matrix { rows, cols: entries.len() / rows, entries: entries.to_vec() }
    }

    /// The control costs nothing and a zero of the plant lies outside of the unit circle: at the least cost the states grow.
    #[test]
    fn states_may_grow_where_that_costs_nothing() {
        // c'x = 0 for ever from the second step on: x2+ = 1.9 x2 there.
        let dynamics = of(2, &[0.0, 1.0, 0.0, 0.3, -0.7, 1.1]);
        let c = [-1.9 * 0.7, 0.7, 0.0];
        let cost = Matrix::from_fn(3, 3, |i, j| c[i] * c[j]);
        let law = steady_law(&dynamics, &cost, &Matrix::identity(2), &|| false).unwrap_or_else(|why| panic!("{why:?}"));
        for i in 0..2 {
            for j in 0..2 {
                assert!((law.s.at(i, j) - c[i] * c[j]).abs() < 1e-15, "{:?}", law.s);
            }
        }
        assert!((law.least - 0.5 * (c[0] * c[0] + c[1] * c[1])).abs() < 1e-15, "{}", law.least);
    }

    #[test]
    fn a_walk_that_costs_and_that_no_control_moves_has_no_law() {
        let (dynamics, cost) = (of(1, &[1.0, 0.0]), of(2, &[1.0, 0.0, 0.0, 1.0]));
        let law = steady_law(&dynamics, &cost, &Matrix::identity(1), &|| false);
        assert!(law.is_err_and(|why| why == Unsettled::Grows));
    }

    /// A state that never costs anything, in other coordinates: not even rounding gives it a price.
    #[test]
    fn states_that_cost_nothing_have_no_price() {
        // z1+ = .75 z1 + u, z2+ = 3 z2 + z1; only z1 costs; x = (z1 + z2, z2).
        let dynamics = of(2, &[1.75, 1.25, 1.0, 1.0, 2.0, 0.0]);
        let cost = of(3, &[1.0, -1.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, 0.25]);
        let law = steady_law(&dynamics, &cost, &Matrix::identity(2), &|| false).unwrap_or_else(|why| panic!("{why:?}"));
        assert!(law.price.at(0, 0) > 0.1, "{:?}", law.price);
        for entries in [&law.price.entries, &law.s.entries] {
            assert!(entries[1] == -entries[0] && entries[3] == entries[0], "{entries:?}");
        }
        assert_eq!((law.unpriced.cols, &law.unpriced.entries[..]), (1, &[1.0, 1.0][..]));
    }
}
