use std::io::{ErrorKind, Write};
use std::path::Path;

use crate::StudyError;

/// The file that holds a result and all that made it.
///
/// Example: [`changed`](crate::changed).
pub const RESULT: &str = "result.json";

/// Checks that a file can be written to a folder before long work is done for it. Leaves nothing behind.
///
/// # Errors
/// Where it cannot be written.
///
/// Example: [`write_text`].
pub fn check_writable(folder: &Path, name: &str) -> Result<(), StudyError> {
    let path = folder.join(name);
    let existing = folder.ancestors().find(|folder| folder.exists()).unwrap_or(Path::new("."));
    match tempfile::tempfile_in(existing) {
        Err(error) => Err(not_written(&path, error)),
        Ok(_) if path.is_dir() => Err(not_written(&path, ErrorKind::IsADirectory.into())),
        Ok(_) => Ok(()),
    }
}

/// The error of a file that cannot be written, with what to do about it.
pub(crate) fn not_written(path: &Path, error: std::io::Error) -> StudyError {
    let existing = path.ancestors().skip(1).find(|folder| folder.exists() && !folder.as_os_str().is_empty());
    let existing = existing.unwrap_or(Path::new(".")).display();
    let message = match error.kind() {
        ErrorKind::NotADirectory => {
            format!("`{existing}` is a file, not a folder; choose another folder, or rename the file")
        }
        ErrorKind::IsADirectory => "is a folder; choose another place, or remove it".to_owned(),
        ErrorKind::PermissionDenied => {
            format!("no permission to write in `{existing}`; choose another folder, or change its permissions")
        }
        ErrorKind::ReadOnlyFilesystem => format!("`{existing}` is read-only; choose another folder"),
        ErrorKind::NotFound => format!("nothing can be created in `{existing}`; choose another folder"),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            format!("{error}; free some space, or choose a folder on another disk")
        }
        _ => return StudyError::io(path, error),
    };
    StudyError::io(path, std::io::Error::new(error.kind(), message))
}

/// Writes a file whole or not at all, in place of one that is there already; makes its folder.
///
/// # Errors
/// Where it cannot be written; what was there before is still there.
///
/// ```
/// use supple_study::{check_writable, write_text};
///
/// let folder = tempfile::tempdir()?;
/// check_writable(folder.path(), "note.txt")?;
/// let path = folder.path().join("note.txt");
/// write_text(&path, b"done")?;
/// assert_eq!(std::fs::read(&path)?, b"done");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_text(path: &Path, bytes: &[u8]) -> Result<(), StudyError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let written = || {
        std::fs::create_dir_all(folder)?;
        let mut builder = tempfile::Builder::new();
        // As any new file, and not for its owner alone.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut file = builder.tempfile_in(folder)?;
        file.write_all(bytes)?;
        file.as_file().sync_all()?;
        file.persist(path).map_err(|error| error.error)
    };
    written().map(|_| ()).map_err(|error| not_written(path, error))
}
