//! Journals: a file in the folder of a study that records its identity and its completed parts. Every change is
//! atomic, whenever the program or the machine stops.

mod identity;
mod open;
mod parts;
mod shield;
mod trial;

use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use redb::{Database, Durability, ReadTransaction, ReadableDatabase, TableDefinition, WriteTransaction};

pub(crate) use self::identity::{Identity, fingerprint};
pub(crate) use self::open::count;
pub(crate) use self::parts::Parts;
pub use self::parts::{forget, kept_parts};
use self::shield::shielded;
use crate::StudyError;

/// The journal in the folder of a study.
///
/// Example: [`kept_parts`].
pub const JOURNAL: &str = "journal.redb";

/// The version of the layout of journals.
const FORMAT: &str = "1";

/// `format`, `supple`, `fingerprint`, `identity`.
pub(crate) const ABOUT: TableDefinition<&str, &str> = TableDefinition::new("about");

/// What a kind of study keeps in its journal.
pub(crate) trait Layout {
    /// What is done of the study.
    type Done;

    /// Makes its tables in a new journal.
    ///
    /// # Errors
    /// Where the journal cannot be written.
    fn create(&self, change: &WriteTransaction) -> Result<(), redb::Error>;

    /// Reads what is done; `None` if it does not fit to the study.
    ///
    /// # Errors
    /// Where the journal cannot be read.
    fn read(&self, journal: &ReadTransaction) -> Result<Option<Self::Done>, redb::Error>;
}

/// An open journal.
pub(crate) struct Journal {
    /// Closed when this is dropped; there until then.
    database: Option<Database>,
    path: PathBuf,
    /// Holds the lock that keeps other processes out.
    _lock: File,
}

impl Journal {
    /// Makes a change, all of it or nothing; on return it is on the disk.
    ///
    /// # Errors
    /// Where the disk is full or fails; what was kept before still is.
    pub fn keep(&self, make: impl FnOnce(&WriteTransaction) -> Result<(), redb::Error>) -> Result<(), StudyError> {
        self.with(|database| {
            let mut change = database.begin_write()?;
            change.set_durability(Durability::Immediate)?;
            make(&change)?;
            change.commit()?;
            Ok(())
        })
        .map_err(|error| match error {
            StudyError::Io { what, error } => {
                let message =
                    format!("{error}; completed work is stored: fix the problem and repeat the command to resume");
                StudyError::Io { what, error: std::io::Error::new(error.kind(), message) }
            }
            other => other,
        })
    }

    /// Reads of it.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub fn read<T>(&self, read: impl FnOnce(&ReadTransaction) -> Result<T, redb::Error>) -> Result<T, StudyError> {
        self.with(|database| read(&database.begin_read()?))
    }

    /// An error about something in it.
    pub fn damaged(&self, what: impl std::fmt::Display) -> StudyError {
        damaged(&self.path, what)
    }

    /// Works on the database; errors and panics of it are those of the journal.
    fn with<T>(&self, work: impl FnOnce(&Database) -> Result<T, redb::Error>) -> Result<T, StudyError> {
        let Some(database) = &self.database else { return Err(self.damaged("it is closed")) };
        match shielded(|| work(database)) {
            Ok(result) => result.map_err(|error| failed(&self.path, error)),
            Err(panic) => Err(self.damaged(panic)),
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
        // The file contradicts itself or is truncated.
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
pub(crate) const ADVICE: &str = "give another --out, or remove the file to start anew";

fn damaged(path: &Path, what: impl std::fmt::Display) -> StudyError {
    StudyError::kept(path, format!("is damaged or not a supple journal: {what}; {ADVICE}"))
}

fn in_use(path: &Path) -> StudyError {
    StudyError::kept(path, "is in use by another process; wait until it finishes, or give another --out")
}
