use supple_kernels::rows::{self, Left, Long, Product, View, ViewMut, transpose};
use supple_kernels::{Job, Lanes, Matrices, dispatch, math, padded};

use super::factor::Factor;
use crate::Error;
use crate::belief::Belief;
use crate::dense::Dense;
use crate::given::MEASUREMENT;
use crate::knots::{Dimensions, Knots};
use crate::noise::Noise;
use crate::riccati::Policy;

/// Directed information from the state to the controls, `DI(x^N -> u^N)`: nats at each control, N of them (theory,
/// equation I.8).
///
/// The information from the measurements that reaches the controls: at most [`information`](super::information). Exact
/// for the linearised closed loop `u = ubar + K (mu - xbar)`. A combination of controls that is determined by past
/// controls, to 1e-12 of its variance, adds nothing.
///
/// # Errors
/// Where `V` is not symmetric and positive definite; if arrays do not fit each other.
///
/// ```
/// use supple_lqg::{Belief, Information, Knots, LinearQuadratic, Noise, Policy, Regularisation};
/// use supple_lqg::{constant, control_information, information, kalman, solve_riccati};
///
/// let (a, b, c) = ([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]], [[1.0, 0.0]]);
/// let plant = LinearQuadratic { a: &a, b: &b, c: &c, q: &[[1.0, 0.0], [0.0, 0.1]], r: &[[0.01]] };
/// let knots = Knots::linear(100, plant)?;
/// let mut policy = Policy::zeros(knots.dimensions, 100);
/// solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
/// let noise = Noise {
///     initial: constant(&[[0.01, 0.0], [0.0, 0.01]]),
///     process: constant(&[[1e-6, 0.0], [0.0, 1e-4]]),
///     measurement: constant(&[[1e-4]]),
/// };
/// let (mut belief, mut measured) = (Belief::zeros(2, 1, 100), Information::default());
/// kalman(&knots, &noise, &mut belief)?;
/// information(&belief, &noise, &mut measured)?;
/// let used: f64 = control_information(&knots, &policy, &belief, &noise)?.iter().sum();
/// assert!(0.0 < used && used < measured.total);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn control_information(knots: &Knots, policy: &Policy, belief: &Belief, noise: &Noise) -> Result<Vec<f64>, Error> {
    check_shapes(knots, policy, belief, noise)?;
    dispatch(Sweep { knots, policy, belief, noise, kept: None })
}

/// One control step, processed.
pub(super) struct Told {
    /// Information about the states, nats.
    pub nats: f64,
    /// The controls that past controls do not determine.
    pub controls: Vec<usize>,
    /// Factors of `N^a` and `N^b` of (I.8) before conditioning on these controls.
    pub before: [Dense; 2],
    /// Factors of `N^a` and `N^b` after conditioning.
    pub after: [Dense; 2],
}

/// Like [`control_information`], with all intermediate results.
pub(super) fn told(knots: &Knots, policy: &Policy, belief: &Belief, noise: &Noise) -> Result<Vec<Told>, Error> {
    check_shapes(knots, policy, belief, noise)?;
    let mut steps = Vec::with_capacity(knots.steps());
    dispatch(Sweep { knots, policy, belief, noise, kept: Some(&mut steps) })?;
    Ok(steps)
}

fn check_shapes(knots: &Knots, policy: &Policy, belief: &Belief, noise: &Noise) -> Result<(), Error> {
    let (dimensions, steps) = (knots.dimensions, knots.steps());
    knots.check_shapes()?;
    noise.check_shapes(dimensions, steps)?;
    noise.check_measurement(dimensions, steps)?;
    belief.check_shapes(dimensions, steps)?;
    policy.check_shapes(dimensions, steps)
}

struct Sweep<'a> {
    knots: &'a Knots,
    policy: &'a Policy,
    belief: &'a Belief,
    noise: &'a Noise,
    /// Stores the intermediate results.
    kept: Option<&'a mut Vec<Told>>,
}

impl Job for Sweep<'_> {
    type Output = Result<Vec<f64>, Error>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { knots, policy, belief, noise, mut kept } = self;
        let mut means = Means::new(knots.dimensions);
        let mut all = Vec::with_capacity(knots.steps());
        for t in 0..knots.steps() {
            means.measure::<L>(knots, belief, noise, t)?;
            let before = kept.is_some().then(|| means.factors());
            all.push(means.tell::<L>(&policy.feedback, t));
            if !all[t].is_finite() {
                return Err(Error::NotFinite { what: "the information that controls use", step: t });
            }
            if let Some((kept, before)) = kept.as_mut().zip(before) {
                let controls = means.news.clone();
                kept.push(Told { nats: all[t], controls, before, after: means.factors() });
            }
        }
        Ok(all)
    }
}

/// Covariances of the filter's mean `mu_t`, n x n.
///
/// Two of them are stored as factors `G`, `N = G G'`, with as many columns as their rank: where past controls determine
/// the mean, nothing is left, and in `N` itself that could not be distinguished from rounding.
struct Means {
    dimensions: Dimensions,
    /// Given past controls: a factor of `N^a` of (I.8).
    told: Telling,
    /// Given past controls and all states so far: a factor of `N^b` of (I.8).
    both: Telling,
    /// Given all states so far, without past controls: an upper bound on the covariance `N^b`.
    known: Vec<f64>,
    /// Controls of the last step that were not determined by those before.
    news: Vec<usize>,
    /// A factor of `V`, p x p.
    noise_factor: Vec<f64>,
    /// `A'` and `A' (I - L C)'`, n x n.
    dynamics: Vec<f64>,
    through: Vec<f64>,
    /// `C'` and `A' C'`, n x p.
    seen: Vec<f64>,
    seen_next: Vec<f64>,
    /// What the measurement adds to the columns of each factor, p of them.
    innovation: Vec<f64>,
    noise: Vec<f64>,
    /// `K'`, n x m, and work space for a product with it or with n columns.
    feedback: Vec<f64>,
    product: Vec<f64>,
}

impl Means {
    fn new(dimensions: Dimensions) -> Self {
        let Dimensions { states: n, controls: m, measurements: p } = dimensions;
        let rows = |count: usize, len: usize| vec![0.0; count * padded(len)];
        Self {
            dimensions,
            told: Telling::new(dimensions),
            both: Telling::new(dimensions),
            known: rows(n, n),
            news: Vec::with_capacity(m),
            noise_factor: rows(p, p),
            dynamics: rows(n, n),
            through: rows(n, n),
            seen: rows(n, p),
            seen_next: rows(n, p),
            innovation: rows(p, n),
            noise: rows(p, n),
            feedback: rows(n, m),
            product: rows(n, n.max(m)),
        }
    }

    fn factors(&self) -> [Dense; 2] {
        [self.told.factor.dense(), self.both.factor.dense()]
    }

    /// Propagates to the mean after the measurement at `t` (theory, equation I.7).
    #[inline(always)]
    fn measure<L: Lanes>(&mut self, knots: &Knots, belief: &Belief, noise: &Noise, t: usize) -> Result<(), Error> {
        let Dimensions { states: n, measurements: p, .. } = self.dimensions;
        let (narrow, small) = (padded(n), padded(p));
        let gain = View::new(belief.gain_transposed.at(t), narrow);
        if t == 0 || !noise.measurement.is_constant() {
            self.factor_noise(&noise.measurement, t)?;
        }
        let left = Left::transposed(&self.noise_factor, small);
        let product = Product { left, right: gain, rows: p, inner: p, width: narrow };
        product.set::<L, Long>(ViewMut::new(&mut self.noise, narrow));
        belief.write_reduction::<L>(t, &mut self.innovation);
        if t > 0 {
            let a = View::new(knots.dynamics.at(t - 1), knots.dynamics.stride());
            transpose::<L, Long>(ViewMut::new(&mut self.dynamics, narrow), a, n, n);
            let c = View::new(knots.measurement.at(t), narrow);
            transpose::<L, Long>(ViewMut::new(&mut self.seen, small), c, p, n);
            let (left, right) = (Left::plain(&self.dynamics, narrow), View::new(&self.seen, small));
            let product = Product { left, right, rows: n, inner: n, width: small };
            product.set::<L, Long>(ViewMut::new(&mut self.seen_next, small));
            let product =
                Product { left: Left::plain(&self.seen_next, small), right: gain, rows: n, inner: p, width: narrow };
            let through = ViewMut::new(&mut self.through, narrow);
            product.subtract_from::<L, Long>(View::new(&self.dynamics, narrow), through);
            let (left, right) = (Left::transposed(&self.known, narrow), View::new(&self.through, narrow));
            let product = Product { left, right, rows: n, inner: n, width: narrow };
            product.set::<L, Long>(ViewMut::new(&mut self.product, narrow));
            let (left, right) = (Left::transposed(&self.through, narrow), View::new(&self.product, narrow));
            let product = Product { left, right, rows: n, inner: n, width: narrow };
            product.set::<L, Long>(ViewMut::new(&mut self.known, narrow));
        }
        let (left, right) = (Left::transposed(&self.noise, narrow), View::new(&self.noise, narrow));
        let product = Product { left, right, rows: n, inner: p, width: narrow };
        product.add::<L, Long>(ViewMut::new(&mut self.known, narrow));
        self.told.factor.advance::<L>(&self.dynamics, &self.innovation);
        self.both.factor.advance::<L>(&self.through, &self.noise);
        Ok(())
    }

    fn factor_noise(&mut self, measurement: &Matrices, t: usize) -> Result<(), Error> {
        let (p, small) = (self.dimensions.measurements, padded(self.dimensions.measurements));
        self.noise_factor.copy_from_slice(measurement.at(t));
        rows::cholesky(&mut self.noise_factor, p, small)
            .map_err(|_| Error::NotPositiveDefinite { what: MEASUREMENT, step: t })?;
        (0..p).for_each(|i| self.noise_factor[i * small + i + 1..(i + 1) * small].fill(0.0));
        Ok(())
    }

    /// The information of `K mu` about the states, nats; then conditions on these controls. One control at a time, the one
    /// that is least determined first. Keeps those that were not already determined.
    #[inline(always)]
    fn tell<L: Lanes>(&mut self, feedback: &Matrices, t: usize) -> f64 {
        let Dimensions { states: n, controls: m, .. } = self.dimensions;
        let (narrow, short) = (padded(n), padded(m));
        let k = View::new(feedback.at(t), narrow);
        transpose::<L, Long>(ViewMut::new(&mut self.feedback, short), k, m, n);
        // An upper bound on the variance of each control, given the states.
        let (left, right) = (Left::transposed(&self.known, narrow), View::new(&self.feedback, short));
        let product = Product { left, right, rows: n, inner: n, width: short };
        product.set::<L, Long>(ViewMut::new(&mut self.product, short));
        let through = |a: usize| (0..n).map(|i| self.feedback[i * short + a] * self.product[i * short + a]).sum();
        let all: Vec<f64> = (0..m).map(through).collect();
        let mut left: Vec<usize> = (0..m).collect();
        let mut nats = 0.0;
        self.news.clear();
        self.told.begin::<L>(&self.feedback, n);
        self.both.begin::<L>(&self.feedback, n);
        for (a, row) in k.numbers.chunks_exact(narrow).take(m).enumerate() {
            // A control that varies, but not with noise, tells all: with measurements so precise, squares underflow.
            if all[a] == 0.0 && self.told.varies(&row[..n], a) {
                return f64::INFINITY;
            }
        }
        // The share of a control's variance that past controls leave, from 0 to 1.
        let unknown = |both: &Telling, a: usize| if all[a] > 0.0 { both.variance(a) / all[a] } else { 0.0 };
        while let Some((place, share)) =
            left.iter().map(|&a| unknown(&self.both, a)).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
        {
            if share <= KNOWN {
                break;
            }
            let a = left.swap_remove(place);
            self.news.push(a);
            let row = &k.numbers[a * narrow..a * narrow + n];
            // Not in a closure, which would not inherit the instructions of the lanes.
            let (without, with) = (self.told.condition::<L>(row, a), self.both.condition::<L>(row, a));
            nats += (0.5 * math::ln(without / with)).max(0.0);
        }
        self.told.end::<L>();
        self.both.end::<L>();
        nats
    }
}

/// Below this share of its variance, a control counts as determined by the past ones, up to rounding.
const KNOWN: f64 = 1e-12;

/// A covariance `G G'` that is conditioned on controls, one after the other.
struct Telling {
    factor: Factor,
    /// `G' K'`, in rows of m numbers in whole lanes.
    seen: Vec<f64>,
    /// The number of controls, m.
    controls: usize,
    /// Leading columns of `G` that conditioning has removed: rows of `seen`.
    out: usize,
    rounding: Rounding,
}

impl Telling {
    fn new(Dimensions { states: n, controls: m, measurements: p }: Dimensions) -> Self {
        let rounding = Rounding { sizes: vec![0.0; n], left: 0.0 };
        let seen = vec![0.0; (n + p) * padded(m)];
        Self { factor: Factor::zero(n, p, m), seen, controls: m, out: 0, rounding }
    }

    /// Prepares for conditioning on the controls with the transposed feedback `K'`.
    #[inline(always)]
    fn begin<L: Lanes>(&mut self, feedback_transposed: &[f64], n: usize) {
        let (columns, short) = (self.factor.transposed(), padded(self.controls));
        let (left, right) = (Left::plain(columns.numbers, columns.stride), View::new(feedback_transposed, short));
        let product = Product { left, right, rows: self.factor.count(), inner: n, width: short };
        product.set::<L, Long>(ViewMut::new(&mut self.seen, short));
        self.out = 0;
        self.rounding.begin(&self.factor);
    }

    fn variance(&self, a: usize) -> f64 {
        let short = padded(self.controls);
        (self.out..self.factor.count()).map(|k| self.seen[k * short + a] * self.seen[k * short + a]).sum()
    }

    /// Whether control `a`, whose feedback is `row`, varies by more than rounding.
    fn varies(&self, row: &[f64], a: usize) -> bool {
        self.variance(a) > KNOWN * self.rounding.whole(row).powi(2)
    }

    /// Conditions `G G'` on control `a` exactly: rotates columns so that only one affects its row of `K`, then removes that
    /// column. Returns the variance that the control had.
    #[inline(always)]
    fn condition<L: Lanes>(&mut self, row: &[f64], a: usize) -> f64 {
        let variance = self.factor.bring_first::<L>(self.out, &mut self.seen, a);
        if variance > 0.0 {
            self.out += 1;
            self.rounding.grow(row, variance);
        }
        variance
    }

    /// Keeps in `G` the uncertainty left after conditioning.
    #[inline(always)]
    fn end<L: Lanes>(&mut self) {
        self.factor.leave_out(self.out);
        self.rounding.clear::<L>(&mut self.factor);
    }
}

/// Bound on the rounding errors left in a factor after conditioning on the controls. If these were kept, they would grow
/// where the map from controls back to measurements is unstable, as for a non-minimum-phase loop.
struct Rounding {
    /// Size of each row before conditioning.
    sizes: Vec<f64>,
    /// The bound, in units of these sizes.
    left: f64,
}

impl Rounding {
    fn begin(&mut self, factor: &Factor) {
        factor.sizes(&mut self.sizes);
        self.left = 0.0;
    }

    /// The deviation that a row has at most, before conditioning.
    fn whole(&self, row: &[f64]) -> f64 {
        row.iter().zip(&self.sizes).map(|(entry, size)| entry.abs() * size).sum()
    }

    /// After conditioning on a row of this variance: the smaller the variance relative to the factor, the larger the error.
    fn grow(&mut self, row: &[f64], variance: f64) {
        let whole = self.whole(row);
        self.left += 16.0 * f64::EPSILON * whole / variance.sqrt();
    }

    /// Removes everything below the bound.
    #[inline(always)]
    fn clear<L: Lanes>(&mut self, factor: &mut Factor) {
        if factor.count() == 0 || self.left == 0.0 {
            return;
        }
        self.sizes.iter_mut().filter(|size| **size == 0.0).for_each(|size| *size = 1.0);
        factor.leave_rounding_out::<L>(&self.sizes, self.left);
    }
}
