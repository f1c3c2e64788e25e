//! What noise must satisfy.

use supple_kernels::{Matrices, rows};
use supple_lqg::{Dimensions, refuse_indefinite};
use supple_text::digits;

use super::{Covariance, NoiseModel, VaryingVariance};
use crate::document::Unfit;
use crate::parameters::Parameters;
use crate::value::symmetrise;
use crate::{Value, ValueError};

/// Asymmetry of a matrix of numbers up to this, relative to its largest entry, is rounding.
const ROUNDING: f64 = 1e-12;

impl NoiseModel {
    /// Checks it for a system of these sizes over `steps` steps: shapes; variances within the bounds of the parameters;
    /// symmetry and definiteness at their initial values.
    ///
    /// # Errors
    /// What is wrong, below the table of the noise: `process[2]` for the third variance of the process.
    ///
    /// ```
    /// use supple_model::Dimensions;
    /// use supple_model::noise::{Covariance, NoiseModel};
    /// use supple_model::parameters::Parameters;
    ///
    /// let [initial, process, measurement] = [[0.1, 0.1], [0.0, 0.1], [1e-4, 0.0]].map(Covariance::diagonal);
    /// let noise = NoiseModel::new(initial, process, measurement);
    /// let size = Dimensions { states: 2, controls: 1, measurements: 2 };
    /// let wrong = noise.check(size, 10, &Parameters::default()).err().map(|unfit| unfit.to_string());
    /// let expected = "measurement[1]: must be above 0, as every sensor has some noise; found 0";
    /// assert_eq!(wrong.as_deref(), Some(expected));
    /// ```
    pub fn check(&self, size: Dimensions, steps: usize, parameters: &Parameters) -> Result<(), Unfit> {
        self.check_shapes(size, steps)?;
        self.check_numbers(parameters)?;
        self.rules(size, steps).into_iter().try_for_each(|(rule, covariance)| rule.check_values(covariance, parameters))
    }

    /// The part of [`check`](Self::check) that takes no time: shapes, and places of what varies with the state.
    ///
    /// # Errors
    /// As of [`check`](Self::check).
    pub fn check_shapes(&self, size: Dimensions, steps: usize) -> Result<(), Unfit> {
        self.rules(size, steps).into_iter().try_for_each(|(rule, covariance)| rule.check_shape(covariance))?;
        for (number, &VaryingVariance { measurement, state, .. }) in self.varying.iter().enumerate() {
            let places = [("measurement", measurement, size.measurements), ("state", state, size.states)];
            if let Some((key, place, count)) = places.into_iter().find(|(_, place, count)| place >= count) {
                let message = format!("must be below {count}, the number of {key}s; found {place}");
                return Err(Unfit::new(key, message).below(number).below("varying"));
            }
        }
        Ok(())
    }

    /// Checks that all entries are numbers, and use no parameter that there is not.
    ///
    /// # Errors
    /// As of [`check`](Self::check).
    pub fn check_numbers(&self, parameters: &Parameters) -> Result<(), Unfit> {
        for (key, covariance) in
            [("initial", &self.initial), ("process", &self.process), ("measurement", &self.measurement)]
        {
            check_numbers(covariance, parameters).map_err(|unfit| unfit.below(key))?;
        }
        for (number, VaryingVariance { center, coefficient, .. }) in self.varying.iter().enumerate() {
            for (key, value) in [("center", center), ("coefficient", coefficient)] {
                let wrong = |wrong: ValueError| Unfit::new(key, wrong.to_string()).below(number).below("varying");
                parameters.number(value).map_err(wrong)?;
            }
        }
        Ok(())
    }

    fn rules(&self, size: Dimensions, steps: usize) -> [(Rule, &Covariance); 3] {
        let (order, definite) = (size.states, false);
        [
            (Rule { key: "initial", order, count: 1, definite }, &self.initial),
            (Rule { key: "process", order, count: steps, definite }, &self.process),
            (
                Rule { key: "measurement", order: size.measurements, count: steps + 1, definite: true },
                &self.measurement,
            ),
        ]
    }
}

/// What a covariance must be.
#[derive(Clone, Copy)]
struct Rule {
    key: &'static str,
    order: usize,
    /// How many matrices a sequence has.
    count: usize,
    /// Whether it must be positive definite, rather than semidefinite.
    definite: bool,
}

impl Rule {
    fn unfit(self, message: impl Into<String>) -> Unfit {
        Unfit::new(self.key, message)
    }

    fn check_shape(self, covariance: &Covariance) -> Result<(), Unfit> {
        let Self { order, count, .. } = self;
        let message = match covariance {
            Covariance::Diagonal(variances) if variances.len() != order => {
                format!("must have {order} variances; found {}", variances.len())
            }
            Covariance::Full(rows) if rows.len() != order || rows.iter().any(|row| row.len() != order) => {
                let widths: Vec<_> = rows.iter().map(Vec::len).collect();
                format!("must be {order} x {order}; found rows of {widths:?} numbers")
            }
            Covariance::Sequence(matrices)
                if (matrices.count(), matrices.rows(), matrices.cols()) != (count, order, order) =>
            {
                let (found, rows, cols) = (matrices.count(), matrices.rows(), matrices.cols());
                let matrices = if count == 1 { "matrix" } else { "matrices" };
                format!("must be {count} {matrices} of {order} x {order}; found {found} of {rows} x {cols}")
            }
            _ => return Ok(()),
        };
        Err(self.unfit(message))
    }

    /// Checks the entries of a covariance of the right shape.
    fn check_values(self, covariance: &Covariance, parameters: &Parameters) -> Result<(), Unfit> {
        let Self { order, .. } = self;
        match covariance {
            Covariance::Diagonal(variances) => {
                for (i, variance) in variances.iter().enumerate() {
                    self.variance(variance, parameters).map_err(|message| self.unfit(message).entry(i))?;
                }
            }
            Covariance::Full(rows) => {
                for (i, row) in rows.iter().enumerate() {
                    self.variance(&row[i], parameters).map_err(|message| self.unfit(message).entry(i).entry(i))?;
                }
                symmetrise(&mut rows.clone()).map_err(|found| {
                    self.unfit(found.message(&parameters.names())).entry(found.row).entry(found.column)
                })?;
            }
            Covariance::Sequence(matrices) => {
                return check_matrices(matrices, self.definite).map_err(|unfit| unfit.below(self.key));
            }
        }
        let mut matrix = Matrices::constant(order, order);
        covariance.resolve(&parameters.initial(), &mut matrix);
        definiteness(&matrix, 0, self.definite).map_err(|message| self.unfit(message))
    }

    /// Checks a variance, given the parameters' bounds.
    fn variance(self, variance: &Value, parameters: &Parameters) -> Result<(), String> {
        let Some(least) = parameters.least(variance) else { return Ok(()) };
        let valid = match self.definite {
            true if least <= 0.0 => "must be above 0, as every sensor has some noise",
            _ if least < 0.0 => "must be at least 0, as a variance",
            _ => return Ok(()),
        };
        Err(format!("{valid}; {}", variance.found(least)))
    }
}

/// Checks that the entries of a covariance are numbers, and use no parameter that there is not.
fn check_numbers(covariance: &Covariance, parameters: &Parameters) -> Result<(), Unfit> {
    let check = |value: &Value| parameters.number(value).map(drop).map_err(|wrong| Unfit::here(wrong.to_string()));
    match covariance {
        Covariance::Diagonal(variances) => {
            variances.iter().enumerate().try_for_each(|(i, value)| check(value).map_err(|unfit| unfit.entry(i)))
        }
        Covariance::Full(rows) => rows.iter().enumerate().try_for_each(|(i, row)| {
            let mut entries = row.iter().enumerate();
            entries.try_for_each(|(j, value)| check(value).map_err(|unfit| unfit.entry(i).entry(j)))
        }),
        Covariance::Sequence(_) => Ok(()),
    }
}

/// Checks that matrices of numbers are covariances: finite, symmetric up to rounding, positive semidefinite or definite.
///
/// # Errors
/// What is wrong, below their list: `[3][1][0]` for an entry of the fourth.
///
/// ```
/// use supple_model::Matrices;
/// use supple_model::noise::check_matrices;
///
/// let wrong = check_matrices(&Matrices::zeros(5, 2, 2), true).err().map(|unfit| unfit.to_string());
/// assert_eq!(wrong.as_deref(), Some("[0]: must be positive definite; its leading 1 x 1 block is not"));
/// ```
pub fn check_matrices(matrices: &Matrices, definite: bool) -> Result<(), Unfit> {
    let order = matrices.rows();
    let across = |entry: f64, mirrored: f64| format!("{}, and {} across the diagonal", digits(entry), digits(mirrored));
    let largest = matrices.as_slice().iter().fold(0.0_f64, |largest, entry| largest.max(entry.abs()));
    for t in 0..matrices.count() {
        let at = |i: usize, j: usize, message: String| Err(Unfit::here(message).entry(t).entry(i).entry(j));
        for (i, j) in (0..order).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let [entry, mirrored] = [matrices.get(t, i, j), matrices.get(t, j, i)];
            if !(entry - mirrored).is_finite() {
                return at(i, j, format!("must be finite; found {}", across(entry, mirrored)));
            }
            if (entry - mirrored).abs() > ROUNDING * largest {
                return at(i, j, format!("must be symmetric; found {}", across(entry, mirrored)));
            }
        }
        definiteness(matrices, t, definite).map_err(|message| Unfit::here(message).entry(t))?;
    }
    Ok(())
}

/// Checks that a symmetric matrix is positive semidefinite, or positive definite.
fn definiteness(matrices: &Matrices, index: usize, definite: bool) -> Result<(), String> {
    let (valid, minor) = match refuse_indefinite(matrices, index) {
        Err(minor) => ("semidefinite", minor),
        Ok(()) if !definite => return Ok(()),
        Ok(()) => match rows::cholesky(&mut matrices.at(index).to_vec(), matrices.rows(), matrices.stride()) {
            Err(row) => ("definite", row + 1),
            Ok(()) => return Ok(()),
        },
    };
    Err(format!("must be positive {valid}; its leading {minor} x {minor} block is not"))
}
