use std::path::Path;

use serde::{Deserialize, Serialize};
use supple::plan::PlanStatus;

use super::columns::misses_contact;
use super::options::SweepOptions;
use crate::{Cell, Column, StudyError, Table, write_text};

/// The table for spreadsheets and scripts.
pub const TABLE_CSV: &str = "table.csv";

/// The table as lines of JSON, from which it is read again.
pub const TABLE_JSONL: &str = "table.jsonl";

/// The result of a sweep.
///
/// Example: the [module](crate::sweep).
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

impl Sweep {
    /// How many points could not be evaluated, or have a plan that did not converge or never touches a contact from which a
    /// cost wants a force.
    #[must_use]
    pub fn untrusted(&self) -> usize {
        let Table { columns, rows, .. } = &self.table;
        let missed: Vec<usize> = (0..columns.len()).filter(|&i| misses_contact(&columns[i]).is_some()).collect();
        let statuses: Vec<usize> = (0..columns.len()).filter(|&i| columns[i].name.ends_with(".status")).collect();
        let error = self.table.column("error");
        let converged = Cell::Text(PlanStatus::Converged.to_string());
        let is_untrusted = |row: &&Vec<Cell>| {
            error.is_some_and(|error| row[error] != Cell::Missing)
                || missed.iter().any(|&column| row[column] == Cell::Number(1.0))
                || statuses.iter().any(|&column| row[column] != converged)
        };
        rows.iter().filter(is_untrusted).count()
    }

    /// Writes `table.csv` and `table.jsonl`; with the feature `parquet`, `table.parquet` too.
    pub(crate) fn save_table(&self, folder: &Path) -> Result<(), StudyError> {
        #[cfg(feature = "parquet")]
        super::parquet::save(&self.table, folder)?;
        write_text(&folder.join(TABLE_CSV), self.table.to_csv().as_bytes())?;
        write_text(&folder.join(TABLE_JSONL), self.table.to_jsonl().as_bytes())
    }

    /// Reads the table back.
    pub(crate) fn load_table(&mut self, folder: &Path) -> Result<(), StudyError> {
        let path = folder.join(TABLE_JSONL);
        self.table = Table::read_jsonl(&self.columns, &path)?;
        let (found, expected) = (self.table.rows.len(), self.options.points());
        if self.complete && found != expected {
            let message = format!("has {found} rows, not {expected}: it is damaged; recompute the result");
            return Err(StudyError::kept(&path, message));
        }
        Ok(())
    }
}
