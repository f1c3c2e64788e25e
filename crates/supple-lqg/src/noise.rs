//! Noise as covariance matrices.

use supple_kernels::Matrices;

use crate::Error;
use crate::given::{Given, INITIAL, MEASUREMENT, PROCESS};
use crate::knots::Dimensions;

/// Noise: covariance matrices of each step, or constant ones that hold at every step.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug)]
pub struct Noise {
    /// `X_0`, n x n.
    pub initial: Matrices,
    /// `W`, n x n.
    pub process: Matrices,
    /// `V`, p x p.
    pub measurement: Matrices,
}

impl Noise {
    /// Zeros of the right shapes that hold at every step.
    #[must_use]
    pub fn zeros(states: usize, measurements: usize) -> Self {
        Self {
            initial: Matrices::constant(states, states),
            process: Matrices::constant(states, states),
            measurement: Matrices::constant(measurements, measurements),
        }
    }

    /// Whether the arrays fit a plant over `steps` steps.
    ///
    /// # Errors
    /// Which one does not.
    pub fn check_shapes(&self, dimensions: Dimensions, steps: usize) -> Result<(), Error> {
        self.given(dimensions, steps).iter().try_for_each(Given::check_shape)
    }

    /// Whether the arrays fit a plant over `steps` steps and are finite, `X_0` and `W` are symmetric and positive
    /// semidefinite, and `V` is symmetric with positive variances. Whether a `V` with correlations is positive definite is
    /// found where it is factorised.
    ///
    /// # Errors
    /// Which one is not, and where.
    ///
    /// ```
    /// use supple_lqg::{Dimensions, Noise, constant};
    ///
    /// let mut noise = Noise::zeros(2, 1);
    /// noise.process = constant(&[[1.0, 2.0], [2.0, 1.0]]);
    /// let found = noise.check(Dimensions { states: 2, controls: 1, measurements: 1 }, 10);
    /// let message = found.err().map(|error| error.to_string());
    /// let what = "the process covariance must be symmetric and positive semidefinite; at step 0 entry [1][0] is 2.0, ";
    /// assert!(message.is_some_and(|message| message.starts_with(what)));
    /// ```
    pub fn check(&self, dimensions: Dimensions, steps: usize) -> Result<(), Error> {
        let [initial, process, measurement] = self.given(dimensions, steps);
        initial.check_covariance()?;
        process.check_covariance()?;
        measurement.check_variances()
    }

    /// Whether `V` alone fits, as in [`Noise::check`].
    pub(crate) fn check_measurement(&self, dimensions: Dimensions, steps: usize) -> Result<(), Error> {
        let [_, _, measurement] = self.given(dimensions, steps);
        measurement.check_variances()
    }

    /// `X_0`, `W` and `V`.
    fn given(&self, Dimensions { states: n, measurements: p, .. }: Dimensions, steps: usize) -> [Given<'_>; 3] {
        [
            Given { what: INITIAL, array: &self.initial, shape: (n, n), count: 1 },
            Given { what: PROCESS, array: &self.process, shape: (n, n), count: steps },
            Given { what: MEASUREMENT, array: &self.measurement, shape: (p, p), count: steps + 1 },
        ]
    }

    /// Whether `V` is diagonal at every step, so that measurements can be taken one at a time.
    #[must_use]
    pub fn measurements_are_independent(&self) -> bool {
        let v = &self.measurement;
        let independent = |t| (0..v.rows()).all(|i| (0..v.rows()).all(|j| i == j || v.get(t, i, j) == 0.0));
        (0..v.count()).all(independent)
    }

    /// Sets everything to 0.
    pub fn clear(&mut self) {
        self.initial.clear();
        self.process.clear();
        self.measurement.clear();
    }

    /// Sets everything to 0, with a matrix of the measurement for each of `steps + 1` steps.
    pub fn clear_each(&mut self, steps: usize) {
        if self.measurement.is_constant() || self.measurement.count() != steps + 1 {
            self.measurement = Matrices::zeros(steps + 1, self.measurement.rows(), self.measurement.rows());
        }
        self.clear();
    }
}
