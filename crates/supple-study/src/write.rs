use std::io::{ErrorKind, Write};
use std::path::Path;

use crate::StudyError;

/// The file that holds a result and all that made it.
pub const RESULT: &str = "result.json";

/// Checks that a file can be written to a folder before long work is done for it. Leaves nothing behind.
///
/// # Errors
/// Where it cannot be written.
pub fn check_writable(folder: &Path, name: &str) -> Result<(), StudyError> {
    let path = folder.join(name);
    let existing = folder.ancestors().find(|folder| folder.exists()).unwrap_or(Path::new("."));
    match tempfile::tempfile_in(existing) {
        Err(error) => Err(StudyError::io(&path, error)),
        Ok(_) if path.is_dir() => Err(StudyError::io(&path, ErrorKind::IsADirectory.into())),
        Ok(_) => Ok(()),
    }
}

/// Writes a file whole or not at all, in place of one that is there already; makes its folder.
///
/// # Errors
/// Where it cannot be written; what was there before is still there.
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
    written().map(|_| ()).map_err(|error| StudyError::io(path, error))
}
