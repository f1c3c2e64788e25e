use serde::Deserialize;
use supple_kernels::{Matrices, Scalar};

use super::{Cost, CostError, CostFile, CostKind, Norm, Residual, Vocabulary, Weights};
use crate::noise::{Covariance, semidefinite_factor};
use crate::parameters::Parameters;
use crate::{Point, Value};

/// State and control stacked: the residual of `x'Qx + u'Ru`.
#[derive(Clone, Debug)]
pub struct Quadratic {
    file: File,
}

/// `x'Qx + u'Ru` in every stage and `x' final x` at the end, without factors 1/2. Matrices must be symmetric and
/// positive semidefinite.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub(crate) struct File {
    /// Weight of the state, n x n.
    Q: Vec<Vec<Value>>,
    /// Weight of the control, m x m.
    R: Vec<Vec<Value>>,
    /// Weight of the last state, n x n; as `Q` where left out.
    #[serde(rename = "final")]
    last: Option<Vec<Vec<Value>>>,
}

impl CostFile for Quadratic {
    type File = File;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Cost, CostError> {
        let (n, m) = (vocabulary.states.len(), vocabulary.controls);
        check_symmetric("Q", &file.Q, n)?;
        check_symmetric("R", &file.R, m)?;
        if let Some(last) = &file.last {
            check_symmetric("final", last, n)?;
        }
        let zero = vec![vec![Value::Number(0.0); m]; m];
        Ok(Cost {
            norm: Norm::Quadratic,
            stage: Weights::Matrix(block_diagonal(&file.Q, &file.R)),
            last: Weights::Matrix(block_diagonal(file.last.as_ref().unwrap_or(&file.Q), &zero)),
            kind: CostKind::Quadratic(Self { file }),
        })
    }
}

fn check_symmetric(key: &'static str, rows: &[Vec<Value>], order: usize) -> Result<(), CostError> {
    let error = |message: String| Err(CostError::new(key, message));
    if rows.len() != order || rows.iter().any(|row| row.len() != order) {
        let widths: Vec<_> = rows.iter().map(Vec::len).collect();
        return error(format!("must be {order} x {order}; it has {} rows of {widths:?} entries", rows.len()));
    }
    for (i, row) in rows.iter().enumerate() {
        if let Some(j) = (0..i).find(|&j| row[j] != rows[j][i]) {
            return error(format!("must be symmetric: entries ({}, {}) and ({1}, {0}) differ", i + 1, j + 1));
        }
    }
    Ok(())
}

/// No cost is negative: diagonal entries at any parameters, the whole matrix at their initial values.
fn check_semidefinite(rows: &[Vec<Value>], parameters: &Parameters) -> Result<(), String> {
    for (i, row) in rows.iter().enumerate() {
        if let Some(least) = parameters.least(row[i]).filter(|&least| least < 0.0) {
            return Err(format!("entry ({0}, {0}) must be at least 0; {1}", i + 1, row[i].found(least)));
        }
    }
    let mut matrix = Matrices::constant(rows.len(), rows.len());
    Covariance::Full(rows.to_vec()).resolve(&parameters.initial(), &mut matrix);
    match semidefinite_factor(&matrix, 0) {
        Some(_) => Ok(()),
        None => Err("must be positive semidefinite, so that no cost is negative".into()),
    }
}

fn block_diagonal(a: &[Vec<Value>], b: &[Vec<Value>]) -> Vec<Vec<Value>> {
    let zeros = |len| std::iter::repeat_n(Value::Number(0.0), len);
    let top = a.iter().map(|row| row.iter().copied().chain(zeros(b.len())).collect());
    let bottom = b.iter().map(|row| zeros(a.len()).chain(row.iter().copied()).collect());
    top.chain(bottom).collect()
}

impl Residual for Quadratic {
    fn len(&self) -> usize {
        self.file.Q.len() + self.file.R.len()
    }

    fn check(&self, parameters: &Parameters) -> Result<(), (&'static str, String)> {
        let File { Q, R, last } = &self.file;
        for (key, rows) in [("Q", Q), ("R", R), ("final", last.as_ref().unwrap_or(Q))] {
            check_semidefinite(rows, parameters).map_err(|message| (key, message))?;
        }
        Ok(())
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, _: &[S], out: &mut [S]) {
        let (x, u) = out.split_at_mut(at.x.len());
        x.copy_from_slice(at.x);
        u.copy_from_slice(at.u);
    }
}
