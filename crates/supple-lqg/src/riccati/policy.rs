use supple_kernels::rows::dot;
use supple_kernels::{Matrices, padded};

use super::box_qp::BoxQp;
use super::limits::Limits;
use super::products::Products;
use crate::Error;
use crate::dense::are_finite;
use crate::given::{Given, check_count};
use crate::knots::Dimensions;

/// The control law and the cost-to-go that a backward sweep finds: `u = ubar + k + K (mu - xbar)`.
///
/// Example: [`solve_riccati`](crate::solve_riccati).
#[derive(Clone, Debug)]
pub struct Policy {
    /// Feedback `K`, m x n, N of them.
    pub feedback: Matrices,
    /// Feedforward `k`, length m, N of them.
    pub feedforward: Matrices,
    /// Curvature of the cost-to-go `S = J_xx`, n x n, N + 1 of them.
    pub curvature: Matrices,
    /// Slope of the cost-to-go `J_x`, length n, N + 1 of them.
    pub slope: Matrices,
    /// Value of information `Xi = K' Q_uu K`, n x n, N of them: of the last sweep that computed it.
    pub value_of_information: Matrices,
    /// Which controls are held at a bound, so that their rows of `K` are zero: m of each of N steps.
    pub clamped: Vec<bool>,
    pub(super) box_qp: BoxQp,
    /// `Q` of one step (only the lower triangle is computed), with room after its last row.
    pub(super) q: Matrices,
    /// Its slope `Q_z`.
    pub(super) q_slope: Matrices,
    /// `[Q_uu | Q_ux | Q_u]` of one step, overwritten during the step: `Q_uu` and the others each in whole lanes.
    pub(super) gain: Matrices,
    /// Reciprocals of the diagonal of the factor of `Q_uu`.
    pub(super) reciprocals: Matrices,
    pub(super) products: Products,
    /// `U`, m x m, of `Q_uu = U' U`, N of them, if they are kept: from the last sweep without limits or regularisation.
    /// Entries below the diagonal are meaningless.
    pub(super) roots: Option<Matrices>,
}

impl Policy {
    /// Zeros for `steps` steps.
    #[must_use]
    pub fn zeros(dimensions: Dimensions, steps: usize) -> Self {
        let (n, m, joint) = (dimensions.states, dimensions.controls, dimensions.joint());
        Self {
            feedback: Matrices::zeros(steps, m, n),
            feedforward: Matrices::vectors(steps, m),
            curvature: Matrices::zeros(steps + 1, n, n),
            slope: Matrices::vectors(steps + 1, n),
            value_of_information: Matrices::zeros(steps, n, n),
            clamped: vec![false; steps * m],
            box_qp: BoxQp::new(m),
            q: Matrices::zeros(1, joint + 1, joint),
            q_slope: Matrices::vectors(1, joint),
            gain: Matrices::zeros(1, m, padded(m) + n + 1),
            reciprocals: Matrices::vectors(1, m),
            products: Products::new(n, m),
            roots: None,
        }
    }

    /// From now on sweeps store the Cholesky factors of `Q_uu`, which [`Rooted`](crate::Rooted) reads.
    pub fn keep_roots(&mut self) {
        let (steps, m) = (self.feedback.count(), self.feedback.rows());
        self.roots.get_or_insert_with(|| Matrices::zeros(steps, m, m));
    }

    /// Writes the control `u = ubar + step k + K (x - xbar)` of step `t` at the state `x`.
    pub fn control(&self, t: usize, step: f64, x: &[f64], [xbar, ubar]: [&[f64]; 2], u: &mut [f64]) {
        let (gains, stride) = (self.feedback.at(t), self.feedback.stride());
        for (u, (ubar, k)) in u.iter_mut().zip(ubar.iter().zip(self.feedforward.vector(t))) {
            *u = ubar + step * k;
        }
        // Some columns of K at a time, so that all rows use the same differences.
        let mut differences = [0.0; 64];
        for (number, (x, xbar)) in x.chunks(differences.len()).zip(xbar.chunks(differences.len())).enumerate() {
            let first = number * differences.len();
            let differences = &mut differences[..x.len()];
            for (difference, (x, xbar)) in differences.iter_mut().zip(x.iter().zip(xbar)) {
                *difference = x - xbar;
            }
            for (u, gains) in u.iter_mut().zip(gains.chunks(stride)) {
                *u += dot(&gains[first..first + differences.len()], differences);
            }
        }
    }

    /// Whether its arrays are of `steps` steps and these sizes.
    pub(crate) fn check_shapes(&self, dimensions: Dimensions, steps: usize) -> Result<(), Error> {
        let Dimensions { states: n, controls: m, .. } = dimensions;
        Given { what: "the policy's feedback", array: &self.feedback, shape: (m, n), count: 0 }.check_shape()?;
        check_count("the policy", self.feedback.count(), steps)
    }

    /// Whether the cost-to-go from the first step on is finite.
    pub(super) fn starts_finite(&self) -> bool {
        are_finite(self.curvature.at(0)) && are_finite(self.slope.at(0))
    }

    /// The step from which on, backwards, the cost-to-go is not finite, as an error.
    #[cold]
    pub(super) fn not_finite(&self) -> Error {
        let is_bad = |t: &usize| !are_finite(self.curvature.at(*t)) || !are_finite(self.slope.at(*t));
        let step = (0..self.curvature.count()).rev().find(is_bad).unwrap_or_default();
        Error::NotFinite { what: "the cost-to-go", step }
    }

    /// The sizes of the sweep.
    pub(super) fn dimensions(&self) -> Dimensions {
        Dimensions { states: self.feedback.cols(), controls: self.feedback.rows(), measurements: 0 }
    }

    /// The same controls held, as limits for another sweep; `None` if all are free.
    #[must_use]
    pub fn held(&self) -> Option<Limits<'_>> {
        self.clamped.contains(&true).then_some(Limits::Held(&self.clamped))
    }
}
