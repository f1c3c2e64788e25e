//! Noise: covariances whose entries may be parameters, or that differ from step to step.

use supple_kernels::Matrices;
use supple_lqg::Error;
pub use supple_lqg::Noise;

use crate::Value;
use crate::value::symmetrise;

mod check;
mod keys;
mod named;
mod varying;

pub use check::check_matrices;
#[cfg(feature = "schema")]
pub use keys::with_deviation;
pub use keys::{DEVIATION, variances, with_noise_key};
pub use named::NamedVariance;
pub use varying::{VaryingNoise, VaryingVariance};

/// A covariance matrix whose entries are values: its diagonal, or all of it; or one matrix of numbers per step.
///
/// Example: [`NoiseModel`].
#[derive(Clone, Debug, PartialEq)]
pub enum Covariance {
    /// Variances on the diagonal; all other entries are 0.
    Diagonal(Vec<Value>),
    /// All entries, symmetric.
    Full(Vec<Vec<Value>>),
    /// Matrices of numbers, symmetric, one for each step: N of the process, N + 1 of the measurement.
    Sequence(Matrices),
}

impl Covariance {
    /// A diagonal covariance of independent entries with these variances: numbers or parameters.
    #[must_use]
    pub fn diagonal(variances: impl IntoIterator<Item = impl Into<Value>>) -> Self {
        Self::Diagonal(variances.into_iter().map(Into::into).collect())
    }

    /// A covariance of these rows, symmetric up to rounding, which is removed. [`NoiseModel::check`] finds any other.
    #[must_use]
    pub fn full(mut rows: Vec<Vec<Value>>) -> Self {
        if rows.iter().all(|row| row.len() == rows.len()) {
            // Stops at what is not symmetric.
            let _ = symmetrise(&mut rows);
        }
        Self::Full(rows)
    }

    /// Changes every entry that is a value.
    fn change(&mut self, change: impl Fn(&Value) -> Value) {
        match self {
            Self::Diagonal(variances) => variances.iter_mut().for_each(|value| *value = change(value)),
            Self::Full(rows) => rows.iter_mut().flatten().for_each(|value| *value = change(value)),
            Self::Sequence(_) => {}
        }
    }

    /// Adds `count` entries, each a sum of the present ones with factors: by index, what it is a sum of. The covariance `W`
    /// becomes `[I; F] W [I; F]'` with these factors `F`.
    ///
    /// A sequence of matrices is left as it is.
    pub fn extend(&mut self, count: usize, sum: impl Fn(usize) -> Vec<(usize, Value)>) {
        let sums: Vec<Vec<(usize, Value)>> = (0..count).map(sum).collect();
        let own = self.order();
        if let Self::Diagonal(variances) = self {
            if sums.iter().flatten().all(|(index, factor)| factor.is_zero() || variances[*index].is_zero()) {
                variances.resize(own + count, Value::Number(0.0));
                return;
            }
            let row = |(i, variance)| {
                let mut row = vec![Value::Number(0.0); own];
                row[i] = variance;
                row
            };
            *self = Self::Full(std::mem::take(variances).into_iter().enumerate().map(row).collect());
        }
        let Self::Full(rows) = self else { return };
        for row in rows.iter_mut() {
            let added: Vec<Value> = sums.iter().map(|sum| combined(sum, |index| &row[index])).collect();
            row.extend(added);
        }
        for sum in &sums {
            let row = (0..own + count).map(|j| combined(sum, |index| &rows[index][j])).collect();
            rows.push(row);
        }
    }

    /// Its order.
    #[must_use]
    pub fn order(&self) -> usize {
        match self {
            Self::Diagonal(entries) => entries.len(),
            Self::Full(rows) => rows.len(),
            Self::Sequence(matrices) => matrices.rows(),
        }
    }

    /// Every entry of a matrix for all steps that is not the number 0: row, column, value.
    fn entries(&self) -> impl Iterator<Item = (usize, usize, &Value)> {
        let diagonal = match self {
            Self::Diagonal(entries) => entries.as_slice(),
            Self::Full(_) | Self::Sequence(_) => &[],
        };
        let full = match self {
            Self::Diagonal(_) | Self::Sequence(_) => [].as_slice(),
            Self::Full(rows) => rows.as_slice(),
        };
        let diagonal = diagonal.iter().enumerate().map(|(i, value)| (i, i, value));
        let full =
            full.iter().enumerate().flat_map(|(i, row)| row.iter().enumerate().map(move |(j, value)| (i, j, value)));
        diagonal.chain(full).filter(|(_, _, value)| !value.is_zero())
    }

    /// Writes the matrix at given parameters: a constant one, or one for each step. Does not allocate if `out` has
    /// already held it.
    pub fn resolve(&self, phi: &[f64], out: &mut Matrices) {
        if let Self::Sequence(matrices) = self {
            if out.is_constant() || (out.count(), out.rows()) != (matrices.count(), matrices.rows()) {
                *out = matrices.clone();
            } else {
                out.copy_from(matrices);
            }
            return;
        }
        if !out.is_constant() || out.rows() != self.order() {
            *out = Matrices::constant(self.order(), self.order());
        }
        out.clear();
        for (i, j, value) in self.entries() {
            out.set(0, i, j, value.resolve(phi));
        }
    }

    /// Writes the matrix at given parameters for each of `count` steps, even if constant. Does not allocate
    /// if `out` has already held it.
    fn resolve_each(&self, phi: &[f64], count: usize, out: &mut Matrices) {
        if let Self::Sequence(_) = self {
            return self.resolve(phi, out);
        }
        if out.is_constant() || (out.count(), out.rows()) != (count, self.order()) {
            *out = Matrices::zeros(count, self.order(), self.order());
        }
        out.clear();
        for (i, j, value) in self.entries() {
            let value = value.resolve(phi);
            (0..count).for_each(|step| out.set(step, i, j, value));
        }
    }

    /// Adds to `parameters` the gradient of a number, given its adjoint `adjoint` with respect to this matrix: per step, or
    /// summed over all steps.
    pub fn add_gradient(&self, phi: &[f64], adjoint: &Matrices, parameters: &mut [f64]) {
        for (i, j, value) in self.entries() {
            if !matches!(value, Value::Number(_)) {
                let sum: f64 = (0..adjoint.count()).map(|step| adjoint.get(step, i, j)).sum();
                value.add_gradient(phi, sum, parameters);
            }
        }
    }
}

/// The sum of entries times factors: by index, what it is a sum of.
fn combined<'a>(sum: &[(usize, Value)], entry: impl Fn(usize) -> &'a Value) -> Value {
    let terms = sum.iter().map(|(index, factor)| entry(*index).times(factor));
    terms.reduce(|sum, term| sum.plus(&term)).unwrap_or(Value::Number(0.0))
}

/// The noise of a task.
///
/// ```
/// use supple_model::noise::{Covariance, Noise, NoiseModel};
/// use supple_model::parameters::{Parameter, Parameters};
///
/// // Two states and a sensor whose variance, m^2, is a parameter.
/// let mut parameters = Parameters::default();
/// let variance = parameters.declare(Parameter::new("variance", 1e-4, [1e-6, 1e-2]).with_unit("m^2"));
/// let (initial, process) = (Covariance::diagonal([1e-2, 1e-2]), Covariance::diagonal([0.0, 1e-3]));
/// let model = NoiseModel::new(initial, process, Covariance::diagonal([variance]));
/// let mut noise = Noise::zeros(2, 1);
/// model.resolve(&parameters.initial(), &mut noise)?;
/// assert_eq!((noise.process.get(0, 1, 1), noise.measurement.get(0, 0, 0)), (1e-3, 1e-4));
/// # Ok::<(), supple_lqg::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct NoiseModel {
    /// `X_0`, n x n: covariance of the first state.
    pub initial: Covariance,
    /// `W`, n x n: covariance of the process noise in each step 0..N-1; may be singular.
    pub process: Covariance,
    /// `V`, p x p: covariance of the measurement noise at each step 0..N; positive definite.
    pub measurement: Covariance,
    /// State-dependent additions to the variances of measurements; usually none.
    pub varying: Vec<VaryingVariance>,
}

impl NoiseModel {
    /// `X_0`, `W` and `V`, the same in every state.
    #[must_use]
    pub fn new(initial: Covariance, process: Covariance, measurement: Covariance) -> Self {
        Self { initial, process, measurement, varying: Vec::new() }
    }

    /// Converts noise given per second to noise per step: process variances are multiplied by the time step,
    /// measurement variances are divided by it.
    pub fn per_second(&mut self, time_step: &Value) {
        self.process.change(|variance| variance.times(time_step));
        self.measurement.change(|variance| variance.over(time_step));
        self.varying.iter_mut().for_each(|varying| varying.coefficient = varying.coefficient.over(time_step));
    }

    /// Clears `noise` for use as adjoints along `steps` steps. Where the noise varies with the state, there is a matrix for
    /// each step; otherwise the layout is unchanged.
    pub fn clear(&self, noise: &mut Noise, steps: usize) {
        if self.varying.is_empty() { noise.clear() } else { noise.clear_each(steps) }
    }

    /// Writes the covariances at given parameters, without state-dependent parts.
    ///
    /// # Errors
    /// If a variance is negative or not finite.
    pub fn resolve(&self, phi: &[f64], out: &mut Noise) -> Result<(), Error> {
        self.measurement.resolve(phi, &mut out.measurement);
        self.resolve_states(phi, out)
    }

    /// Writes the covariances at given parameters along `states`, N + 1 vectors of length n. Where none varies with the
    /// state, this is [`resolve`](Self::resolve).
    ///
    /// # Errors
    /// If a variance, or an addition to it, is negative or not finite.
    pub fn resolve_along(&self, phi: &[f64], states: &Matrices, out: &mut Noise) -> Result<(), Error> {
        if self.varying.is_empty() {
            return self.resolve(phi, out);
        }
        self.measurement.resolve_each(phi, states.count(), &mut out.measurement);
        self.resolve_states(phi, out)?;
        for varying in &self.varying {
            varying.add_along(phi, states, &mut out.measurement)?;
        }
        Ok(())
    }

    /// Writes the covariances of the states, and checks these and that of the measurement.
    fn resolve_states(&self, phi: &[f64], out: &mut Noise) -> Result<(), Error> {
        self.initial.resolve(phi, &mut out.initial);
        self.process.resolve(phi, &mut out.process);
        let parts = [
            (&out.initial, "the covariance of the first state"),
            (&out.process, "the process covariance"),
            (&out.measurement, "the measurement covariance"),
        ];
        for (out, what) in parts {
            for (step, i) in (0..out.count()).flat_map(|step| (0..out.rows()).map(move |i| (step, i))) {
                let variance = out.get(step, i, i);
                if !variance.is_finite() {
                    return Err(Error::NotFinite { what, step });
                }
                if variance < 0.0 {
                    return Err(Error::NotPositiveDefinite { what, step });
                }
            }
        }
        Ok(())
    }

    /// Adds to `parameters` the gradient of a number, given its adjoints `adjoint` for the covariances along `states`, N + 1
    /// vectors of length n, which are held fixed.
    ///
    /// Where the noise varies with the state, the adjoint of `V` has a matrix for each step, see [`clear`](Self::clear).
    pub fn add_gradient(&self, phi: &[f64], states: &Matrices, adjoint: &Noise, parameters: &mut [f64]) {
        self.initial.add_gradient(phi, &adjoint.initial, parameters);
        self.process.add_gradient(phi, &adjoint.process, parameters);
        self.measurement.add_gradient(phi, &adjoint.measurement, parameters);
        for varying in &self.varying {
            varying.add_gradient(phi, states, &adjoint.measurement, parameters);
        }
    }

    /// Adds the gradient with respect to the states, given the same adjoints, to the linear terms of `joint`:
    /// its last column, rows 0..n, at each of the N + 1 steps. Adds nothing if no variance depends on the state.
    pub fn add_state_gradient(&self, phi: &[f64], states: &Matrices, adjoint: &Noise, joint: &mut Matrices) {
        for varying in &self.varying {
            varying.add_state_gradient(phi, states, &adjoint.measurement, joint);
        }
    }
}
