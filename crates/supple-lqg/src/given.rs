//! Checks of the arrays that callers give.

use supple_kernels::Matrices;

use crate::Error;
use crate::dense::{Dense, are_finite, dense};
use crate::semidefinite::{refuse_indefinite, semidefinite_root};

/// The most by which two entries that must be equal may differ, as a share of the square root of their diagonal entries'
/// product.
const ASYMMETRY: f64 = 1e-9;

/// A sequence of matrices that a caller gives, and what it must be.
pub(crate) struct Given<'a> {
    /// Its name, with an article.
    pub what: &'static str,
    pub array: &'a Matrices,
    /// Rows and columns of each matrix.
    pub shape: (usize, usize),
    /// How many matrices there must be at least, except if one holds at every step.
    pub count: usize,
}

impl Given<'_> {
    /// # Errors
    /// Which of its lengths is wrong.
    pub fn check_shape(&self) -> Result<(), Error> {
        let Self { what, array, shape, count } = self;
        let lengths = [("column", array.rows(), shape.0), ("row", array.cols(), shape.1)];
        for (of, found, expected) in lengths {
            if found != expected {
                return Err(Error::Shape { what: format!("a {of} of {what}"), found, expected });
            }
        }
        if !array.is_constant() && array.count() < *count {
            return Err(Error::Shape {
                what: format!("the sequence of {what}"),
                found: array.count(),
                expected: *count,
            });
        }
        Ok(())
    }

    /// # Errors
    /// Which of its lengths is wrong, or at which step an entry is not finite.
    pub fn check_finite(&self) -> Result<(), Error> {
        self.check_shape()?;
        let bad = (0..self.array.count()).find(|&t| !are_finite(self.array.at(t)));
        bad.map_or(Ok(()), |step| Err(Error::NotFinite { what: self.what, step }))
    }

    /// # Errors
    /// As [`Given::check_finite`], or where it is not symmetric and positive semidefinite.
    pub fn check_covariance(&self) -> Result<(), Error> {
        self.check_finite()?;
        for step in 0..self.array.count() {
            if !self.is_diagonal_or_definite(step) {
                root_of(self.what, self.array, step)?;
            }
        }
        Ok(())
    }

    /// For covariances that are factorised: whatever else makes them indefinite is found there.
    ///
    /// # Errors
    /// As [`Given::check_finite`], or where it is not symmetric or a variance is not positive.
    pub fn check_variances(&self) -> Result<(), Error> {
        self.check_finite()?;
        for step in 0..self.array.count() {
            self.check_symmetric(step)?;
            if (0..self.array.rows()).any(|i| self.array.get(step, i, i) <= 0.0) {
                return Err(Error::NotPositiveDefinite { what: self.what, step });
            }
        }
        Ok(())
    }

    /// Whether the matrix of a step is symmetric.
    fn check_symmetric(&self, step: usize) -> Result<(), Error> {
        if self.is_diagonal(step) {
            return Ok(());
        }
        let Some((i, j)) = self.asymmetric(step) else { return Ok(()) };
        let [here, there] = [self.array.get(step, i, j), self.array.get(step, j, i)];
        let found = format!("entry [{i}][{j}] is {here:?}, and [{j}][{i}] is {there:?}");
        Err(Error::NotPositiveSemidefinite { what: self.what, step, found })
    }

    /// Whether the matrix of a step is 0 off its diagonal.
    fn is_diagonal(&self, step: usize) -> bool {
        // Without an early end, so that it is done on vectors.
        let are_zero = |part: &[f64]| part.iter().fold(true, |zero, &entry| zero & (entry == 0.0));
        self.array.rows_of(step).enumerate().all(|(i, row)| are_zero(&row[..i]) && are_zero(&row[i + 1..]))
    }

    /// The first entry of the matrix of a step that differs from the one across the diagonal.
    fn asymmetric(&self, step: usize) -> Option<(usize, usize)> {
        let entry = |i, j| self.array.get(step, i, j);
        let differs = |&(i, j): &(usize, usize)| {
            let (here, there) = (entry(i, j), entry(j, i));
            here != there && (here - there).abs() > ASYMMETRY * (entry(i, i) * entry(j, j)).abs().sqrt()
        };
        self.below_diagonal().find(differs)
    }

    fn below_diagonal(&self) -> impl Iterator<Item = (usize, usize)> {
        (0..self.array.rows()).flat_map(|i| (0..i).map(move |j| (i, j)))
    }

    /// Whether the matrix of a step is easily seen to be symmetric and positive semidefinite.
    fn is_diagonal_or_definite(&self, step: usize) -> bool {
        if self.is_diagonal(step) {
            return (0..self.array.rows()).all(|i| self.array.get(step, i, i) >= 0.0);
        }
        self.asymmetric(step).is_none() && refuse_indefinite(self.array, step).is_ok()
    }
}

/// [`semidefinite_root`] of the matrix of a step.
///
/// # Errors
/// If it is not symmetric and positive semidefinite.
pub(crate) fn root_of(what: &'static str, array: &Matrices, step: usize) -> Result<Dense, Error> {
    semidefinite_root(&dense(array, step)).map_err(|found| Error::NotPositiveSemidefinite { what, step, found })
}

/// Whether there are as many of something as there must be.
pub(crate) fn check_count(what: &str, found: usize, expected: usize) -> Result<(), Error> {
    if found == expected { Ok(()) } else { Err(Error::Shape { what: what.into(), found, expected }) }
}

/// Whether there is at least one of something.
pub(crate) fn check_some(what: &str, count: usize) -> Result<(), Error> {
    if count > 0 { Ok(()) } else { Err(Error::Shape { what: what.into(), found: 0, expected: 1 }) }
}

/// The names of arrays.
pub(crate) const COST: &str = "the cost [l_zz l_z]";
pub(crate) const DYNAMICS: &str = "the dynamics [A B]";
pub(crate) const OUTPUT: &str = "the measurement matrix C";
pub(crate) const INITIAL: &str = "the covariance of the first state";
pub(crate) const PROCESS: &str = "the process covariance";
pub(crate) const MEASUREMENT: &str = "the measurement covariance";
