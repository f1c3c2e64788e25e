//! The journal of a sweep: a file that holds what the sweep is, the rows that are done, and what its segments need to
//! go on. Every change of it is whole or not there at all, whenever the program or the machine ends.

pub(super) mod codec;
mod identity;
mod open;
mod shield;
mod trial;

use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use redb::{Database, Durability, ReadableDatabase, ReadableTable, TableDefinition};

pub(super) use self::identity::Identity;
pub use self::open::kept_points;
use self::shield::shielded;
use super::grid::Grid;
use super::work::Done;
use crate::{Cell, StudyError};

/// The journal in the folder of a sweep.
pub const JOURNAL: &str = "journal.redb";

/// The version of the layout of journals.
const FORMAT: &str = "1";

/// `format`, `supple`, `fingerprint`, `identity`.
const ABOUT: TableDefinition<&str, &str> = TableDefinition::new("about");

/// Rows by the number of their point, as JSON.
const ROWS: TableDefinition<u64, &str> = TableDefinition::new("rows");

/// By the number of an unfinished segment: its last point that is done, and the plans to continue from.
const PLANS: TableDefinition<u64, &[u8]> = TableDefinition::new("plans");

/// An open journal.
pub(super) struct Journal {
    /// Closed when this is dropped; there until then.
    database: Option<Database>,
    path: PathBuf,
    /// Holds the lock that keeps other processes out.
    _lock: File,
}

impl Journal {
    /// Keeps points that are done, all of them or none; on return they are on the disk.
    ///
    /// # Errors
    /// Where the disk is full or fails; what was kept before still is.
    pub fn keep(&self, grid: &Grid, batch: &[Done]) -> Result<(), StudyError> {
        self.with(|database| {
            let mut change = database.begin_write()?;
            change.set_durability(Durability::Immediate)?;
            {
                let mut rows = change.open_table(ROWS)?;
                let mut plans = change.open_table(PLANS)?;
                for Done { segment, point, row, neighbour } in batch {
                    rows.insert(*point as u64, &*codec::row_text(row))?;
                    if point + 1 == grid.segment(*segment).end {
                        plans.remove(*segment as u64)?;
                    } else {
                        plans.insert(*segment as u64, &*codec::plan_bytes(*point, neighbour))?;
                    }
                }
            }
            change.commit()?;
            Ok(())
        })
        .map_err(|error| match error {
            StudyError::Io { what, error } => {
                let message =
                    format!("{error}; what was done before is kept: once this is mended, the same command goes on");
                StudyError::Io { what, error: std::io::Error::new(error.kind(), message) }
            }
            other => other,
        })
    }

    /// All rows, in the order of the points.
    pub fn rows(&self) -> Result<Vec<Vec<Cell>>, StudyError> {
        let texts = self.with(|database| {
            let rows = database.begin_read()?.open_table(ROWS)?;
            rows.iter()?.map(|entry| Ok(entry?.1.value().to_owned())).collect::<Result<Vec<String>, redb::Error>>()
        })?;
        let rows = texts.iter().map(|text| codec::row(text));
        rows.collect::<Option<_>>().ok_or_else(|| damaged(&self.path, "a row in it cannot be read"))
    }

    /// Works on the database; errors and panics of it are those of the journal.
    fn with<T>(&self, work: impl FnOnce(&Database) -> Result<T, redb::Error>) -> Result<T, StudyError> {
        let Some(database) = &self.database else { return Err(damaged(&self.path, "it is closed")) };
        match shielded(|| work(database)) {
            Ok(result) => result.map_err(|error| failed(&self.path, error)),
            Err(panic) => Err(damaged(&self.path, panic)),
        }
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        let database = self.database.take();
        // Where it cannot be closed cleanly, the next one to open it recovers.
        let _ = shielded(|| drop(database));
    }
}

/// A failure of the database as one of the journal.
fn failed(path: &Path, error: redb::Error) -> StudyError {
    match error {
        // What the file says of itself is wrong, or it ends too early.
        redb::Error::Io(error) if matches!(error.kind(), ErrorKind::InvalidData | ErrorKind::UnexpectedEof) => {
            damaged(path, error)
        }
        redb::Error::Io(error) => StudyError::io(path, error),
        redb::Error::PreviousIo => StudyError::io(path, std::io::Error::other("it could not be written before")),
        redb::Error::DatabaseAlreadyOpen => in_use(path),
        redb::Error::UpgradeRequired(version) => StudyError::kept(
            path,
            format!("is a database of format {version}, which this version of supple does not read; {ADVICE}"),
        ),
        redb::Error::Corrupted(what) => damaged(path, what),
        redb::Error::TableDoesNotExist(table) => damaged(path, format!("it has no table `{table}`")),
        other => damaged(path, other),
    }
}

/// What to do with a journal of no use.
const ADVICE: &str = "give another --out, or remove the file to start anew";

fn damaged(path: &Path, what: impl std::fmt::Display) -> StudyError {
    StudyError::kept(path, format!("is damaged, or no journal of a sweep: {what}; {ADVICE}"))
}

fn in_use(path: &Path) -> StudyError {
    StudyError::kept(path, "is in use by another process; wait until that ends, or give another --out")
}

#[cfg(test)]
mod tests;
