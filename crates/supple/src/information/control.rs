use nalgebra::{Cholesky, DMatrix, DVector};

use crate::Error;
use crate::belief::Belief;
use crate::dense::dense;
use crate::knots::Knots;
use crate::noise::Noise;
use crate::plan::Policy;

/// Directed information from the state to the controls, `DI(x^N -> u^N)`: nats at each control, N of them (theory,
/// equation I.8).
///
/// What of the measurements reaches the controls: at most [`information`](super::information). Exact for the linearised
/// closed loop `u = ubar + K (mu - xbar)`. A combination of the controls that past controls tell already, to 1e-12 of
/// its variance, tells nothing new.
///
/// # Errors
/// Where `V` is not positive definite.
pub fn control_information(knots: &Knots, policy: &Policy, belief: &Belief, noise: &Noise) -> Result<Vec<f64>, Error> {
    let n = knots.dimensions.states;
    let mut means = Means { told: DMatrix::zeros(n, 0), both: DMatrix::zeros(n, 0), known: DMatrix::zeros(n, n) };
    let step = |t: usize| {
        let dynamics = (t > 0).then(|| dense(&knots.dynamics, t - 1).columns(0, n).into_owned());
        means.measure(dynamics.as_ref(), (knots, belief, noise), t)?;
        Ok(means.tell(&dense(&policy.feedback, t)))
    };
    (0..knots.steps()).map(step).collect()
}

/// Covariances of the filter's mean `mu_t`, n x n.
///
/// Two are kept as factors `G`, `N = G G'`, of as many columns as their rank: where past controls tell the mean, nothing
/// is left, and rounding could not be told from it in `N`.
struct Means {
    /// Given past controls: a factor of `N^a` of (I.8).
    told: DMatrix<f64>,
    /// Given past controls and all states so far: a factor of `N^b` of (I.8).
    both: DMatrix<f64>,
    /// Given all states so far: how large the one before could be.
    known: DMatrix<f64>,
}

impl Means {
    /// Goes on to the mean after the measurement at `t` (theory, equation I.7).
    fn measure(
        &mut self,
        dynamics: Option<&DMatrix<f64>>,
        (knots, belief, noise): (&Knots, &Belief, &Noise),
        t: usize,
    ) -> Result<(), Error> {
        let c = dense(&knots.measurement, t);
        let gain = dense(&belief.gain_transposed, t).transpose();
        let v = dense(&noise.measurement, t);
        let factor = |covariance: DMatrix<f64>| {
            let factor = Cholesky::new(covariance).map(|factor| &gain * factor.unpack());
            factor.ok_or(Error::NotPositiveDefinite { what: "the measurement covariance", step: t })
        };
        let innovation = factor(&c * dense(&belief.predicted, t) * c.transpose() + &v)?;
        let noise = factor(v)?;
        let known = &noise * noise.transpose();
        if let Some(a) = dynamics {
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
    /// that is known least first.
    fn tell(&mut self, feedback: &DMatrix<f64>) -> f64 {
        let mut controls: Vec<DVector<f64>> = feedback.row_iter().map(|row| row.transpose()).collect();
        let mut nats = 0.0;
        let [mut told, mut both] = [Rounding::of(&self.told), Rounding::of(&self.both)];
        while let Some((index, unknown)) =
            controls.iter().map(|row| self.unknown(row)).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
        {
            if unknown <= KNOWN {
                break;
            }
            let row = controls.swap_remove(index);
            let (without, with) = (condition(&mut self.told, &row), condition(&mut self.both, &row));
            nats += (0.5 * (without / with).ln()).max(0.0);
            told.grow(&row, without);
            both.grow(&row, with);
        }
        told.clear(&mut self.told);
        both.clear(&mut self.both);
        nats
    }

    /// How much of a control's variance, given the states, past controls leave: from 0 to 1.
    fn unknown(&self, row: &DVector<f64>) -> f64 {
        let all = row.dot(&(&self.known * row));
        if all > 0.0 { self.both.tr_mul(row).norm_squared() / all } else { 0.0 }
    }
}

/// Below this a control is known from the past ones but for rounding.
const KNOWN: f64 = 1e-12;

/// Conditions `G G'` on `row' mu` exactly: turns `G` so that one column alone bears on the row, and leaves that out.
/// Returns the variance that the row had.
fn condition(factor: &mut DMatrix<f64>, row: &DVector<f64>) -> f64 {
    let mut normal = factor.tr_mul(row);
    let norm = normal.norm();
    normal[0] += norm.copysign(normal[0]);
    let turned = &*factor * &normal;
    factor.ger(-2.0 / normal.norm_squared(), &turned, &normal, 1.0);
    *factor = factor.columns(1, factor.ncols() - 1).into_owned();
    norm * norm
}

/// What rounding can leave of a factor where controls have told all. Told on and on, it would grow where the step from
/// controls back to measurements is unstable, as behind a loop that is not of minimum phase.
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
    fn grow(&mut self, row: &DVector<f64>, variance: f64) {
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
            let kept = q.columns(0, rank) * r.rows(0, rank);
            *factor = DMatrix::from_fn(kept.nrows(), kept.ncols(), |i, j| kept[(i, j)] * scale(i));
        }
    }
}

/// A factor of `G G' + H H'`, with at most as many columns as rows.
fn beside(g: DMatrix<f64>, h: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, left) = (g.nrows(), g.ncols());
    let mut both = g.resize_horizontally(left + h.ncols(), 0.0);
    both.columns_mut(left, h.ncols()).copy_from(h);
    if both.ncols() > n { both.transpose().qr().r().transpose() } else { both }
}
