//! A problem in coordinates of a dual point, with enough digits that only the rounding to intervals remains.

use super::given::{Dual, DualStep, Given, next};
use super::interval::Interval;
use super::matrix::{Enclosure, Matrix};
use super::wide::Wide;
use super::wides::Wides;

/// The largest relative coupling allowed for coordinates that are left out.
const ROUNDING: f64 = 1e-9;

/// The number of words of each number when changing coordinates.
pub(super) const WORDS: usize = 2;

/// The unit of their rounding.
const UNIT: f64 = 1.0 / (1u128 << (64 * WORDS - 2)) as f64;

/// The problem in coordinates of the dual point.
pub(super) struct Frames {
    /// Each decision.
    pub locals: Vec<Local>,
    /// `X_0`; `None` if the only decision repeats.
    pub initial: Option<Enclosure>,
    /// Relative distance of these numbers from those given: 0 if no coordinate is left out.
    pub distance: f64,
}

/// One decision.
pub(super) struct Local {
    pub dynamics: Enclosure,
    pub process: Enclosure,
    pub price: Enclosure,
}

impl Frames {
    /// Transforms a problem to the coordinates of a dual point; otherwise the reason why that failed.
    pub fn new(given: &Given, dual: &Dual) -> Result<Self, String> {
        let count = given.stages.len();
        let mut distance = 0.0f64;
        let frames: Vec<Frame> =
            dual.steps.iter().enumerate().map(|(t, step)| Frame::new(step, t)).collect::<Result<_, _>>()?;
        let mut locals = Vec::with_capacity(count);
        for (t, stage) in given.stages.iter().enumerate() {
            let frame = &frames[t];
            let radius = stage.radius.clone().unwrap_or_else(|| Matrix::from_fn(0, 0, |_, _| 0.0));
            let all = Known::of(&stage.price, &radius);
            let price = frame.basis.transpose().times(&all).times(&frame.basis);
            distance = distance.max(frame.unpriced(&price, &stage.price));
            let r = frame.rank;
            let (dynamics, process) = match next(count, given.initial.is_none(), t) {
                None => (nothing(0, r), nothing(0, 0)),
                Some(to) => {
                    let to = &frames[to];
                    let carried = to.reader.times(&Known::exactly(&stage.dynamics)).times(&frame.basis);
                    distance = distance.max(to.left_out(&carried, frame, &stage.dynamics));
                    let noise = to.reader.around(&Known::exactly(&stage.process));
                    distance = distance.max(to.undriven(&noise, &stage.process));
                    (carried.enclosed().block(0..to.rank, 0..r), noise.enclosed().block(0..to.rank, 0..to.rank))
                }
            };
            locals.push(Local { dynamics, process, price: price.enclosed().block(0..r, 0..r) });
        }
        let initial = given.initial.as_ref().map(|initial| {
            let frame = &frames[0];
            let known = frame.reader.around(&Known::exactly(initial));
            distance = distance.max(frame.undriven(&known, initial));
            known.enclosed().block(0..frame.rank, 0..frame.rank)
        });
        if distance.is_nan() || distance > ROUNDING {
            return Err(format!("omitted coordinates are coupled to the others (relative coupling {distance:.1e})"));
        }
        Ok(Self { locals, initial, distance })
    }
}

fn nothing(rows: usize, cols: usize) -> Enclosure {
    Enclosure::from_fn(rows, cols, |_, _| Interval::ZERO)
}

/// A matrix of wide numbers, and how far each of its entries may be off.
struct Known {
    middle: Wides<WORDS>,
    off: Matrix,
}

impl Known {
    fn exactly(a: &Matrix) -> Self {
        Self { middle: Wides::new(a), off: Matrix::from_fn(a.rows, a.cols, |_, _| 0.0) }
    }

    /// With the errors given by `radius`, if any.
    fn of(a: &Matrix, radius: &Matrix) -> Self {
        if radius.rows == 0 { Self::exactly(a) } else { Self { middle: Wides::new(a), off: radius.clone() } }
    }

    fn times(&self, other: &Self) -> Self {
        let middle = self.middle.times(&other.middle);
        let (one, two) = (self.middle.magnitude(), other.middle.magnitude());
        let wide = Matrix::from_fn(two.rows, two.cols, |i, j| two.at(i, j) + other.off.at(i, j));
        // Each entry is a sum of rounded products, as many as `two` has rows.
        let rounding = 2.0 * (two.rows + 2) as f64 * UNIT;
        let (by_one, by_two, size) = (self.off.times(&wide), one.times(&other.off), one.times(&two));
        // These sums are rounded too.
        let off = Matrix::from_fn(one.rows, two.cols, |i, j| {
            1.01 * (by_one.at(i, j) + by_two.at(i, j) + rounding * size.at(i, j))
        });
        Self { middle, off }
    }

    fn transpose(&self) -> Self {
        Self { middle: self.middle.transpose(), off: self.off.transpose() }
    }

    /// `self middle self'`.
    fn around(&self, middle: &Self) -> Self {
        self.times(middle).times(&self.transpose())
    }

    fn enclosed(&self) -> Enclosure {
        self.middle.enclosed(&self.off)
    }

    /// The largest absolute value that an entry may have.
    fn magnitude(&self, i: usize, j: usize) -> f64 {
        (self.middle.at(i, j).magnitude() + self.off.at(i, j)).next_up()
    }
}

/// Coordinates `[E, N, C]`: of the dual point, those that do not affect the cost, and those that are known.
struct Frame {
    basis: Known,
    reader: Known,
    rank: usize,
    unseen: usize,
    /// Sizes of both, to compare with.
    basis_size: Matrix,
    reader_size: Matrix,
}

impl Frame {
    fn new(step: &DualStep, t: usize) -> Result<Self, String> {
        let both = step.basis.beside(&step.unseen);
        let whole = both.beside(&others(&both));
        if whole.rows != whole.cols {
            return Err(format!("the coordinates at decision {t} are not independent"));
        }
        let basis = Known::exactly(&whole);
        let reader =
            inverse(&basis).ok_or_else(|| format!("the coordinates at decision {t} are too close to singular"))?;
        let (basis_size, reader_size) = (whole.abs(), reader.middle.magnitude());
        Ok(Self { basis, reader, rank: step.basis.cols, unseen: step.unseen.cols, basis_size, reader_size })
    }

    /// How much of the price lies in coordinates that should have none.
    fn unpriced(&self, price: &Known, given: &Matrix) -> f64 {
        let sizes = self.basis_size.transpose().times(&given.abs()).times(&self.basis_size);
        let columns = self.rank..self.rank + self.unseen;
        share(price, &sizes, (0..sizes.rows).flat_map(|i| columns.clone().map(move |j| (i, j))))
    }

    /// How much of `E` and `N` at the previous step maps outside `E` and `N` here, and of `N` outside `N`.
    fn left_out(&self, carried: &Known, before: &Self, given: &Matrix) -> f64 {
        let sizes = self.reader_size.times(&given.abs()).times(&before.basis_size);
        let (here, there) = (self.rank + self.unseen, before.rank + before.unseen);
        let lost = (here..sizes.rows).flat_map(|i| (0..there).map(move |j| (i, j)));
        let seen = (0..self.rank).flat_map(|i| (before.rank..there).map(move |j| (i, j)));
        share(carried, &sizes, lost.chain(seen))
    }

    /// How much noise reaches the coordinates that count as known.
    fn undriven(&self, noise: &Known, given: &Matrix) -> f64 {
        let sizes = self.reader_size.times(&given.abs()).times(&self.reader_size.transpose());
        let kept = self.rank + self.unseen;
        share(noise, &sizes, (kept..sizes.rows).flat_map(|i| (0..sizes.cols).map(move |j| (i, j))))
    }
}

/// The largest of some entries relative to the largest terms summed in any: all coordinates have the same scale.
fn share(of: &Known, sizes: &Matrix, places: impl Iterator<Item = (usize, usize)>) -> f64 {
    let largest = sizes.entries.iter().fold(0.0, |a: f64, &b| a.max(b));
    let size = |(i, j): (usize, usize)| {
        if of.middle.at(i, j).is_zero() && of.off.at(i, j) == 0.0 { 0.0 } else { of.magnitude(i, j) }
    };
    let found = places.map(size).fold(0.0, |a, b| if b.is_nan() || b > a { b } else { a });
    if found == 0.0 { 0.0 } else { found / largest }
}

/// The inverse: `X + (I - R)^-1 R X` with `R = I - X G`; `None` if the inverse is not proved to exist.
fn inverse(g: &Known) -> Option<Known> {
    let n = g.off.rows;
    let identity = Wides::<WORDS>::identity(n);
    let near = Known { middle: g.middle.solve(&identity)?, off: g.off.clone() };
    let product = near.times(g);
    let minus_one = Wide::new(-1.0);
    let rest = product.middle.plus(&identity.scaled(minus_one));
    let rest = Matrix::from_fn(n, n, |i, j| {
        (rest.at(i, j).magnitude() * (1.0 + UNIT) + product.off.at(i, j) + UNIT).next_up()
    });
    let norm = 1.01 * (0..n).map(|i| (0..n).map(|j| rest.at(i, j)).sum::<f64>()).fold(0.0, f64::max);
    if norm.is_nan() || norm >= 0.5 {
        return None;
    }
    // 1 / (1 - |R|) is at most 2.
    let size = near.middle.magnitude();
    let first = rest.times(&size);
    let largest: Vec<f64> = (0..n).map(|j| (0..n).map(|i| size.at(i, j)).fold(0.0, f64::max)).collect();
    let off = Matrix::from_fn(n, n, |i, j| 1.01 * (first.at(i, j) + 2.0 * norm * norm * largest[j]));
    Some(Known { off, ..near })
}

/// Unit vectors that complete independent columns to a basis: one for each row that pivoted elimination does not use.
pub(super) fn others(columns: &Matrix) -> Matrix {
    let (n, r) = (columns.rows, columns.cols);
    let mut work = columns.clone();
    let sizes: Vec<f64> = (0..n).map(|i| (0..r).map(|j| work.at(i, j).abs()).fold(0.0, f64::max)).collect();
    for i in (0..n).filter(|&i| sizes[i] > 0.0) {
        (0..r).for_each(|j| work.set(i, j, work.at(i, j) / sizes[i]));
    }
    let mut used = vec![false; n];
    for k in 0..r {
        let free = (0..n).filter(|&i| !used[i]);
        let Some((row, col)) = free
            .flat_map(|i| (k..r).map(move |j| (i, j)))
            .max_by(|a, b| work.at(a.0, a.1).abs().total_cmp(&work.at(b.0, b.1).abs()))
        else {
            break;
        };
        used[row] = true;
        for i in 0..n {
            let (a, b) = (work.at(i, k), work.at(i, col));
            work.set(i, k, b);
            work.set(i, col, a);
        }
        let pivot = work.at(row, k);
        for j in k + 1..r {
            let factor = work.at(row, j) / pivot;
            for i in 0..n {
                work.set(i, j, work.at(i, j) - factor * work.at(i, k));
            }
        }
    }
    let free: Vec<usize> = (0..n).filter(|&i| !used[i]).collect();
    Matrix::from_fn(n, free.len(), |i, k| {
        if i != free[k] {
            0.0
        } else if sizes[i] > 0.0 {
            sizes[i]
        } else {
            1.0
        }
    })
}
