use nalgebra::{DMatrix, DVectorView, Dyn, U1};
use supple_kernels::math;

use crate::Error;
use crate::belief::Belief;
use crate::dense::{beside, cholesky, dense};
use crate::knots::Knots;
use crate::noise::Noise;
use crate::riccati::Policy;

/// Directed information from the state to the controls, `DI(x^N -> u^N)`: nats at each control, N of them (theory,
/// equation I.8).
///
/// The information from the measurements that reaches the controls: at most [`information`](super::information). Exact
/// for the linearised closed loop `u = ubar + K (mu - xbar)`. A combination of the controls that past controls
/// determine, to 1e-12 of its variance, adds nothing.
///
/// # Errors
/// Where `V` is not positive definite.
pub fn control_information(knots: &Knots, policy: &Policy, belief: &Belief, noise: &Noise) -> Result<Vec<f64>, Error> {
    let mut means = Means::new(knots);
    let step = |t: usize| {
        means.measure((knots, belief, noise), t)?;
        Ok(means.tell(&dense(&policy.feedback, t)).0)
    };
    (0..knots.steps()).map(step).collect()
}

/// One control step, processed.
pub(super) struct Told {
    /// Information about the states, nats.
    pub nats: f64,
    /// Those not determined by past controls.
    pub controls: Vec<usize>,
    /// Factors of `N^a` and `N^b` of (I.8) before they are told.
    pub before: [DMatrix<f64>; 2],
    /// Factors of them afterwards.
    pub after: [DMatrix<f64>; 2],
}

/// As [`control_information`], with all that it goes through.
pub(super) fn told(knots: &Knots, policy: &Policy, belief: &Belief, noise: &Noise) -> Result<Vec<Told>, Error> {
    let mut means = Means::new(knots);
    let step = |t: usize| {
        means.measure((knots, belief, noise), t)?;
        let before = [means.told.clone(), means.both.clone()];
        let (nats, controls) = means.tell(&dense(&policy.feedback, t));
        Ok(Told { nats, controls, before, after: [means.told.clone(), means.both.clone()] })
    };
    (0..knots.steps()).map(step).collect()
}

/// Covariances of the filter's mean `mu_t`, n x n.
///
/// Two are kept as factors `G`, `N = G G'`, of as many columns as their rank: where past controls tell the mean,
/// nothing is left, and rounding could not be told from it in `N`.
struct Means {
    /// Given past controls: a factor of `N^a` of (I.8).
    told: DMatrix<f64>,
    /// Given past controls and all states so far: a factor of `N^b` of (I.8).
    both: DMatrix<f64>,
    /// Given all states so far: how large the one before could be.
    known: DMatrix<f64>,
}

impl Means {
    fn new(knots: &Knots) -> Self {
        let n = knots.dimensions.states;
        Self { told: DMatrix::zeros(n, 0), both: DMatrix::zeros(n, 0), known: DMatrix::zeros(n, n) }
    }

    /// Goes on to the mean after the measurement at `t` (theory, equation I.7).
    fn measure(&mut self, (knots, belief, noise): (&Knots, &Belief, &Noise), t: usize) -> Result<(), Error> {
        let n = knots.dimensions.states;
        let dynamics = (t > 0).then(|| dense(&knots.dynamics, t - 1).columns(0, n).into_owned());
        let c = dense(&knots.measurement, t);
        let gain = dense(&belief.gain_transposed, t).transpose();
        let innovation = belief.reduction(t);
        let factor = cholesky(&dense(&noise.measurement, t));
        let noise = &gain * factor.ok_or(Error::NotPositiveDefinite { what: "the measurement covariance", step: t })?;
        let known = &noise * noise.transpose();
        if let Some(a) = &dynamics {
            let through = a - &gain * (c * a);
            self.told = beside(a * &self.told, &innovation);
            self.both = beside(&through * &self.both, &noise);
            self.known = &through * &self.known * through.transpose() + known;
        } else {
            *self = Self { told: innovation, both: noise, known };
        }
        Ok(())
    }

    /// What `K mu` tells about the states, in nats; past controls include it afterwards. One control at a time, the one
    /// that is known least first. With those that were not known already.
    fn tell(&mut self, feedback: &DMatrix<f64>) -> (f64, Vec<usize>) {
        let rows = feedback.transpose();
        // How large the variance of each control could be, given the states.
        let through = &self.known * &rows;
        let all: Vec<f64> = (0..rows.ncols()).map(|a| rows.column(a).dot(&through.column(a))).collect();
        let mut left: Vec<usize> = (0..rows.ncols()).collect();
        let (mut nats, mut news) = (0.0, Vec::new());
        let [mut told, mut both] = [&mut self.told, &mut self.both].map(|factor| Telling::of(factor, &rows));
        // The share of a control's variance that past controls leave, from 0 to 1.
        let unknown = |both: &Telling, a: usize| if all[a] > 0.0 { both.variance(a) / all[a] } else { 0.0 };
        while let Some((place, share)) =
            left.iter().map(|&a| unknown(&both, a)).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
        {
            if share <= KNOWN {
                break;
            }
            let a = left.swap_remove(place);
            news.push(a);
            let (without, with) = (told.condition(a), both.condition(a));
            nats += (0.5 * math::ln(without / with)).max(0.0);
        }
        told.end();
        both.end();
        (nats, news)
    }
}

/// Below this a control is known from the past ones but for rounding.
const KNOWN: f64 = 1e-12;

/// A covariance `G G'` that controls are told of, one after the other.
struct Telling<'a> {
    factor: &'a mut DMatrix<f64>,
    /// The controls' rows of `K`, as columns.
    rows: &'a DMatrix<f64>,
    /// `G' K'`.
    seen: DMatrix<f64>,
    /// Leading columns of `G` that are left out: rows of `seen`.
    out: usize,
    rounding: Rounding,
}

impl<'a> Telling<'a> {
    fn of(factor: &'a mut DMatrix<f64>, rows: &'a DMatrix<f64>) -> Self {
        let (seen, rounding) = (factor.tr_mul(rows), Rounding::of(factor));
        Self { factor, rows, seen, out: 0, rounding }
    }

    fn seen(&self, a: usize) -> DVectorView<'_, f64> {
        let len = self.seen.nrows() - self.out;
        self.seen.generic_view((self.out, a), (Dyn(len), U1))
    }

    fn variance(&self, a: usize) -> f64 {
        self.seen(a).norm_squared()
    }

    /// Conditions `G G'` on control `a` exactly: turns `G` so that one column alone bears on it, and leaves that out.
    /// Returns the variance that the control had.
    fn condition(&mut self, a: usize) -> f64 {
        let mut normal = self.seen(a).into_owned();
        let norm = normal.norm();
        normal[0] += norm.copysign(normal[0]);
        let scale = -2.0 / normal.norm_squared();
        let (out, columns) = (self.out, normal.len());
        let mut factor = self.factor.columns_mut(out, columns);
        let turned = &factor * &normal;
        factor.ger(scale, &turned, &normal, 1.0);
        let mut seen = self.seen.rows_mut(out, columns);
        let turned = seen.tr_mul(&normal);
        seen.ger(scale, &normal, &turned, 1.0);
        self.out += 1;
        self.rounding.grow(self.rows.column(a), norm * norm);
        norm * norm
    }

    /// Leaves in `G` what the controls have not told.
    fn end(self) {
        let kept = self.factor.ncols() - self.out;
        *self.factor = self.factor.columns(self.out, kept).into_owned();
        self.rounding.clear(self.factor);
    }
}

/// Rounding errors that can remain in a factor after conditioning on the controls. Told on and on, it would grow where
/// the step from controls back to measurements is unstable, as behind a loop that is not of minimum phase.
struct Rounding {
    /// Size of each row before anything was told.
    sizes: Vec<f64>,
    /// In units of these.
    left: f64,
}

impl Rounding {
    fn of(factor: &DMatrix<f64>) -> Self {
        Self { sizes: factor.row_iter().map(|row| row.norm()).collect(), left: 0.0 }
    }

    /// Once a row of this variance has been told: the less of the factor it bears on, the more it leaves.
    fn grow(&mut self, row: DVectorView<f64>, variance: f64) {
        let whole: f64 = row.iter().zip(&self.sizes).map(|(entry, size)| entry.abs() * size).sum();
        self.left += 16.0 * f64::EPSILON * whole / variance.sqrt();
    }

    /// Leaves out what is not above it.
    fn clear(&self, factor: &mut DMatrix<f64>) {
        if factor.is_empty() || self.left == 0.0 {
            return;
        }
        let scale = |i: usize| if self.sizes[i] > 0.0 { self.sizes[i] } else { 1.0 };
        let scaled = DMatrix::from_fn(factor.nrows(), factor.ncols(), |i, j| factor[(i, j)] / scale(i));
        let found = scaled.col_piv_qr();
        let (q, r) = (found.q(), found.r());
        let rank = (0..r.nrows()).take_while(|&k| r[(k, k)].abs() > self.left).count();
        if rank < r.nrows() {
            // With as many columns as the rank, as the derivatives count them: R R' of its first rows from a triangle.
            let rows = r.rows(0, rank).transpose();
            let kept = q.columns(0, rank) * rows.qr().r().transpose();
            *factor = DMatrix::from_fn(kept.nrows(), kept.ncols(), |i, j| kept[(i, j)] * scale(i));
        }
    }
}
