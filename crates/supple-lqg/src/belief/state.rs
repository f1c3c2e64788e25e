use supple_kernels::rows::{add_scaled, scale};
use supple_kernels::{Lanes, Matrices, padded};

use crate::Error;
use crate::arrays::FromEntries;
use crate::given::{Given, check_count};
use crate::knots::Dimensions;
use crate::transport::Transport;

/// The belief along a trajectory: covariances, gains and innovation factors.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug)]
pub struct Belief {
    /// `P_t`, n x n, N + 1 of them: before the measurement at t.
    pub predicted: Matrices,
    /// `Sigma_t`, n x n, N + 1 of them: after it.
    pub corrected: Matrices,
    /// Transposed Kalman gain `L_t'`, p x n, N + 1 of them.
    pub gain_transposed: Matrices,
    /// Lower Cholesky factor of `S^y_t = C P C' + V`, p x p, N + 1 of them; or, if measurements are processed sequentially,
    /// the square roots of their innovation variances on the diagonal, whose product is the same.
    pub innovation_factor: Matrices,
    /// Rows of the covariance at the measured states, p x n, N + 1 of them, if measurements are processed sequentially.
    pub(super) pivots: Matrices,
    /// How the last sweep processed measurements.
    pub(super) form: Form,
    /// Number of repairs that restored positive semidefiniteness of `Sigma`.
    pub repairs: usize,
    pub(super) work: Work,
}

/// How measurements are processed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// All of a step together.
    Together,
    /// One at a time.
    EachAlone,
    /// All together, with square roots of the covariances.
    Roots,
}

/// Memory of one step.
#[derive(Clone, Debug)]
pub(super) struct Work {
    pub transport: Transport,
    /// `C P`, p x n.
    pub cross: Matrices,
    /// `[S^y | C P]`, overwritten during the step: each in whole lanes.
    pub innovation: Matrices,
    /// Reciprocals of the diagonal of the factor of `S^y`.
    pub reciprocals: Matrices,
    /// A factor of `V`, p x p, and a column, p, where `V` is not diagonal.
    pub noise_factor: Matrices,
    pub column: Matrices,
}

impl Belief {
    /// Zeros for `steps` steps.
    #[must_use]
    pub fn zeros(states: usize, measurements: usize, steps: usize) -> Self {
        let (n, p) = (states, measurements);
        Self {
            predicted: Matrices::zeros(steps + 1, n, n),
            corrected: Matrices::zeros(steps + 1, n, n),
            gain_transposed: Matrices::zeros(steps + 1, p, n),
            innovation_factor: Matrices::zeros(steps + 1, p, p),
            pivots: Matrices::zeros(steps + 1, p, n),
            form: Form::Together,
            repairs: 0,
            work: Work {
                transport: Transport::new(n, n),
                cross: Matrices::zeros(1, p, n),
                innovation: Matrices::zeros(1, p, padded(p) + n),
                reciprocals: Matrices::vectors(1, p),
                noise_factor: Matrices::zeros(1, p, p),
                column: Matrices::vectors(1, p),
            },
        }
    }

    /// The Kalman gain `L_t`, of n rows and p columns, as nested `Vec`s or as a matrix of another library.
    ///
    /// # Panics
    /// If there is no step `t`.
    ///
    /// ```
    /// use supple_lqg::{Belief, Knots, LinearQuadratic, Noise, constant, kalman};
    ///
    /// let (a, b, c) = ([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]], [[1.0, 0.0]]);
    /// let plant = LinearQuadratic { a: &a, b: &b, c: &c, q: &[[1.0, 0.0], [0.0, 0.1]], r: &[[0.01]] };
    /// let knots = Knots::linear(50, plant)?;
    /// let three = constant(&[[3.0, 0.0], [0.0, 3.0]]);
    /// let noise = Noise { initial: three.clone(), process: three, measurement: constant(&[[1.0]]) };
    /// let mut belief = Belief::zeros(2, 1, 50);
    /// kalman(&knots, &noise, &mut belief)?;
    /// assert_eq!(belief.gain::<Vec<Vec<f64>>>(0), [[0.75], [0.0]]);
    /// # Ok::<(), supple_lqg::Error>(())
    /// ```
    #[must_use]
    pub fn gain<M: FromEntries>(&self, t: usize) -> M {
        let of = &self.gain_transposed;
        M::from_entries(of.cols(), of.rows(), |row, col| of.get(t, col, row))
    }

    /// Whether its arrays are of `steps` steps and these sizes.
    pub(crate) fn check_shapes(&self, dimensions: Dimensions, steps: usize) -> Result<(), Error> {
        let Dimensions { states: n, measurements: p, .. } = dimensions;
        Given { what: "the belief's gain", array: &self.gain_transposed, shape: (p, n), count: 0 }.check_shape()?;
        check_count("the belief", self.gain_transposed.count(), steps + 1)
    }

    /// The columns of a factor, n x p, of the covariance reduction by the measurements at step `t`, `L S^y L' = P - Sigma`,
    /// as rows in whole lanes.
    #[inline(always)]
    pub(crate) fn write_reduction<L: Lanes>(&self, t: usize, out: &mut [f64]) {
        let (factor, gain) = (self.innovation_factor.at(t), self.gain_transposed.at(t));
        let (p, small) = (self.innovation_factor.rows(), self.innovation_factor.stride());
        let narrow = self.gain_transposed.stride();
        for (j, out) in out.chunks_exact_mut(narrow).enumerate() {
            if self.form == Form::EachAlone {
                out.copy_from_slice(&self.pivots.at(t)[j * narrow..(j + 1) * narrow]);
                scale::<L>(out, 1.0 / factor[j * (small + 1)]);
            } else {
                out.fill(0.0);
                for i in j..p {
                    add_scaled::<L>(out, factor[i * small + j], &gain[i * narrow..(i + 1) * narrow]);
                }
            }
        }
    }
}
