//! `x'Qx + u'Ru`: the cost of state and control with weight matrices.

use serde::Deserialize;
use supple_kernels::Matrices;
use supple_lqg::refuse_indefinite;
use supple_text::FileError;

use super::{Cost, Weights};
use crate::Value;
use crate::document::{Place, Spot, Unfit};
use crate::parameters::Parameters;
use crate::quantity::{Context, Measurable, StateAndControl};
use crate::value::symmetrise;

/// `x'Qx + u'Ru` in every stage and `x' final x` at the end, without factors 1/2. Matrices must be positive semidefinite
/// and symmetric; asymmetry from rounding is removed.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub struct File {
    /// Weight of the state, n x n.
    Q: Vec<Vec<Value>>,
    /// Weight of the control, m x m.
    R: Vec<Vec<Value>>,
    /// Weight of the last state, n x n; default: `Q`.
    #[serde(rename = "final")]
    last: Option<Vec<Vec<Value>>>,
}

impl File {
    /// The cost whose table is at a place of a file.
    ///
    /// # Errors
    /// If a matrix has the wrong size for the model, or is not symmetric.
    pub fn cost(mut self, Spot { document, at }: Spot, context: &Context) -> Result<Cost, FileError> {
        let (n, m) = (context.vocabulary.states.len(), context.vocabulary.controls());
        let make_symmetric = |key: &'static str, rows: &mut [Vec<Value>], order: usize| {
            let error = |entry: &[Place], message: String| {
                let at: Vec<Place> = at.iter().chain(&[key.into()]).chain(entry).copied().collect();
                Err(document.error(&at, message))
            };
            if rows.len() != order || rows.iter().any(|row| row.len() != order) {
                let widths: Vec<_> = rows.iter().map(Vec::len).collect();
                let found = format!("it has {} rows of {widths:?} entries", rows.len());
                return error(&[], format!("must be {order} x {order}; {found}"));
            }
            symmetrise(rows).or_else(|found| {
                error(&[found.row.into(), found.column.into()], found.message(&context.parameters.names()))
            })
        };
        make_symmetric("Q", &mut self.Q, n)?;
        make_symmetric("R", &mut self.R, m)?;
        if let Some(last) = &mut self.last {
            make_symmetric("final", last, n)?;
        }
        let zero = vec![vec![Value::Number(0.0); m]; m];
        let stage = Weights::Matrix(block_diagonal(&self.Q, &self.R));
        let last = Weights::Matrix(block_diagonal(self.last.as_ref().unwrap_or(&self.Q), &zero));
        Ok(Cost { stage, last, ..Cost::new(StateAndControl::new(n, m), 0.0) })
    }
}

/// Checks that no cost can be negative: the diagonal for all parameter values, the whole matrix at the initial ones.
fn check_semidefinite(rows: Vec<Vec<Value>>, parameters: &Parameters) -> Result<(), String> {
    for (i, row) in rows.iter().enumerate() {
        if let Some(least) = parameters.least(&row[i]).filter(|&least| least < 0.0) {
            return Err(format!("entry ({0}, {0}) must be at least 0; {1}", i + 1, row[i].found(least)));
        }
    }
    let mut matrix = Matrices::constant(rows.len(), rows.len());
    let phi = parameters.initial();
    let number = |i: usize, j: usize| rows[i][j].resolve::<f64>(&phi);
    for (i, j) in (0..rows.len()).flat_map(|i| (0..rows.len()).map(move |j| (i, j))) {
        // What a quadratic form counts of its matrix.
        matrix.set(0, i, j, 0.5 * (number(i, j) + number(j, i)));
    }
    let indefinite = |minor: usize| {
        let valid = "must be positive semidefinite, so that no cost is negative";
        Err(format!("{valid}; its leading {minor} x {minor} block is not"))
    };
    refuse_indefinite(&matrix, 0).or_else(indefinite)
}

fn block_diagonal(a: &[Vec<Value>], b: &[Vec<Value>]) -> Vec<Vec<Value>> {
    let zeros = |len| std::iter::repeat_n(Value::Number(0.0), len);
    let top = a.iter().map(|row| row.iter().cloned().chain(zeros(b.len())).collect());
    let bottom = b.iter().map(|row| zeros(a.len()).chain(row.iter().cloned()).collect());
    top.chain(bottom).collect()
}

/// Checks the weights of such a cost within the parameters' bounds; the error gives the key and what is valid.
pub fn check(cost: &Cost, parameters: &Parameters) -> Result<(), Unfit> {
    let (Some(all), Weights::Matrix(stage), Weights::Matrix(last)) =
        (cost.quantity.as_kind::<StateAndControl>(), &cost.stage, &cost.last)
    else {
        for (key, weights) in [("weight", &cost.stage), ("final_weight", &cost.last)] {
            if let Weights::Matrix(rows) = weights {
                check_semidefinite(rows.clone(), parameters).map_err(|message| Unfit::new(key, message))?;
            }
        }
        return Ok(());
    };
    let block = |rows: &[Vec<Value>], from: usize, to: usize| -> Vec<Vec<Value>> {
        rows[from..to].iter().map(|row| row[from..to].to_vec()).collect()
    };
    let (n, all) = (all.states(), all.len());
    for (key, rows) in [("Q", block(stage, 0, n)), ("R", block(stage, n, all)), ("final", block(last, 0, n))] {
        check_semidefinite(rows, parameters).map_err(|message| Unfit::new(key, message))?;
    }
    Ok(())
}
