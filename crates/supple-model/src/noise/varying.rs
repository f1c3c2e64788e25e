use supple_kernels::Matrices;
use supple_lqg::Error;

use crate::Value;

/// A part of a measurement's variance that grows with the distance of a state from its best-measured value:
///
/// ```text
/// V_jj(x) = V_jj + coefficient (x_i - center)^2
/// ```
///
/// ```
/// use supple_model::noise::{VaryingNoise, VaryingVariance};
///
/// // The variance of measurement 0 grows with the distance of state 1 from 0.5.
/// let camera = VaryingVariance { measurement: 0, state: 1, center: 0.5.into(), coefficient: 0.01.into() };
/// let added = VaryingNoise::of(&camera, &[]).at(&[0.0, 2.5]);
/// assert!((added - 0.04).abs() < 1e-12);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct VaryingVariance {
    /// The measurement, j.
    pub measurement: usize,
    /// The state, i.
    pub state: usize,
    /// The state value at which the measurement is most accurate, in its unit.
    pub center: Value,
    /// Variance per square of the state's unit: at least 0.
    pub coefficient: Value,
}

impl VaryingVariance {
    /// Adds to the variances along `states`.
    ///
    /// # Errors
    /// If an added variance is negative or not finite.
    pub(super) fn add_along(&self, phi: &[f64], states: &Matrices, variances: &mut Matrices) -> Result<(), Error> {
        let varying = VaryingNoise::of(self, phi);
        for step in 0..variances.count() {
            let added = varying.at(states.vector(step));
            let what = "what is added to a variance that varies with the state";
            if !added.is_finite() {
                return Err(Error::NotFinite { what, step });
            }
            if added < 0.0 {
                return Err(Error::NotPositiveDefinite { what, step });
            }
            varying.add(states.vector(step), variances, step);
        }
        Ok(())
    }

    /// Gradient with respect to center and coefficient: the adjoint of `V_jj` at each step times its derivatives.
    pub(super) fn add_gradient(&self, phi: &[f64], states: &Matrices, adjoint: &Matrices, parameters: &mut [f64]) {
        let VaryingNoise { measurement: j, state, center, coefficient } = VaryingNoise::of(self, phi);
        let (mut by_center, mut by_coefficient) = (0.0, 0.0);
        for step in 0..states.count() {
            let (away, adjoint) = (states.vector(step)[state] - center, adjoint.get(step, j, j));
            by_center -= adjoint * 2.0 * coefficient * away;
            by_coefficient += adjoint * away * away;
        }
        self.center.add_gradient(phi, by_center, parameters);
        self.coefficient.add_gradient(phi, by_coefficient, parameters);
    }

    /// Gradient with respect to the state: the adjoint of `V_jj` times its derivative, added to the last column.
    pub(super) fn add_state_gradient(&self, phi: &[f64], states: &Matrices, adjoint: &Matrices, joint: &mut Matrices) {
        let VaryingNoise { measurement: j, state, center, coefficient } = VaryingNoise::of(self, phi);
        let column = joint.cols() - 1;
        for step in 0..states.count() {
            let slope = 2.0 * coefficient * (states.vector(step)[state] - center);
            let sum = joint.get(step, state, column) + adjoint.get(step, j, j) * slope;
            joint.set(step, state, column, sum);
        }
    }
}

/// The same at given parameters.
///
/// Example: [`VaryingVariance`].
#[derive(Clone, Copy, Debug)]
pub struct VaryingNoise {
    /// The measurement whose variance varies, from 0.
    pub measurement: usize,
    state: usize,
    center: f64,
    coefficient: f64,
}

impl VaryingNoise {
    /// Its numbers at `phi`.
    #[must_use]
    pub fn of(varying: &VaryingVariance, phi: &[f64]) -> Self {
        let VaryingVariance { measurement, state, center, coefficient } = varying;
        let [center, coefficient] = [center, coefficient].map(|value| value.resolve(phi));
        Self { measurement: *measurement, state: *state, center, coefficient }
    }

    /// What is added to the variance at a state.
    #[inline]
    #[must_use]
    pub fn at(&self, state: &[f64]) -> f64 {
        self.coefficient * (state[self.state] - self.center).powi(2)
    }

    /// Adds this variance to matrix `index`.
    #[inline]
    pub fn add(&self, state: &[f64], variances: &mut Matrices, index: usize) {
        let sum = variances.get(index, self.measurement, self.measurement) + self.at(state);
        variances.set(index, self.measurement, self.measurement, sum);
    }
}
