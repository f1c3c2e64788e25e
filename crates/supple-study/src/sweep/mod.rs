//! Sweeps: many designs on a grid, each evaluated; a journal keeps what is done.

use std::path::Path;

use serde::{Deserialize, Serialize};
use supple::parameters::Scale;

use crate::{Column, LoadedTask, StudyError, Table, Watch};

/// One axis of a grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// The parameter that changes along it.
    pub parameter: String,
    /// Its unit; empty where it has none.
    pub unit: String,
    /// How its values are spread, for plots.
    pub scale: Scale,
    /// The values, in the order of the rows.
    pub values: Vec<f64>,
}

/// What a sweep does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepOptions {
    /// The axes; the last one changes fastest.
    pub axes: Vec<Axis>,
    /// Closed-loop roll-outs at every point.
    pub rollouts: usize,
    /// Starts of a design search at every point over the design parameters that are on no axis; 0 for none.
    pub starts: usize,
    /// Seed of roll-outs and searches.
    pub seed: u64,
}

/// The result of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// What was asked for.
    pub options: SweepOptions,
    /// The columns of the table.
    pub columns: Vec<Column>,
    /// The table: its own files in the folder.
    #[serde(skip)]
    pub table: Table,
    /// Whether all points are there.
    pub complete: bool,
}

impl Axis {
    /// Reads `NAME=SPEC`, where SPEC is `FROM:TO:COUNT` (linear), `log:FROM:TO:COUNT` or `A,B,C`.
    ///
    /// # Errors
    /// Where it is not one of these, the parameter is unknown, or a value is outside its bounds.
    pub fn parse(_text: &str, _task: &LoadedTask) -> Result<Self, StudyError> {
        Err(StudyError::usage("not built yet"))
    }
}

impl Sweep {
    /// Writes `table.csv` and `table.jsonl`.
    pub(crate) fn save_table(&self, _folder: &Path) -> Result<(), StudyError> {
        Ok(())
    }

    /// Reads the table back.
    pub(crate) fn load_table(&mut self, _folder: &Path) -> Result<(), StudyError> {
        Ok(())
    }
}

/// Evaluates every point of a grid, in parallel; with a folder, a journal in it keeps what is done, and the same sweep
/// goes on from there.
///
/// # Errors
/// Where a grid is empty, or the journal cannot be written, is damaged, or belongs to something else.
pub fn run(
    _task: &LoadedTask,
    _options: &SweepOptions,
    _folder: Option<&Path>,
    _watch: Watch,
) -> Result<Sweep, StudyError> {
    Err(StudyError::usage("not built yet"))
}
