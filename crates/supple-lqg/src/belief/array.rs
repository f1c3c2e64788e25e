//! The Kalman filter in square-root form, for steps at which double precision is not enough: redundant sensors
//! of very different precision, or sensors much more precise than the prior.

use nalgebra::DMatrix;
use supple_kernels::Matrices;
use supple_kernels::math;

use super::state::{Belief, Form};
use crate::Error;
use crate::dense::{beside, cholesky, dense, store, symmetric};
use crate::given::MEASUREMENT;
use crate::knots::Knots;
use crate::noise::Noise;

/// Above this ratio rounding errors become significant: eight digits are left.
const RATIO: f64 = 1e8;

/// Whether rounding of `P` affects the measurement update, from an upper bound on the ratio of `|C| |P| |C|'` to the pivot
/// of the innovation covariance.
#[inline(always)]
pub(super) fn hides(spread_over_pivot: f64) -> bool {
    spread_over_pivot > RATIO
}

/// Whether rounding of the gain affects `Sigma`, to which the Joseph form adds its square: `spread_over_pivot` as in
/// [`hides`], and `told` is the trace of `C P C' V^-1` (theory, section "Square roots").
#[inline(always)]
pub(super) fn blurs(spread_over_pivot: f64, told: f64) -> bool {
    f64::EPSILON * f64::EPSILON * spread_over_pivot * told > 1.0 / RATIO
}

/// A measurement update in square-root form, `P = S S'` and `V = G G'` (theory, equation B.2d):
///
/// ```text
/// [ G   C S ]           [ Y  0  ]
/// [ 0    S  ] rotated = [ K  S+ ]     S^y = Y Y'     L = K Y^-1     Sigma = S+ S+'
/// ```
pub(super) struct Corrected {
    /// `Y`, p x p, lower, with a positive diagonal.
    innovation: DMatrix<f64>,
    /// `L'`, p x n.
    gain_transposed: DMatrix<f64>,
    /// `S+`, n rows.
    root: DMatrix<f64>,
}

impl Corrected {
    fn of(root: &DMatrix<f64>, c: &DMatrix<f64>, noise_factor: &DMatrix<f64>) -> Option<Self> {
        let ((n, r), p) = (root.shape(), c.nrows());
        let mut array = DMatrix::zeros(p + n, p + r);
        array.view_mut((0, 0), (p, p)).copy_from(noise_factor);
        array.view_mut((0, p), (p, r)).copy_from(&(c * root));
        array.view_mut((p, p), (n, r)).copy_from(root);
        for i in 0..p {
            for j in p..p + r {
                rotate(&mut array, i, j);
            }
        }
        let innovation = array.view((0, 0), (p, p)).into_owned();
        let moved = array.view((p, 0), (n, p)).into_owned();
        let gain_transposed = innovation.tr_solve_lower_triangular(&moved.transpose())?;
        let root = array.view((p, p), (n, r)).into_owned();
        let finite = [&innovation, &gain_transposed, &root].iter().all(|part| part.iter().all(|v| v.is_finite()));
        finite.then_some(Self { innovation, gain_transposed, root })
    }

    fn keep(&self, t: usize, belief: &mut Belief) {
        store(&mut belief.innovation_factor, t, &self.innovation);
        store(&mut belief.gain_transposed, t, &self.gain_transposed);
        store(&mut belief.corrected, t, &symmetric(&self.root * self.root.transpose()));
    }
}

/// Rotates columns `i` and `j` of `array`, from row `i` on, so that entry (i, j) vanishes.
fn rotate(array: &mut DMatrix<f64>, i: usize, j: usize) {
    let (kept, gone) = (array[(i, i)], array[(i, j)]);
    if gone == 0.0 {
        return;
    }
    let size = math::hypot(kept, gone);
    let (cos, sin) = (kept / size, gone / size);
    (array[(i, i)], array[(i, j)]) = (size, 0.0);
    for k in i + 1..array.nrows() {
        let (a, b) = (array[(k, i)], array[(k, j)]);
        (array[(k, i)], array[(k, j)]) = (cos * a + sin * b, cos * b - sin * a);
    }
}

/// A factor `S` of a positive semidefinite `P = S S'` with as many columns as its rank; each state is scaled.
fn root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    let size = covariance.diagonal().map(|v| if v > 0.0 { v.sqrt() } else { 0.0 });
    let scaled = |i: usize, j: usize| {
        let unit = size[i] * size[j];
        if unit > 0.0 { covariance[(i, j)] / unit } else { 0.0 }
    };
    let mut left = DMatrix::from_fn(n, n, scaled);
    let mut columns: Vec<nalgebra::DVector<f64>> = Vec::new();
    for _ in 0..n {
        let (pivot, largest) = (0..n).map(|i| (i, left[(i, i)])).fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
        if largest <= n as f64 * f64::EPSILON {
            break;
        }
        let column = left.column(pivot) / largest.sqrt();
        left -= &column * column.transpose();
        left.row_mut(pivot).fill(0.0);
        left.column_mut(pivot).fill(0.0);
        columns.push(column.component_mul(&size));
    }
    if columns.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&columns) }
}

/// The whole recursion (B.1) in square-root form.
pub(super) fn sweep(knots: &Knots, noise: &Noise, belief: &mut Belief) -> Result<(), Error> {
    let n = knots.dimensions.states;
    belief.repairs = 0;
    belief.form = Form::Roots;
    let factors = |matrices: &Matrices, of: &dyn Fn(&DMatrix<f64>) -> Option<DMatrix<f64>>| {
        (0..matrices.count()).map(|t| of(&dense(matrices, t))).collect::<Vec<_>>()
    };
    let process = factors(&noise.process, &|w| Some(root(w)));
    let measurement = factors(&noise.measurement, &cholesky);
    let at = |factors: &[Option<DMatrix<f64>>], t: usize| factors[t.min(factors.len() - 1)].clone();
    belief.predicted.at_mut(0).copy_from_slice(noise.initial.at(0));
    let mut factor = root(&dense(&noise.initial, 0));
    for t in 0..=knots.steps() {
        if t > 0 {
            let a = dense(&knots.dynamics, t - 1).columns(0, n).into_owned();
            let w = at(&process, t - 1).unwrap_or_else(|| DMatrix::zeros(n, 0));
            factor = beside(a * factor, &w);
            store(&mut belief.predicted, t, &symmetric(&factor * factor.transpose()));
        }
        let g = at(&measurement, t).ok_or(Error::NotPositiveDefinite { what: MEASUREMENT, step: t })?;
        let corrected = Corrected::of(&factor, &dense(&knots.measurement, t), &g)
            .ok_or(Error::NotFinite { what: "the innovation covariance", step: t })?;
        corrected.keep(t, belief);
        factor = corrected.root;
    }
    Ok(())
}

/// From `P_t` to `Sigma_t` with the noise `V`; `None` if `V` is not positive definite or a number is not finite.
pub(super) fn correct(t: usize, c: &DMatrix<f64>, v: &DMatrix<f64>, belief: &mut Belief) -> Option<()> {
    let corrected = Corrected::of(&root(&dense(&belief.predicted, t)), c, &cholesky(v)?)?;
    corrected.keep(t, belief);
    Some(())
}
