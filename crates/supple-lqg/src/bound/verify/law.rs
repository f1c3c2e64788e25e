//! Upper and lower bounds on the least expected cost of a linear system over a horizon with the state known, and the prices
//! of state uncertainty (theory, equation L.31), in as many digits as needed.

use super::elimination::{Elimination, Row, Symmetric, eliminated, gains};
use super::interval::Interval;
use super::matrix::{Enclosure, Matrix};
use super::wide::Wide;

/// `x+ = F z + w` of `z = (x, u)` with the cost `1/2 z' L z` at every step and `1/2 x' L_N x` at the end.
pub(crate) struct Along {
    /// `F_t = [A, B]`, n x (n + m), `L_t`, and `W_t`: N of them.
    pub steps: Vec<AlongStep>,
    /// `L_N`, n x n.
    pub last: Matrix,
    /// `X_0`.
    pub initial: Matrix,
    /// The cost that is incurred in any case, as an interval that covers rounding.
    pub nominal: Interval,
}

/// One step.
#[derive(Clone)]
pub(crate) struct AlongStep {
    pub dynamics: Matrix,
    pub cost: Matrix,
    pub process: Matrix,
}

/// Proved properties of the optimal law.
#[derive(Clone, Debug)]
pub(crate) struct Law {
    /// The least expected cost with the state known.
    pub least: Interval,
    /// `Theta_t`: every controller costs at least `sum Tr(Theta_t P_t)` more than the lower end of `least`.
    pub prices: Vec<Matrix>,
    /// Bounds on the distance of these entries from those for which that is proved.
    pub radii: Vec<Matrix>,
    /// Relative distance of the costs for which it is proved from those given: 0 unless the price of a control is, up to
    /// rounding, 0 or negative.
    pub distance: f64,
}

/// Why there is no law.
enum Failure {
    /// More digits may help.
    Digits,
    /// More digits may help, or the cost of the controls at this step is not convex.
    Indefinite(usize),
    Stopped,
}

/// The largest width at which the least cost counts as known, relative to the terms that it is summed from.
const SHARP: f64 = 1e-14;

/// Relative rounding error of an entry of a computed cost.
const ROUNDED: f64 = 4.0 * f64::EPSILON;

/// Multiplications of words that may be spent on more digits: a minute or so.
const MOST_WORK: f64 = 3e10;

/// The reason reported when the computation was stopped.
pub(super) const STOPPED: &str = "the computation was stopped";

/// The law, in 128 bits, or more if the bounds on the least cost differ; otherwise why it is not proved.
///
/// Semidefinite costs such as `q q'` are no longer so once their entries are rounded. If controls could lower such
/// a cost without limit, the law is that for the cost with its diagonal raised by as much as rounding can explain.
pub(crate) fn law(along: &Along, is_stopped: &dyn Fn() -> bool) -> Result<Law, String> {
    let (failure, reason) = match of_costs(along, is_stopped) {
        Ok(law) => return Ok(law),
        Err(found) => found,
    };
    if matches!(failure, Failure::Indefinite(_)) {
        let (raised, by) = along.raised();
        match of_costs(&raised, is_stopped) {
            Ok(law) => return Ok(Law { distance: law.distance.max(by), ..law }),
            Err((Failure::Stopped, stopped)) => return Err(stopped),
            Err(_) => {}
        }
    }
    Err(reason)
}

/// The law of the costs as they are.
fn of_costs(along: &Along, is_stopped: &dyn Fn() -> bool) -> Result<Law, (Failure, String)> {
    let joint = along.steps.first().map_or(0, |step| step.cost.rows);
    let mut last = (Failure::Digits, String::new());
    for words in widths(along.last.rows, joint, along.steps.len()) {
        let found = match words {
            2 => Sweep::<2>::run(along, is_stopped),
            4 => Sweep::<4>::run(along, is_stopped),
            16 => Sweep::<16>::run(along, is_stopped),
            _ => Sweep::<64>::run(along, is_stopped),
        };
        let failure = match found {
            Ok(law) => return Ok(law),
            Err(failure) => failure,
        };
        let reason = match failure {
            Failure::Stopped => return Err((failure, STOPPED.into())),
            Failure::Indefinite(t) => format!("the cost of the controls at step {t} is not convex"),
            Failure::Digits => {
                let bits = 64 * words;
                format!("the least cost is too sensitive to rounding: {bits} bits do not determine it")
            }
        };
        last = (failure, reason);
    }
    Err(last)
}

impl Along {
    /// The problem with the diagonal of every cost raised by what rounding of its entries may have removed, and by how much,
    /// relatively.
    fn raised(&self) -> (Self, f64) {
        let joint = self.steps.first().map_or(0, |step| step.cost.rows);
        let by = joint as f64 * ROUNDED;
        let raised = |cost: &Matrix| {
            Matrix::from_fn(
                cost.rows,
                cost.rows,
                |i, j| if i == j { cost.at(i, i) * (1.0 + by) } else { cost.at(i, j) },
            )
        };
        let step = |step: &AlongStep| AlongStep { cost: raised(&step.cost), ..step.clone() };
        let steps = self.steps.iter().map(step).collect();
        (Self { steps, last: raised(&self.last), initial: self.initial.clone(), nominal: self.nominal }, by)
    }
}

/// Numbers of words to try in sweeps: more if fewer do not suffice, as far as the work allows.
fn widths(n: usize, joint: usize, steps: usize) -> impl Iterator<Item = u32> {
    let products = 4.0 * (joint * joint * n * steps) as f64;
    [2, 4, 16, 64].into_iter().take_while(move |&words| words == 2 || products * f64::from(words * words) <= MOST_WORK)
}

/// A lower bound on `V`, where `x'Vx / 2` is the least cost of `steps` equal steps, whatever the final state; none if the
/// precision that [`law`] may use does not determine it.
///
/// # Errors
/// That it was stopped.
pub(super) fn paid_within(
    step: &AlongStep,
    steps: usize,
    is_stopped: &dyn Fn() -> bool,
) -> Result<Option<Enclosure>, String> {
    for words in widths(step.dynamics.rows, step.cost.rows, steps) {
        let found = match words {
            2 => Sweep::<2>::paid_within(step, steps, is_stopped),
            4 => Sweep::<4>::paid_within(step, steps, is_stopped),
            16 => Sweep::<16>::paid_within(step, steps, is_stopped),
            _ => Sweep::<64>::paid_within(step, steps, is_stopped),
        };
        match found {
            Ok(below) => return Ok(Some(below)),
            Err(Failure::Stopped) => return Err(STOPPED.into()),
            Err(Failure::Digits | Failure::Indefinite(_)) => {}
        }
    }
    Ok(None)
}

/// A sweep backwards from the end.
struct Sweep<const K: usize> {
    /// `S` as a lower bound on the cost-to-go of every controller, and as an upper bound on that of one controller.
    below: Symmetric<K>,
    above: Symmetric<K>,
    /// Twice the two bounds on the least cost, and the sums of the absolute values of their terms.
    sums: [Wide<K>; 2],
    sizes: [f64; 2],
    /// The largest entry that is left out, relatively.
    distance: f64,
}

impl<const K: usize> Sweep<K> {
    fn new(last: &Matrix) -> Self {
        let last = Symmetric::new(last);
        Self { below: last.clone(), above: last, sums: [Wide::ZERO; 2], sizes: [0.0; 2], distance: 0.0 }
    }

    fn paid_within(step: &AlongStep, steps: usize, is_stopped: &dyn Fn() -> bool) -> Result<Enclosure, Failure> {
        let n = step.dynamics.rows;
        let mut sweep = Self::new(&Matrix::from_fn(n, n, |_, _| 0.0));
        for t in (0..steps).rev() {
            if is_stopped() {
                return Err(Failure::Stopped);
            }
            sweep.back(step, t)?;
        }
        Ok(Enclosure::from_fn(n, n, |i, j| {
            let (low, high) = sweep.below.at(i, j).around(0.0);
            Interval { low, high }
        }))
    }

    fn run(along: &Along, is_stopped: &dyn Fn() -> bool) -> Result<Law, Failure> {
        let mut sweep = Self::new(&along.last);
        let (mut prices, mut radii) = (Vec::new(), Vec::new());
        for (t, step) in along.steps.iter().enumerate().rev() {
            if is_stopped() {
                return Err(Failure::Stopped);
            }
            sweep.add(&step.process);
            let (price, radius) = sweep.back(step, t)?;
            prices.push(price);
            radii.push(radius);
        }
        sweep.add(&along.initial);
        prices.reverse();
        radii.reverse();
        let least = sweep.least(along)?;
        Ok(Law { least, prices, radii, distance: sweep.distance })
    }

    /// Adds the cost of a covariance at this step to both bounds.
    fn add(&mut self, covariance: &Matrix) {
        for (side, s) in [&self.below, &self.above].into_iter().enumerate() {
            let (sum, size) = s.dot(covariance);
            self.sums[side] = self.sums[side] + sum;
            self.sizes[side] += size;
        }
    }

    /// The least cost as an interval, if its two bounds are close enough.
    fn least(&self, along: &Along) -> Result<Interval, Failure> {
        let count = (along.steps.len() + 1) * along.last.rows * along.last.rows;
        let half = Interval::point(0.5);
        let end = |side: usize| {
            // `count` terms, each a product and a sum.
            let slack = self.sizes[side] * unit::<K>() * (2 * count + 8) as f64;
            let (low, high) = self.sums[side].around(slack);
            Interval { low, high } * half + along.nominal
        };
        let (below, above) = (end(0), end(1));
        let least = Interval { low: below.low, high: above.high };
        let size = 0.5 * self.sizes[1] + along.nominal.magnitude();
        // More digits do not narrow the cost incurred in any case.
        let given = along.nominal.high - along.nominal.low;
        let is_sharp = least.high - least.low - given <= SHARP * size + f64::MIN_POSITIVE * 8.0;
        if is_sharp { Ok(least) } else { Err(Failure::Digits) }
    }

    /// One step back; returns the prices and their rounding errors.
    fn back(&mut self, step: &AlongStep, t: usize) -> Result<(Matrix, Matrix), Failure> {
        let (n, joint) = (step.dynamics.rows, step.cost.rows);
        let cost = Symmetric::new(&step.cost);
        let h = plus_carried(&cost, step, &self.below);
        let sizes = sizes(step, &self.below, None);
        // Each entry is a sum of at most this many rounded products.
        let terms = (n * n + 2 * joint + 16) as f64;
        if !is_finite(&sizes) {
            return Err(Failure::Digits);
        }
        // Subtract a little in every direction, to cover the rounding of all that follows.
        let lowered = Symmetric::from_fn(joint, |i, j| {
            if i == j { h.at(i, j) - margin::<K>(sizes.at(i, i), terms, joint) } else { h.at(i, j) }
        });
        let (rows, left, dropped) = eliminated(lowered, &sizes, n).map_err(|failure| match failure {
            Elimination::Undecided => Failure::Digits,
            Elimination::Negative => Failure::Indefinite(t),
        })?;
        self.distance = self.distance.max(dropped);
        let below = Symmetric::from_fn(n, |i, j| left.at(i, j));
        // The remainder `H - diag(S, 0) - U' c U` must be positive semidefinite.
        let rest = |i: usize, j: usize| {
            let mut sum = if i < n && j < n { h.at(i, j) - below.at(i, j) } else { h.at(i, j) };
            for row in &rows {
                sum = sum - row.entries[i] * row.entries[j] * row.weight;
            }
            sum
        };
        let used = |i: usize| i < n || rows.iter().any(|row| row.control == i);
        let taken = Matrix::from_fn(joint, joint, |i, j| {
            let of_row =
                |row: &Row<K>| row.entries[i].magnitude() * row.entries[j].magnitude() * row.weight.magnitude() * 1.01;
            rows.iter().map(of_row).sum::<f64>()
        });
        let squares = Matrix::from_fn(joint, joint, |i, j| {
            let kept = if i < n && j < n { below.at(i, j).magnitude() } else { 0.0 };
            1.01 * (sizes.at(i, j) + taken.at(i, j) + kept)
        });
        let kept: Vec<usize> = (0..joint).filter(|&i| used(i)).collect();
        if !is_finite(&squares) || !is_dominated(&kept, rest, |i, j| error::<K>(squares.at(i, j), terms)) {
            return Err(Failure::Digits);
        }
        // The regulator given by these rows, and its cost.
        let gains = gains(&rows, n, joint);
        let above = self.paid(&cost, step, &gains).ok_or(Failure::Digits)?;
        let half = Wide::power_of_two(-1);
        let exact = Symmetric::from_fn(n, |i, j| {
            rows.iter().fold(Wide::ZERO, |sum, row| sum + row.entries[i] * row.entries[j] * row.weight) * half
        });
        let price = Matrix::from_fn(n, n, |i, j| exact.at(i, j).rounded());
        let radius = Matrix::from_fn(n, n, |i, j| {
            let off = (exact.at(i, j) - Wide::new(price.at(i, j))).abs() + error(taken.at(i, j), terms);
            off.magnitude()
        });
        (self.below, self.above) = (below, above);
        Ok((price, radius))
    }

    /// The cost-to-go of a law: `[I; K]' (L + F' S F) [I; K]`, rounded up.
    fn paid(&self, cost: &Symmetric<K>, step: &AlongStep, gains: &[Vec<Wide<K>>]) -> Option<Symmetric<K>> {
        let (n, joint) = (step.dynamics.rows, step.cost.rows);
        let h = plus_carried(cost, step, &self.above);
        // `H [I; K]`.
        let half: Vec<Vec<Wide<K>>> = (0..joint)
            .map(|i| (0..n).map(|j| (n..joint).fold(h.at(i, j), |sum, k| sum + h.at(i, k) * gains[k - n][j])).collect())
            .collect();
        let sum =
            Symmetric::from_fn(n, |i, j| (n..joint).fold(half[i][j], |sum, k| sum + gains[k - n][i] * half[k][j]));
        let terms = (n * n + 2 * joint * joint + 16) as f64;
        let sizes = sizes(step, &self.above, Some(gains));
        let raised = |i: usize, j: usize| {
            if i == j { margin::<K>(sizes.at(i, i), terms, joint) } else { Wide::ZERO }
        };
        let all: Vec<usize> = (0..n).collect();
        let holds = is_finite(&sizes) && is_dominated(&all, raised, |i, j| error::<K>(sizes.at(i, j), terms));
        holds.then(|| Symmetric::from_fn(n, |i, j| sum.at(i, j) + raised(i, j)))
    }
}

/// The unit of rounding, a power of 2; 0 if it is below the range of floating-point numbers.
fn unit<const K: usize>() -> f64 {
    2f64.powi(2 - 64 * K.min(16) as i32)
}

/// An upper bound on the error of an entry summed from absolute values of this size.
fn error<const K: usize>(size: f64, terms: f64) -> Wide<K> {
    Wide::new(size * terms) * Wide::power_of_two(2 - 64 * K as i64)
}

/// The change of a diagonal entry that covers the errors of all entries in its row, with a large margin.
fn margin<const K: usize>(size: f64, terms: f64, joint: usize) -> Wide<K> {
    error(64.0 * size * (joint * joint) as f64, terms)
}

fn is_finite(a: &Matrix) -> bool {
    a.entries.iter().all(|entry| entry.is_finite())
}

/// `L + F' S F`.
fn plus_carried<const K: usize>(cost: &Symmetric<K>, step: &AlongStep, s: &Symmetric<K>) -> Symmetric<K> {
    let (n, joint, f) = (step.dynamics.rows, step.cost.rows, &step.dynamics);
    let mut moved = vec![Wide::<K>::ZERO; n * joint];
    for i in 0..n {
        for k in 0..n {
            let factor = s.at(i, k);
            if factor.is_zero() {
                continue;
            }
            for j in (0..joint).filter(|&j| f.at(k, j) != 0.0) {
                moved[i * joint + j] = moved[i * joint + j] + factor * Wide::new(f.at(k, j));
            }
        }
    }
    let mut h = cost.clone();
    for k in 0..n {
        for i in (0..joint).filter(|&i| f.at(k, i) != 0.0) {
            let factor = Wide::new(f.at(k, i));
            for j in 0..=i {
                let term = factor * moved[k * joint + j];
                if !term.is_zero() {
                    h.set(i, j, h.at(i, j) + term);
                }
            }
        }
    }
    h
}

/// Upper bounds on the sums of absolute values of the terms in the entries of `L + F' S F`, or of
/// `[I; K]' (L + F' S F) [I; K]`.
fn sizes<const K: usize>(step: &AlongStep, s: &Symmetric<K>, gains: Option<&[Vec<Wide<K>>]>) -> Matrix {
    let (n, joint) = (step.dynamics.rows, step.cost.rows);
    let (f, s) = (step.dynamics.abs(), Matrix::from_fn(n, n, |i, j| s.at(i, j).magnitude()));
    let carried = f.transpose().times(&s).times(&f);
    let cost = step.cost.abs();
    let h = Matrix::from_fn(joint, joint, |i, j| 1.01 * (carried.at(i, j) + cost.at(i, j).max(cost.at(j, i))));
    let Some(gains) = gains else { return h };
    let wide =
        Matrix::from_fn(joint, n, |i, j| if i < n { f64::from(u8::from(i == j)) } else { gains[i - n][j].magnitude() });
    let all = wide.transpose().times(&h).times(&wide);
    Matrix::from_fn(n, n, |i, j| 1.01 * all.at(i, j))
}

/// Whether every symmetric matrix within these errors of the given one is positive semidefinite: its diagonal must dominate
/// all other entries in its row, once scaled to a diagonal of about 1.
fn is_dominated<const K: usize>(
    kept: &[usize],
    entry: impl Fn(usize, usize) -> Wide<K>,
    error: impl Fn(usize, usize) -> Wide<K>,
) -> bool {
    let diagonal: Vec<Wide<K>> = kept.iter().map(|&i| entry(i, i) - error(i, i)).collect();
    // Beside a diagonal entry of exactly 0, all entries must be exactly 0.
    let is_nothing = |i: usize| entry(i, i).is_zero() && error(i, i).is_zero();
    // `d_i = 1 / sqrt(e_ii)`, as a power of 2.
    let exponents: Vec<i64> = diagonal.iter().map(|d| -d.exponent().div_euclid(2)).collect();
    kept.iter().enumerate().all(|(a, &i)| {
        let beside = |(b, &j): (usize, &usize)| {
            let (row, col) = if i > j { (i, j) } else { (j, i) };
            (entry(row, col).abs() + error(row, col)) * Wide::power_of_two(exponents[a] + exponents[b])
        };
        if is_nothing(i) {
            return kept.iter().enumerate().filter(|(b, _)| *b != a).all(|one| beside(one).is_zero());
        }
        let sum = kept.iter().enumerate().filter(|(b, _)| *b != a).map(beside).fold(Wide::ZERO, |sum, one| sum + one);
        // Twice the sum, to allow for rounding in the sum itself.
        (diagonal[a] * Wide::power_of_two(2 * exponents[a]) - sum * Wide::new(2.0)).is_positive()
    })
}
