use std::fs::{File, TryLockError};
use std::io::ErrorKind;
use std::path::Path;
use std::time::Duration;

use redb::backends::FileBackend;
use redb::{Builder, Database, ReadableDatabase, ReadableTableMetadata, TableDefinition};

use super::shield::shielded;
use super::trial::{Ended, Trial};
use super::{ABOUT, ADVICE, FORMAT, Identity, JOURNAL, Journal, Layout, damaged, failed, fingerprint, in_use};
use crate::StudyError;
use crate::write::not_written;

/// A journal until it holds what it must; then it gets its name.
const NEW: &str = "journal.new";

/// Memory that the database may use.
const CACHE: usize = 64 << 20;

/// The version of this program.
const SUPPLE: &str = env!("CARGO_PKG_VERSION");

/// # Errors
/// If the path is a link: a journal is written in place, so the link's target would be overwritten.
fn is_no_link(path: &Path) -> Result<(), StudyError> {
    match std::fs::symlink_metadata(path) {
        Ok(about) if !about.is_file() => {
            Err(StudyError::kept(path, "is not a regular file (for example a symbolic link); remove it"))
        }
        _ => Ok(()),
    }
}

impl Journal {
    /// Opens the journal in a folder, or makes one where there is none: the journal, and what is done; `None` if it is
    /// new. Nothing is changed in a journal that cannot be used.
    ///
    /// # Errors
    /// Where it cannot be read or written, is in use, is damaged, or belongs to another study or version.
    pub fn open<L: Layout>(
        folder: &Path,
        layout: &L,
        identity: &Identity,
    ) -> Result<(Self, Option<L::Done>), StudyError> {
        let path = folder.join(JOURNAL);
        is_no_link(&path)?;
        std::fs::create_dir_all(folder).map_err(|error| not_written(&path, error))?;
        match File::options().read(true).write(true).open(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => match Self::create(folder, layout, identity)? {
                Some(journal) => Ok((journal, None)),
                // Another process made it in the meantime.
                None => Self::open(folder, layout, identity),
            },
            Err(error) => Err(StudyError::io(&path, error)),
            Ok(file) => Self::resume(&path, file, layout, identity).map(|(journal, done)| (journal, Some(done))),
        }
    }

    /// Makes a journal; `None` if there is one when it would get its name.
    fn create<L: Layout>(folder: &Path, layout: &L, identity: &Identity) -> Result<Option<Self>, StudyError> {
        let (path, new) = (folder.join(JOURNAL), folder.join(NEW));
        is_no_link(&new)?;
        let io = |error| StudyError::io(&new, error);
        let file = File::options().read(true).write(true).create(true).truncate(false).open(&new).map_err(io)?;
        lock(&file, &new)?;
        // Whoever held the lock before may have made the journal.
        if path.exists() {
            return Ok(None);
        }
        file.set_len(0).map_err(io)?;
        let of = |database: &Database| -> Result<(), redb::Error> {
            let change = database.begin_write()?;
            let about = [
                ("format", FORMAT),
                ("supple", SUPPLE),
                ("fingerprint", &identity.fingerprint),
                ("identity", &identity.text),
            ];
            {
                let mut table = change.open_table(ABOUT)?;
                for (key, value) in about {
                    table.insert(key, value)?;
                }
            }
            layout.create(&change)?;
            Ok(change.commit()?)
        };
        let mut journal = Self::on(&new, file)?;
        journal.with(of)?;
        std::fs::rename(&new, &path).map_err(io)?;
        // So that the name survives a power loss; not all systems support this.
        let _ = File::open(folder).and_then(|folder| folder.sync_all());
        journal.path = path;
        Ok(Some(journal))
    }

    fn resume<L: Layout>(
        path: &Path,
        file: File,
        layout: &L,
        identity: &Identity,
    ) -> Result<(Self, L::Done), StudyError> {
        let io = |error| StudyError::io(path, error);
        lock(&file, path)?;
        if file.metadata().map_err(io)?.len() == 0 {
            return Err(damaged(path, "it is empty"));
        }
        let trial = Trial::new(file.try_clone().map_err(io)?).map_err(io)?;
        let tried = shielded(|| try_out(path, trial, layout, identity));
        let done = tried.unwrap_or_else(|panic| Err(damaged(path, panic)))?;
        Ok((Self::on(path, file)?, done))
    }

    /// A journal on a locked file.
    fn on(path: &Path, file: File) -> Result<Self, StudyError> {
        let lock = file.try_clone().map_err(|error| StudyError::io(path, error))?;
        let opened = shielded(|| {
            let backend = FileBackend::new(file)?;
            builder().create_with_backend(backend)
        });
        match opened {
            Ok(Ok(database)) => Ok(Self { database: Some(database), path: path.to_owned(), _lock: lock }),
            Ok(Err(error)) => Err(failed(path, error.into())),
            Err(panic) => Err(damaged(path, panic)),
        }
    }
}

fn builder() -> Builder {
    let mut builder = Builder::new();
    builder.set_cache_size(CACHE);
    builder
}

/// How often a lock is tried, and how long lies between: a process that was killed may take a moment to end.
const TRIES: usize = 20;
const PAUSE: Duration = Duration::from_millis(25);

fn lock(file: &File, path: &Path) -> Result<(), StudyError> {
    for _ in 0..TRIES {
        match file.try_lock() {
            Ok(()) => return Ok(()),
            Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
            Err(TryLockError::Error(error)) => return Err(StudyError::io(path, error)),
        }
    }
    Err(in_use(path))
}

/// Ends a trial when it is dropped.
struct EndOnDrop(Ended);

impl Drop for EndOnDrop {
    fn drop(&mut self) {
        self.0.set();
    }
}

/// Works on a database in a trial, and drops it in a failed state instead of closing it: closing reclaims pages, which
/// may panic on a damaged journal, and again during unwinding, which would abort the program.
fn on_trial<T, E>(
    trial: Trial,
    failed: impl FnOnce(redb::Error) -> E,
    work: impl FnOnce(&mut Database) -> Result<T, E>,
) -> Result<T, E> {
    let ended = trial.ended();
    let mut database = builder().create_with_backend(trial).map_err(|error| failed(error.into()))?;
    // Dropped before the database, also where the work panics.
    let end = EndOnDrop(ended);
    let result = work(&mut database);
    drop(end);
    // The trial has ended, so this fails; from then on, the database writes nothing, not even when dropped.
    let _ = database.check_integrity();
    result
}

/// Reads all of a journal that may be damaged: what is done.
fn try_out<L: Layout>(path: &Path, trial: Trial, layout: &L, identity: &Identity) -> Result<L::Done, StudyError> {
    let failed = |error| failed(path, error);
    on_trial(trial, failed, |database| {
        if !database.check_integrity().map_err(|error| failed(error.into()))? {
            return Err(damaged(path, "its checksums are wrong"));
        }
        about(path, database, identity)?;
        let read = || layout.read(&database.begin_read()?);
        let done = read().map_err(failed)?;
        done.ok_or_else(|| damaged(path, "its contents do not match the study"))
    })
}

/// Checks that a journal belongs to a study.
fn about(path: &Path, database: &Database, identity: &Identity) -> Result<(), StudyError> {
    let read = || -> Result<_, redb::Error> {
        let table = database.begin_read()?.open_table(ABOUT)?;
        let mut found = Vec::new();
        for key in ["format", "supple", "fingerprint", "identity"] {
            found.push(table.get(key)?.map(|value| value.value().to_owned()).unwrap_or_default());
        }
        Ok(found)
    };
    let found = read().map_err(|error| failed(path, error))?;
    let [format, supple, fingerprint, text] = &found[..] else { return Err(damaged(path, "it is incomplete")) };
    if format != FORMAT {
        let message = format!("has format {format}; this version of supple keeps format {FORMAT}; {ADVICE}");
        return Err(StudyError::kept(path, message));
    }
    if supple != SUPPLE {
        let message =
            format!("was written by supple {supple}, but this is {SUPPLE}, whose numbers may differ; {ADVICE}");
        return Err(StudyError::kept(path, message));
    }
    if self::fingerprint(text.as_bytes()) != *fingerprint {
        return Err(damaged(path, "its description of the study does not match its fingerprint"));
    }
    if *fingerprint != identity.fingerprint || *text != identity.text {
        let difference = identity.difference(text);
        let message = format!("belongs to another {}; {ADVICE}\n{difference}", identity.kind);
        return Err(StudyError::kept(path, message));
    }
    Ok(())
}

/// How many entries a table of the journal in a folder has. Changes nothing.
///
/// # Errors
/// Where there is no journal, or it is in use or damaged.
pub(crate) fn count<K: redb::Key, V: redb::Value>(
    folder: &Path,
    table: TableDefinition<K, V>,
) -> Result<u64, StudyError> {
    let path = &folder.join(JOURNAL);
    let io = |error| StudyError::io(path, error);
    let file = File::options().read(true).write(true).open(path).map_err(io)?;
    lock(&file, path)?;
    let trial = Trial::new(file.try_clone().map_err(io)?).map_err(io)?;
    let count =
        |database: &mut Database| -> Result<u64, redb::Error> { Ok(database.begin_read()?.open_table(table)?.len()?) };
    match shielded(|| on_trial(trial, |error| error, count)) {
        Ok(count) => count.map_err(|error| failed(path, error)),
        Err(panic) => Err(damaged(path, panic)),
    }
}
