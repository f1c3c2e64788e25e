//! That a point of the dual proves a lower bound of the least information (theory, equation L.30).

use supple_kernels::halt;

use super::interval::Interval;
use super::matrix::{Enclosure, Matrix, enclosed, inverse};

/// A problem as given: `x+ = A x + w` over T decisions, or one that repeats, and what not knowing the state costs.
pub(crate) struct Given {
    /// `A_t`, `W_t` after each decision, and `Theta_t`: T of them.
    pub stages: Vec<Stage>,
    /// `X_0`; none where the only stage repeats for ever.
    pub initial: Option<Matrix>,
    /// What the covariances may cost.
    pub budget: Interval,
}

/// One decision.
pub(crate) struct Stage {
    pub dynamics: Matrix,
    pub process: Matrix,
    pub price: Matrix,
}

/// A point of the dual.
pub(crate) struct Dual {
    /// Nats per cost.
    pub price: f64,
    pub steps: Vec<DualStep>,
}

/// That of one decision.
pub(crate) struct DualStep {
    /// `E`, n x r: the covariance beside it is `E E'`.
    pub basis: Matrix,
    /// States that no price ever sees, n x k.
    pub unseen: Matrix,
    /// The multiplier of `P <= Pbar` in coordinates of `E`, r x r.
    pub multiplier: Matrix,
}

/// What is proved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Proved {
    /// Nats, over all decisions, that any sensors and any controller need at least.
    pub nats: f64,
    /// How far, relatively, the numbers that it is proved for are from those given: 0 where no coordinate is left out.
    pub distance: f64,
}

/// Shares by which the covariance is enlarged so that slopes are positive in spite of rounding.
const ENLARGED: [f64; 8] = [0.0, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2];

/// Couplings of coordinates that are left out may be this large, relatively.
const ROUNDING: f64 = 1e-9;

/// The problem in coordinates of the dual point.
struct Local {
    dynamics: Enclosure,
    process: Enclosure,
    price: Enclosure,
    multiplier: Enclosure,
}

/// The best bound that the point proves, or why it proves none.
pub(crate) fn information(given: &Given, dual: &Dual) -> Result<Proved, String> {
    if given.stages.len() != dual.steps.len() || given.stages.is_empty() {
        return Err("the dual point has the wrong number of decisions".into());
    }
    let (locals, initial, distance) = localise(given, dual)?;
    if !(dual.price >= 0.0 && dual.price.is_finite()) {
        return Err("the multiplier of the cost is negative".into());
    }
    if let Some(t) = locals.iter().position(|local| !local.multiplier.is_positive_semidefinite()) {
        return Err(format!("the multiplier at decision {t} is not proved to be positive semidefinite"));
    }
    let mut best: Option<f64> = None;
    for share in ENLARGED {
        match value(given, &locals, initial.as_ref(), dual.price, share) {
            Ok(nats) if best.is_none_or(|best| nats > best) => best = Some(nats),
            Ok(_) => break,
            Err(_) if best.is_some() => break,
            Err(_) => {}
        }
    }
    match best {
        Some(nats) => Ok(Proved { nats: nats.max(0.0), distance }),
        None => value(given, &locals, initial.as_ref(), dual.price, 0.0).map(|nats| Proved { nats, distance }),
    }
}

/// Nothing is proved once a stop is requested.
fn check_stop() -> Result<(), String> {
    if halt::is_requested() { Err("stopped".into()) } else { Ok(()) }
}

/// Which step follows.
fn next(count: usize, repeats: bool, t: usize) -> Option<usize> {
    if repeats { Some(0) } else { (t + 1 < count).then_some(t + 1) }
}

type Localised = (Vec<Local>, Option<Enclosure>, f64);

fn localise(given: &Given, dual: &Dual) -> Result<Localised, String> {
    let count = given.stages.len();
    let mut distance = 0.0f64;
    let frames: Vec<Frame> =
        dual.steps.iter().enumerate().map(|(t, step)| Frame::new(step, t)).collect::<Result<_, _>>()?;
    let mut locals = Vec::with_capacity(count);
    for (t, (stage, step)) in given.stages.iter().zip(&dual.steps).enumerate() {
        check_stop()?;
        let (frame, all) = (&frames[t], enclosed(&stage.price));
        let whole = frame.basis.transpose();
        let price = whole.times(&all).times(&frame.basis);
        distance = distance.max(frame.unpriced(&price, &stage.price));
        let r = frame.rank;
        let (dynamics, process) = match next(count, given.initial.is_none(), t) {
            None => (Enclosure::from_fn(0, r, |_, _| Interval::ZERO), Enclosure::from_fn(0, 0, |_, _| Interval::ZERO)),
            Some(to) => {
                let to = &frames[to];
                let carried = to.reader.times(&enclosed(&stage.dynamics).times(&frame.basis));
                distance = distance.max(to.left_out(&carried, frame, &stage.dynamics));
                let noise = to.reader.around(&enclosed(&stage.process));
                distance = distance.max(to.undriven(&noise, &stage.process));
                (carried.block(0..to.rank, 0..r), noise.block(0..to.rank, 0..to.rank))
            }
        };
        let multiplier = enclosed(&step.multiplier);
        locals.push(Local { dynamics, process, price: price.block(0..r, 0..r), multiplier });
    }
    let initial = given.initial.as_ref().map(|initial| {
        let frame = &frames[0];
        let known = frame.reader.around(&enclosed(initial));
        distance = distance.max(frame.undriven(&known, initial));
        known.block(0..frame.rank, 0..frame.rank)
    });
    if distance.is_nan() || distance > ROUNDING {
        return Err(format!("omitted coordinates are coupled to the others (relative coupling {distance:.1e})"));
    }
    Ok((locals, initial, distance))
}

/// Coordinates `[E, N, C]`: those of the dual point, those that no price sees, and those that are known.
struct Frame {
    basis: Enclosure,
    reader: Enclosure,
    rank: usize,
    unseen: usize,
    /// Sizes of both, to compare with.
    basis_size: Matrix,
    reader_size: Matrix,
}

impl Frame {
    fn new(step: &DualStep, t: usize) -> Result<Self, String> {
        check_stop()?;
        let both = step.basis.beside(&step.unseen);
        let whole = both.beside(&others(&both));
        if whole.rows != whole.cols {
            return Err(format!("the coordinates at decision {t} are not independent"));
        }
        let reader =
            inverse(&whole).ok_or_else(|| format!("the coordinates at decision {t} are too close to singular"))?;
        let (basis_size, reader_size) = (whole.abs(), reader.magnitude());
        Ok(Self {
            basis: enclosed(&whole),
            reader,
            rank: step.basis.cols,
            unseen: step.unseen.cols,
            basis_size,
            reader_size,
        })
    }

    /// How much a price sees of what it should not.
    fn unpriced(&self, price: &Enclosure, given: &Matrix) -> f64 {
        let sizes = self.basis_size.transpose().times(&given.abs()).times(&self.basis_size);
        let columns = self.rank..self.rank + self.unseen;
        share(price, &sizes, (0..price.rows).flat_map(|i| columns.clone().map(move |j| (i, j))))
    }

    /// How much of `E` and `N` at the step before leads out of `E` and `N` here, and of `N` out of `N`.
    fn left_out(&self, carried: &Enclosure, before: &Self, given: &Matrix) -> f64 {
        let sizes = self.reader_size.times(&given.abs()).times(&before.basis_size);
        let (here, there) = (self.rank + self.unseen, before.rank + before.unseen);
        let lost = (here..carried.rows).flat_map(|i| (0..there).map(move |j| (i, j)));
        let seen = (0..self.rank).flat_map(|i| (before.rank..there).map(move |j| (i, j)));
        share(carried, &sizes, lost.chain(seen))
    }

    /// How much noise reaches what counts as known.
    fn undriven(&self, noise: &Enclosure, given: &Matrix) -> f64 {
        let sizes = self.reader_size.times(&given.abs()).times(&self.reader_size.transpose());
        let kept = self.rank + self.unseen;
        share(noise, &sizes, (kept..noise.rows).flat_map(|i| (0..noise.cols).map(move |j| (i, j))))
    }
}

/// The largest of some entries beside the largest that any was summed from: all coordinates are of one size.
fn share(of: &Enclosure, sizes: &Matrix, places: impl Iterator<Item = (usize, usize)>) -> f64 {
    let largest = sizes.entries.iter().fold(0.0, |a: f64, &b| a.max(b));
    let found = places.map(|(i, j)| of.at(i, j).magnitude()).fold(0.0, |a, b| if b.is_nan() || b > a { b } else { a });
    if found == 0.0 { 0.0 } else { found / largest }
}

/// Unit vectors that complete independent columns to a basis: rows that elimination with pivots does not use.
fn others(columns: &Matrix) -> Matrix {
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

/// The dual's value, with covariances `(1 + share) E E'` beside it; why it is none otherwise.
fn value(given: &Given, locals: &[Local], initial: Option<&Enclosure>, price: f64, share: f64) -> Result<f64, String> {
    let count = locals.len();
    let (half, lambda) = (Interval::point(0.5), Interval::point(price));
    let enlarged = Interval::point(1.0) + Interval::point(share);
    let mut sum = -(lambda * given.budget);
    if let Some(initial) = initial {
        let first = Factored::new(initial).ok_or("the first covariance is not proved to be positive definite")?;
        sum = sum + half * first.log_least - locals[0].multiplier.dot(initial);
    }
    for (t, local) in locals.iter().enumerate() {
        check_stop()?;
        let r = local.price.rows;
        let order = Interval::point(r as f64);
        let shrunk = half * enlarged.recip();
        let mut slope = local.price.scaled(lambda).plus(&local.multiplier);
        for i in 0..r {
            slope.entries[i * r + i] = slope.entries[i * r + i] - shrunk;
        }
        sum = sum - half * order * enlarged.ln() + half * order;
        if let Some(to) = next(count, given.initial.is_none(), t) {
            let a = &local.dynamics;
            let predicted = a.times(&a.transpose()).scaled(enlarged).plus(&local.process);
            let factored = Factored::new(&predicted)
                .ok_or_else(|| format!("the covariance before decision {to} is not proved to be positive definite"))?;
            let whitened = factored.inverse_root.times(a);
            let known = whitened.transpose().times(&whitened).scaled(half * factored.least_share);
            slope = slope.plus(&known).minus(&a.transpose().around(&locals[to].multiplier));
            let noise = factored.trace_of_inverse(&local.process);
            sum = sum + half * (factored.log_least + noise)
                - half * Interval::point(predicted.rows as f64)
                - locals[to].multiplier.dot(&local.process);
        }
        if !slope.is_positive_semidefinite() {
            return Err(format!(
                "the slope of the Lagrangian at decision {t} is not proved to be positive semidefinite"
            ));
        }
    }
    if sum.low.is_nan() { Err("numbers overflow".into()) } else { Ok(sum.low) }
}

/// A positive definite matrix `M` with `X M X' = I + R`, `X` a rounded inverse of its Cholesky factor.
struct Factored {
    inverse_root: Enclosure,
    /// At most `log |M|`.
    log_least: Interval,
    /// `M^-1 - this X'X` is positive semidefinite.
    least_share: Interval,
}

impl Factored {
    fn new(m: &Enclosure) -> Option<Self> {
        let n = m.rows;
        let g = m.middle().cholesky()?;
        // Forward substitution.
        let mut x = Matrix::from_fn(n, n, |_, _| 0.0);
        for j in 0..n {
            for i in j..n {
                let known: f64 = (j..i).map(|k| g.at(i, k) * x.at(k, j)).sum();
                let unit = f64::from(u8::from(i == j));
                x.set(i, j, (unit - known) / g.at(i, i));
            }
        }
        let inverse_root = enclosed(&x);
        let rest = inverse_root.around(m).minus(&enclosed(&Matrix::identity(n))).row_sum();
        if rest.is_nan() || rest >= 0.5 {
            return None;
        }
        let (one, order) = (Interval::point(1.0), Interval::point(n as f64));
        let spread = order * (one - Interval::point(rest)).ln();
        let root = (0..n).fold(Interval::ZERO, |sum, i| sum + Interval::point(x.at(i, i)).ln());
        let log_least = spread - root - root;
        let least_share = (one + Interval::point(rest)).recip();
        Some(Self { inverse_root, log_least, least_share: Interval::point(least_share.low) })
    }

    /// At most `Tr(M^-1 w)`, of a positive semidefinite `w`.
    fn trace_of_inverse(&self, w: &Enclosure) -> Interval {
        let whitened = self.inverse_root.around(w);
        let trace = (0..whitened.rows).fold(Interval::ZERO, |sum, i| sum + whitened.at(i, i));
        trace * self.least_share
    }
}
