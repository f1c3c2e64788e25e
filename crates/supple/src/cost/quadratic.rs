use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Cost, CostError, CostFile, CostKind, Norm, Residual, Vocabulary, Weights};
use crate::{Point, Value};

/// State and control stacked: the residual of `x'Qx + u'Ru`.
#[derive(Clone, Debug)]
pub struct Quadratic {
    joint: usize,
}

/// `x'Qx + u'Ru` in every stage and `x' final x` at the end, without factors 1/2. Matrices must be symmetric.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
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
            kind: CostKind::Quadratic(Self { joint: n + m }),
            norm: Norm::Quadratic,
            stage: Weights::Matrix(block_diagonal(&file.Q, &file.R)),
            last: Weights::Matrix(block_diagonal(file.last.as_ref().unwrap_or(&file.Q), &zero)),
        })
    }
}

fn check_symmetric(key: &'static str, rows: &[Vec<Value>], order: usize) -> Result<(), CostError> {
    let error = |message| Err(CostError { key, message });
    if rows.len() != order || rows.iter().any(|row| row.len() != order) {
        let widths: Vec<_> = rows.iter().map(Vec::len).collect();
        return error(format!("must be {order} x {order}; it has {} rows of {widths:?} entries", rows.len()));
    }
    for i in 0..order {
        for j in 0..i {
            if rows[i][j] != rows[j][i] {
                return error(format!("must be symmetric: entries ({}, {}) and ({1}, {0}) differ", i + 1, j + 1));
            }
        }
    }
    Ok(())
}

fn block_diagonal(a: &[Vec<Value>], b: &[Vec<Value>]) -> Vec<Vec<Value>> {
    let zeros = |len| std::iter::repeat_n(Value::Number(0.0), len);
    let top = a.iter().map(|row| row.iter().copied().chain(zeros(b.len())).collect());
    let bottom = b.iter().map(|row| zeros(a.len()).chain(row.iter().copied()).collect());
    top.chain(bottom).collect()
}

impl Residual for Quadratic {
    fn len(&self) -> usize {
        self.joint
    }

    #[inline(always)]
    fn evaluate<S: Scalar>(&self, at: &Point<S>, _: &[S], out: &mut [S]) {
        let (x, u) = out.split_at_mut(at.x.len());
        x.copy_from_slice(at.x);
        u.copy_from_slice(at.u);
    }
}
