//! The steady state of a sensor's Kalman filter, in as many digits as it takes.

use super::filter::{Filtered, Sensor};
use super::frame::others;
use super::given::{DualStep, Stage};
use super::matrix::Matrix;
use super::riccati::Steps;
use super::wide::Wide;
use super::wides::Wides;
use supple_kernels::math;

/// Single steps before doubling begins, in addition to one for every state.
const FIRST_STEPS: usize = 30;

/// Doublings of the number of steps at most.
const DOUBLINGS: usize = 50;

/// A filter is steady when two successive doublings change its information and cost by less than this, relatively.
const SETTLED: f64 = 1e-14;

/// The relative difference within which results with two different numbers of digits must agree.
const AGREED: f64 = 1e-11;

/// The factor by which the filter starts above the claimed covariance: starting at a claim that is only nearly
/// steady, modes that hardly decay would seem to have settled.
const LARGER: f64 = 2.0;

/// The steady state of a sensor's filter.
pub(crate) struct Steady {
    /// Its information and cost at every step.
    pub filtered: Filtered,
    /// The covariance before the measurement.
    pub predicted: Matrix,
}

/// The steady state of a sensor's filter near a covariance `E E'`, in coordinates of `E`: `None` if there is none, if
/// rounding leaves it uncertain, or once it is stopped.
///
/// The other coordinates are states that never affect the cost and states that are known, as in the proof of the lower
/// bound.
pub(crate) fn steady(stage: &Stage, step: &DualStep, sensor: &Sensor, is_stopped: &dyn Fn() -> bool) -> Option<Steady> {
    if sensor.variances.iter().any(|variance| !(*variance > 0.0 && variance.is_finite())) {
        return None;
    }
    let near = |a: f64, b: f64| (a - b).abs() <= AGREED * (a.abs() + b.abs());
    let agree = |one: &Steady, other: &Steady| {
        let (one, other) = (one.filtered, other.filtered);
        near(one.nats, other.nats) && near(one.price, other.price)
    };
    let mut last: Option<Steady> = None;
    for words in [2, 4, 8] {
        let found = match words {
            2 => Local::<2>::new(stage, step, sensor).and_then(|local| local.steady(is_stopped)),
            4 => Local::<4>::new(stage, step, sensor).and_then(|local| local.steady(is_stopped)),
            _ => Local::<8>::new(stage, step, sensor).and_then(|local| local.steady(is_stopped)),
        };
        match (&last, found) {
            (Some(before), Some(found)) if agree(before, &found) => return Some(found),
            (_, found) => last = found,
        }
    }
    None
}

/// A stage and its sensor in coordinates of `E`.
struct Local<'a, const K: usize> {
    basis: Wides<K>,
    dynamics: Wides<K>,
    process: Wides<K>,
    price: Wides<K>,
    measurement: Wides<K>,
    variances: &'a [f64],
}

impl<'a, const K: usize> Local<'a, K> {
    fn new(stage: &Stage, step: &DualStep, sensor: &'a Sensor) -> Option<Self> {
        let both = step.basis.beside(&step.unseen);
        let whole = both.beside(&others(&both));
        let (n, r) = (whole.rows, step.basis.cols);
        if whole.cols != n {
            return None;
        }
        let reader = Wides::new(&whole).solve(&Wides::identity(n))?;
        let reader = Wides::from_fn(r, n, |i, j| reader.at(i, j));
        let basis = Wides::new(&step.basis);
        Some(Self {
            dynamics: reader.times(&Wides::new(&stage.dynamics)).times(&basis),
            process: reader.times(&Wides::new(&stage.process)).times(&reader.transpose()).symmetric(),
            price: basis.transpose().times(&Wides::new(&stage.price)).times(&basis),
            measurement: Wides::new(&sensor.measurement).times(&basis),
            variances: &sensor.variances,
            basis,
        })
    }

    /// The limit of `P <- A (P^-1 + G)^-1 A' + W`, `G = C' V^-1 C`: takes some steps, then doubles their
    /// number. In the closed loop of a filter with this covariance, modes that grow without noise are
    /// stable.
    fn steady(&self, is_stopped: &dyn Fn() -> bool) -> Option<Steady> {
        let n = self.dynamics.rows;
        let precision = self.precision();
        let mut first =
            self.dynamics.times(&self.dynamics.transpose()).plus(&self.process).scaled(Wide::new(LARGER)).symmetric();
        for _ in 0..FIRST_STEPS + n {
            if is_stopped() {
                return None;
            }
            first = self.step(&first, &precision)?.0;
        }
        let (next, kept) = self.step(&first, &precision)?;
        let closed = self.dynamics.times(&kept);
        let gained = precision.times(&kept).symmetric();
        let mut steps = Steps::new(closed.transpose(), gained, next.plus(&first.scaled(-Wide::power_of_two(0))));
        let (mut last, mut settled) = (Filtered { nats: f64::NAN, price: f64::NAN }, 0);
        for _ in 0..DOUBLINGS {
            if is_stopped() {
                return None;
            }
            let predicted = first.plus(&steps.from_zero).symmetric();
            let now = self.corrected(&predicted)?;
            let near = |a: f64, b: f64| (a - b).abs() <= SETTLED * (a.abs() + b.abs());
            settled = if near(last.nats, now.nats) && near(last.price, now.price) { settled + 1 } else { 0 };
            if settled == 2 {
                let whole = self.basis.times(&predicted).times(&self.basis.transpose());
                let predicted = Matrix::from_fn(whole.rows, whole.cols, |i, j| whole.at(i, j).rounded());
                return Some(Steady { filtered: now, predicted });
            }
            last = now;
            steps = steps.twice()?;
        }
        None
    }

    /// One step, and `(I + P G)^-1`: the factor that the measurement leaves of an error.
    fn step(&self, p: &Wides<K>, precision: &Wides<K>) -> Option<(Wides<K>, Wides<K>)> {
        let identity = Wides::identity(p.rows);
        let kept = identity.plus(&p.times(precision)).solve(&identity)?;
        let carried = self.dynamics.times(&kept.times(p).symmetric()).times(&self.dynamics.transpose());
        Some((carried.plus(&self.process).symmetric(), kept))
    }

    /// `C' V^-1 C`.
    fn precision(&self) -> Wides<K> {
        let rows = &self.measurement;
        let weighted =
            Wides::from_fn(rows.rows, rows.cols, |row, i| rows.at(row, i) * Wide::new(self.variances[row]).inverse());
        rows.transpose().times(&weighted).symmetric()
    }

    /// Information of the sequential measurements, and cost of the remaining covariance.
    fn corrected(&self, predicted: &Wides<K>) -> Option<Filtered> {
        let n = predicted.rows;
        let (mut p, mut nats) = (predicted.clone(), 0.0);
        for (row, &variance) in self.variances.iter().enumerate() {
            let c = Wides::from_fn(n, 1, |i, _| self.measurement.at(row, i));
            let along = p.times(&c);
            let known = along.transpose().times(&c).at(0, 0);
            let innovation = known + Wide::new(variance);
            if !innovation.is_positive() {
                return None;
            }
            nats += 0.5 * math::ln_1p((known * Wide::new(variance).inverse()).rounded().max(0.0));
            let by = innovation.inverse();
            p = Wides::from_fn(n, n, |i, j| p.at(i, j) - along.at(i, 0) * along.at(j, 0) * by);
        }
        let price = p.entries.iter().zip(&self.price.entries).fold(Wide::ZERO, |sum, (p, by)| sum + *p * *by).rounded();
        (nats.is_finite() && price.is_finite()).then_some(Filtered { nats, price })
    }
}
