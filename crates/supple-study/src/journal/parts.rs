use std::collections::BTreeMap;
use std::path::Path;

use redb::{ReadTransaction, ReadableTable, TableDefinition, WriteTransaction};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Identity, JOURNAL, Journal, Layout, count};
use crate::{StudyError, Watch};

/// What a part found, by the name of the part, as CBOR: every number keeps its bits.
const PARTS: TableDefinition<&str, &[u8]> = TableDefinition::new("parts");

/// The finished parts of a study by name, such as its searches. A study that has a folder keeps them in a journal
/// there, and the same study reads them again instead of computing them.
pub(crate) struct Parts {
    journal: Option<Journal>,
    known: BTreeMap<String, Vec<u8>>,
}

struct Named;

impl Layout for Named {
    type Done = BTreeMap<String, Vec<u8>>;

    fn create(&self, change: &WriteTransaction) -> Result<(), redb::Error> {
        change.open_table(PARTS)?;
        Ok(())
    }

    fn read(&self, journal: &ReadTransaction) -> Result<Option<Self::Done>, redb::Error> {
        let parts = journal.open_table(PARTS)?;
        let mut known = BTreeMap::new();
        for entry in parts.iter()? {
            let (name, bytes) = entry?;
            known.insert(name.value().to_owned(), bytes.value().to_owned());
        }
        Ok(Some(known))
    }
}

impl Parts {
    /// Those of a study; with a folder, of its journal there, or a new one.
    ///
    /// # Errors
    /// Where the journal cannot be written, is in use, is damaged, or belongs to another study.
    pub fn open(folder: Option<&Path>, identity: &Identity) -> Result<Self, StudyError> {
        let Some(folder) = folder else { return Ok(Self { journal: None, known: BTreeMap::new() }) };
        let (journal, known) = Journal::open(folder, &Named, identity)?;
        Ok(Self { journal: Some(journal), known: known.unwrap_or_default() })
    }

    /// A part that was done before.
    ///
    /// # Errors
    /// Where it is no such part.
    pub fn find<T: DeserializeOwned>(&self, name: &str) -> Result<Option<T>, StudyError> {
        let (Some(journal), Some(bytes)) = (&self.journal, self.known.get(name)) else { return Ok(None) };
        let read = ciborium::from_reader(&bytes[..]);
        read.map(Some).map_err(|error| journal.damaged(format_args!("its part `{name}` cannot be read: {error}")))
    }

    /// Keeps a part that is done.
    ///
    /// # Errors
    /// Where the journal cannot be written.
    pub fn keep<T: Serialize>(&self, name: &str, part: &T) -> Result<(), StudyError> {
        let Some(journal) = &self.journal else { return Ok(()) };
        let mut bytes = Vec::new();
        ciborium::into_writer(part, &mut bytes)
            .map_err(|error| StudyError::usage(format!("the part `{name}` cannot be stored: {error}")))?;
        journal.keep(|change| {
            change.open_table(PARTS)?.insert(name, &bytes[..])?;
            Ok(())
        })
    }

    /// A part: as it was found before, or as it is found now, and then kept.
    ///
    /// # Errors
    /// Those of the work and of the journal; if it is stopped, as what was under way then may be cut short.
    pub fn part<T: Serialize + DeserializeOwned>(
        &self,
        name: &str,
        watch: Watch,
        work: impl FnOnce() -> Result<T, StudyError>,
    ) -> Result<T, StudyError> {
        if let Some(found) = self.find(name)? {
            return Ok(found);
        }
        if watch.is_stopped() {
            return Err(StudyError::Stopped);
        }
        let found = work()?;
        if watch.is_stopped() {
            return Err(StudyError::Stopped);
        }
        self.keep(name, &found)?;
        Ok(found)
    }
}

/// How many parts of a study, such as searches, the journal in a folder keeps; 0 where there is no journal. Changes
/// nothing.
///
/// # Errors
/// Where the journal is in use or damaged.
///
/// ```
/// use supple::design::DesignSettings;
/// use supple_study::study::Work;
/// use supple_study::{JOURNAL, LoadedTask, Source, Watch, forget, kept_parts};
/// # let text = r#"
/// #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
/// #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
/// #     [[tasks]]
/// #     name = "hold"
/// #     steps = 20
/// #     time_step = 0.1
/// #     initial_state = [1.0]
/// #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
/// # "#;
/// # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
///
/// // The task of the front page.
/// let task = LoadedTask::restore(&[source])?;
/// let settings = DesignSettings { starts: 1, ..task.problem.design.clone() };
/// let folder = tempfile::tempdir()?;
/// Work::Design(Box::new(settings)).run(&task, Some(folder.path()), Watch::default())?;
/// assert!(folder.path().join(JOURNAL).exists());
/// assert_eq!(kept_parts(folder.path())?, 1, "the search from one start");
/// forget(folder.path())?;
/// assert_eq!(kept_parts(folder.path())?, 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn kept_parts(folder: &Path) -> Result<u64, StudyError> {
    if folder.join(JOURNAL).exists() { count(folder, PARTS) } else { Ok(0) }
}

/// Removes the journal of a study with nothing to resume: its result is complete and stored, or none of its parts is
/// done.
///
/// # Errors
/// Where it is there and cannot be removed.
///
/// Example: [`kept_parts`].
pub fn forget(folder: &Path) -> Result<(), StudyError> {
    let path = folder.join(JOURNAL);
    match std::fs::remove_file(&path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(StudyError::io(&path, error)),
        _ => Ok(()),
    }
}
