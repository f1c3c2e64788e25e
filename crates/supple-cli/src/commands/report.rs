use std::path::Path;

use supple_report::ReportError;
use supple_study::{Folder, check_writable, write_text};

use crate::arguments::ReportOptions;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output::{print_text, warn_changed};

/// `supple report DIR...`
pub fn report(options: &ReportOptions) -> Result<Outcome, Failure> {
    let out = &options.out;
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = out.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    if name.is_empty() {
        return Err(Failure::usage(format!("--out {} is not a file name", out.display())));
    }
    check_writable(folder, &name)?;
    let folders = Folder::load_all(&options.folders)?;
    folders.iter().for_each(|folder| warn_changed(&folder.path));
    let page = supple_report::page(&folders).map_err(failure)?;
    write_text(out, page.as_bytes())?;
    print_text(&format!("{}: {:.1} MB\n", out.display(), page.len() as f64 / 1e6))?;
    Ok(Outcome::Success)
}

fn failure(error: ReportError) -> Failure {
    match error {
        ReportError::Study(error) => error.into(),
        other => Failure::usage(other.to_string()),
    }
}
