//! What noise must satisfy.

use supple_kernels::{Matrices, rows};
use supple_lqg::{Dimensions, refuse_indefinite};
use supple_text::digits;

use super::{Covariance, NoiseModel, VaryingVariance};
use crate::Value;
use crate::document::Unfit;
use crate::parameters::Parameters;
use crate::value::symmetrise;

/// Asymmetry of a matrix of numbers up to this, relative to its largest entry, is rounding.
const ROUNDING: f64 = 1e-12;

/// What is wrong with a value of a parameter that there is not.
const UNKNOWN: &str = "uses a parameter that the problem does not have";

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
        let Self { initial, process, measurement, varying } = self;
        let (n, p) = (size.states, size.measurements);
        let rules = [
            Rule { key: "initial", order: n, count: 1, definite: false },
            Rule { key: "process", order: n, count: steps, definite: false },
            Rule { key: "measurement", order: p, count: steps + 1, definite: true },
        ];
        for (rule, covariance) in rules.into_iter().zip([initial, process, measurement]) {
            rule.check(covariance, parameters)?;
        }
        for (number, &VaryingVariance { measurement, state, .. }) in varying.iter().enumerate() {
            let places = [("measurement", measurement, p), ("state", state, n)];
            if let Some((key, place, count)) = places.into_iter().find(|(_, place, count)| place >= count) {
                let message = format!("must be below {count}, the number of {key}s; found {place}");
                return Err(Unfit::new(key, message).below(number).below("varying"));
            }
        }
        Ok(())
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

    fn check(self, covariance: &Covariance, parameters: &Parameters) -> Result<(), Unfit> {
        let Self { order, .. } = self;
        match covariance {
            Covariance::Diagonal(variances) => {
                if variances.len() != order {
                    return Err(self.unfit(format!("must have {order} variances; found {}", variances.len())));
                }
                for (i, &variance) in variances.iter().enumerate() {
                    self.variance(variance, parameters).map_err(|message| self.unfit(message).entry(i))?;
                }
            }
            Covariance::Full(rows) => {
                if rows.len() != order || rows.iter().any(|row| row.len() != order) {
                    let widths: Vec<_> = rows.iter().map(Vec::len).collect();
                    let message = format!("must be {order} x {order}; found rows of {widths:?} numbers");
                    return Err(self.unfit(message));
                }
                for (i, j) in (0..order).flat_map(|i| (0..order).map(move |j| (i, j))) {
                    if parameters.least(rows[i][j]).is_none() {
                        return Err(self.unfit(UNKNOWN).entry(i).entry(j));
                    }
                }
                for (i, row) in rows.iter().enumerate() {
                    self.variance(row[i], parameters).map_err(|message| self.unfit(message).entry(i).entry(i))?;
                }
                symmetrise(&mut rows.clone()).map_err(|found| {
                    self.unfit(found.message(&parameters.names())).entry(found.row).entry(found.column)
                })?;
            }
            Covariance::Sequence(matrices) => return self.sequence(matrices),
        }
        let mut matrix = Matrices::constant(order, order);
        covariance.resolve(&parameters.initial(), &mut matrix);
        definiteness(&matrix, 0, self.definite).map_err(|message| self.unfit(message))
    }

    /// Checks a variance, given the parameters' bounds.
    fn variance(self, variance: Value, parameters: &Parameters) -> Result<(), String> {
        let Some(least) = parameters.least(variance) else { return Err(UNKNOWN.to_owned()) };
        let here: f64 = variance.resolve(&parameters.initial());
        if !here.is_finite() {
            return Err(format!("must be finite; found {here}"));
        }
        let valid = match self.definite {
            true if least <= 0.0 => "must be above 0, as every sensor has some noise",
            _ if least < 0.0 => "must be at least 0, as a variance",
            _ => return Ok(()),
        };
        Err(format!("{valid}; {}", variance.found(least)))
    }

    fn sequence(self, matrices: &Matrices) -> Result<(), Unfit> {
        let Self { order, count, .. } = self;
        let found = (matrices.count(), matrices.rows(), matrices.cols());
        if found != (count, order, order) {
            let (matrices, rows, cols) = found;
            let message = format!("must be {count} matrices of {order} x {order}; found {matrices} of {rows} x {cols}");
            return Err(self.unfit(message));
        }
        check_matrices(matrices, self.definite).map_err(|unfit| unfit.below(self.key))
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
    for t in 0..matrices.count() {
        let at = |i: usize, j: usize, message: String| Err(Unfit::here(message).entry(t).entry(i).entry(j));
        let largest = matrices.at(t).iter().fold(0.0_f64, |largest, entry| largest.max(entry.abs()));
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
