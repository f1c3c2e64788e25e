//! Where points go that are done: memory, or a journal.

use std::collections::BTreeMap;

use super::done::Done;
use super::grid::Grid;
use super::journal;
use crate::journal::Journal;
use crate::{Cell, StudyError};

/// Where points go that are done.
pub(super) enum Store {
    Memory(BTreeMap<usize, Vec<Cell>>),
    Journal(Journal),
}

impl Store {
    pub fn keep(&mut self, grid: &Grid, batch: Vec<Done>) -> Result<(), StudyError> {
        match self {
            Self::Memory(rows) => rows.extend(batch.into_iter().map(|done| (done.point, done.row))),
            Self::Journal(kept) => journal::keep(kept, grid, &batch)?,
        }
        Ok(())
    }

    /// All rows, in the order of the points.
    pub fn rows(self) -> Result<Vec<Vec<Cell>>, StudyError> {
        match self {
            Self::Memory(rows) => Ok(rows.into_values().collect()),
            Self::Journal(kept) => journal::rows(&kept),
        }
    }
}
