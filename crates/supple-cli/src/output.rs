use std::io::Write;
use std::path::Path;

use serde::Serialize;

use crate::failure::Failure;

/// Prints one JSON object on standard output.
pub fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    let text = to_json(value)?;
    print_text(&format!("{text}\n"))
}

/// Prints text on standard output; a reader that hung up is no failure.
pub fn print_text(text: &str) -> Result<(), Failure> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(Failure::write("standard output", error)),
        _ => Ok(()),
    }
}

fn to_json(value: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map_err(|error| Failure::write("JSON", error.into()))
}

/// Writes a JSON file whole or not at all: into a temporary file beside it, then renamed.
pub fn write_json(folder: &Path, name: &str, value: &impl Serialize) -> Result<(), Failure> {
    let path = folder.join(name);
    let fail = |error| Failure::write(path.display(), error);
    let text = to_json(value)?;
    std::fs::create_dir_all(folder).map_err(fail)?;
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(fail)?;
    file.write_all(text.as_bytes()).and_then(|()| file.write_all(b"\n")).map_err(fail)?;
    file.as_file().sync_all().map_err(fail)?;
    file.persist(&path).map_err(|error| Failure::write(path.display(), error.error))?;
    Ok(())
}
