//! Noise as covariance matrices.

use supple_kernels::Matrices;

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
