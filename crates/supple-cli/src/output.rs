use std::io::{ErrorKind, Write};
use std::path::Path;

use serde::Serialize;
use supple_study::CHECKSUMS;
use tempfile::NamedTempFile;

use crate::failure::Failure;
use supple_text::plain;

/// The page that a study file ends in, in its folder.
pub const REPORT: &str = "report.html";

/// Prints one JSON object on standard output.
pub fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    let text = to_json(value)?;
    print_text(&format!("{text}\n"))
}

/// Prints text on standard output; a closed pipe is not an error.
pub fn print_text(text: &str) -> Result<(), Failure> {
    match std::io::stdout().lock().write_all(plain(text).as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Failure::write("standard output", error)),
        _ => Ok(()),
    }
}

/// Prints a progress message on standard error.
pub fn note(text: &str) {
    // If standard error cannot be written, there is no way to report that.
    let _ = writeln!(std::io::stderr(), "{}", plain(text));
}

/// Prints a warning on standard error.
pub fn warn(warning: &str) {
    // If standard error cannot be written, there is no way to report that.
    let _ = writeln!(std::io::stderr(), "warning: {}", plain(warning));
}

/// Warns about files of a result that have changed since they were saved.
pub fn warn_changed(folder: &Path) {
    for name in supple_study::changed(folder) {
        let path = folder.join(name);
        warn(&format!("{} has changed since it was made: its checksum does not match {CHECKSUMS}", path.display()));
    }
}

fn to_json(value: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map_err(|error| Failure::write("JSON", error.into()))
}

/// Writes a new text file atomically; fails if it already exists.
pub fn write_new(path: &Path, text: &str) -> std::io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    temporary(folder, text)?.persist_noclobber(path).map(|_| ()).map_err(|error| error.error)
}

/// A temporary file containing `text`, to be renamed within its folder.
fn temporary(folder: &Path, text: &str) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    // Default permissions of a new file: temporary files are readable only by their owner.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(text.as_bytes())?;
    file.as_file().sync_all()?;
    Ok(file)
}
