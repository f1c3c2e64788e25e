use serde::Deserialize;
use supple_kernels::Scalar;

use supple_lqg::Dimensions;

use super::file::PlainFile;
use crate::Value;
use crate::document::Unfit;
use crate::parameters::Parameters;
use crate::{Model, Point};

/// A linear time-invariant model: `x+ = A x + B u`, `y = C x`, already in discrete time.
///
/// Example: the [module](crate::model).
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(
    feature = "schema",
    schemars(description = "A linear time-invariant model: `x+ = A x + B u`, `y = C x`, already in discrete time.")
)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub struct Linear {
    /// Dynamics, n x n.
    pub A: Vec<Vec<Value>>,
    /// Input, n x m.
    pub B: Vec<Vec<Value>>,
    /// Measurement, p x n.
    pub C: Vec<Vec<Value>>,
}

/// Row `row` of a matrix times a vector, plus `sum`.
fn row_times<S: Scalar>(at: &Point<S>, row: &[Value], vector: &[S], mut sum: S) -> S {
    for (entry, &v) in row.iter().zip(vector) {
        if !entry.is_zero() {
            sum = at.value(entry).mul_add(v, sum);
        }
    }
    sum
}

impl Model for Linear {
    fn dimensions(&self) -> Dimensions {
        Dimensions { states: self.A.len(), controls: self.B.first().map_or(0, Vec::len), measurements: self.C.len() }
    }

    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        for ((next, a), b) in next.iter_mut().zip(&self.A).zip(&self.B) {
            *next = row_times(at, b, at.u, row_times(at, a, at.x, S::zero()));
        }
    }

    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        for (y, c) in y.iter_mut().zip(&self.C) {
            *y = row_times(at, c, at.x, S::zero());
        }
    }
}

impl PlainFile for Linear {
    const NAME: &'static str = "linear";

    fn check(&self, _: &Parameters) -> Result<(), Unfit> {
        let n = self.A.len();
        let wrong = |rows: &[Vec<Value>], cols: usize| rows.iter().position(|row| row.len() != cols);
        if n == 0 {
            return Err(Unfit::new("A", "needs at least one row"));
        }
        if let Some(row) = wrong(&self.A, n) {
            let found = self.A[row].len();
            return Err(Unfit::new(
                "A",
                format!("must be square: it has {n} rows, but its row {} has {found} entries", row + 1),
            ));
        }
        if self.B.len() != n {
            return Err(Unfit::new("B", format!("must have one row per state: {n}, not {}", self.B.len())));
        }
        let m = self.B[0].len();
        if m == 0 {
            return Err(Unfit::new("B", "needs at least one column"));
        }
        if let Some(row) = wrong(&self.B, m) {
            return Err(Unfit::new(
                "B",
                format!("its rows differ in length: {m} and {} (row {})", self.B[row].len(), row + 1),
            ));
        }
        if self.C.is_empty() {
            return Err(Unfit::new("C", "needs at least one row"));
        }
        if let Some(row) = wrong(&self.C, n) {
            let found = self.C[row].len();
            return Err(Unfit::new(
                "C",
                format!("must have one column per state: {n}, but its row {} has {found}", row + 1),
            ));
        }
        Ok(())
    }
}
