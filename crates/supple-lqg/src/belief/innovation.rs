//! Innovations: their covariance, and what the likelihood of measurements depends on.

use supple_kernels::rows::{Left, Long, Product, Rows, View, ViewMut, cholesky, dot, mirror};
use supple_kernels::{Job, Lanes, Matrices, dispatch, math};

use crate::knots::Dimensions;
use crate::shape::Shape;

/// The statistics of the innovation `nu = y - g(mu)` of one measurement that its likelihood depends on.
///
/// ```
/// use supple_lqg::Innovation;
///
/// // An innovation of 3 with the variance 4.
/// let found = Innovation::of(&mut [3.0], &[2.0], 1);
/// assert!((found.squared - 2.25).abs() < 1e-12);
/// assert!((found.log_determinant - 4f64.ln()).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Innovation {
    /// `nu' S^-1 nu`, with the innovation covariance `S`: its mean is p if the filter is consistent.
    pub squared: f64,
    /// `ln |S|`
    pub log_determinant: f64,
}

impl Innovation {
    /// From the lower Cholesky factor of `S`, rows `stride` apart; the solution overwrites `nu`.
    pub fn of(nu: &mut [f64], factor: &[f64], stride: usize) -> Self {
        let mut found = Self::default();
        for i in 0..nu.len() {
            let row = &factor[i * stride..=i * stride + i];
            let done: f64 = row.iter().zip(&nu[..i]).map(|(g, w)| g * w).sum();
            nu[i] = (nu[i] - done) / row[i];
            found.squared += nu[i] * nu[i];
            found.log_determinant += 2.0 * math::ln(row[i]);
        }
        found
    }
}

/// The innovation covariance `S^y = C P C' + V` of one step, and the memory to form it.
///
/// ```
/// use supple_lqg::{InnovationCovariance, constant};
///
/// // Position and velocity, of variances 3 and 1; the position is measured with variance 1.
/// let (c, predicted, v) = (constant(&[[1.0, 0.0]]), constant(&[[3.0, 0.5], [0.5, 1.0]]), constant(&[[1.0]]));
/// let mut innovation = InnovationCovariance::zeros(2, 1);
/// assert_eq!(innovation.form(c.at(0), predicted.at(0), v.at(0)).get(0, 0, 0), 4.0);
/// assert_eq!(innovation.factor().ok_or("V is positive")?.get(0, 0, 0), 2.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct InnovationCovariance {
    /// `C P`, p x n.
    cross: Matrices,
    covariance: Matrices,
}

impl InnovationCovariance {
    /// Zeros.
    #[must_use]
    pub fn zeros(states: usize, measurements: usize) -> Self {
        Self {
            cross: Matrices::constant(measurements, states),
            covariance: Matrices::constant(measurements, measurements),
        }
    }

    /// Forms it from `C`, `P` and `V`, as rows of [`Matrices`]: p x p, symmetric.
    pub fn form(&mut self, c: &[f64], predicted: &[f64], v: &[f64]) -> &Matrices {
        dispatch(Form { of: self, c, predicted, v });
        &self.covariance
    }

    /// The lower Cholesky factor of the covariance formed last; `None` if that is not positive definite.
    #[must_use]
    pub fn factor(&self) -> Option<Matrices> {
        let mut factor = self.covariance.clone();
        let (p, stride) = (factor.rows(), factor.stride());
        cholesky(factor.at_mut(0), p, stride).ok()?;
        Some(factor)
    }
}

struct Form<'a> {
    of: &'a mut InnovationCovariance,
    c: &'a [f64],
    predicted: &'a [f64],
    v: &'a [f64],
}

impl Job for Form<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { of: InnovationCovariance { cross, covariance }, c, predicted, v } = self;
        let (p, stride) = (cross.rows(), covariance.stride());
        let shape = Shape::<Long>::of(Dimensions { states: cross.cols(), controls: 0, measurements: p });
        form::<L, _>(shape, c, predicted, v, cross.at_mut(0), ViewMut::new(covariance.at_mut(0), stride));
        mirror::<L, Long>(ViewMut::new(covariance.at_mut(0), stride), p);
    }
}

/// `C P` and the lower triangle of `S^y = C P C' + V`.
#[inline(always)]
pub(super) fn form<L: Lanes, R: Rows>(
    shape: Shape<R>,
    c: &[f64],
    predicted: &[f64],
    v: &[f64],
    cross: &mut [f64],
    covariance: ViewMut,
) {
    let (Shape { n, p, .. }, ViewMut { numbers: covariance, stride }) = (shape, covariance);
    let (narrow, small) = (shape.narrow(), shape.small());
    let (left, right) = (Left::plain(c, narrow), View::new(predicted, narrow));
    Product { left, right, rows: p, inner: n, width: narrow }.set::<L, R>(ViewMut::new(cross, narrow));
    for i in 0..p {
        for j in 0..=i {
            let (row, other) = (&cross[i * narrow..i * narrow + n], &c[j * narrow..j * narrow + n]);
            covariance[i * stride + j] = dot(row, other) + v[i * small + j];
        }
    }
}
