use std::path::{Path, PathBuf};

use super::c::CSource;
use super::exported::ExportedController;
use super::file::ControllerFile;
use super::npz;
use crate::{StudyError, check_writable, write_text};

/// How a controller is written.
///
/// Example: the [module](crate::controller).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ControllerFormat {
    /// A header and a source of C99.
    C,
    /// One JSON object.
    Json,
    /// Arrays that `numpy.load` reads.
    Npz,
}

impl ControllerFormat {
    /// The ending of its files' names.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::C => "c",
            Self::Json => "json",
            Self::Npz => "npz",
        }
    }
}

impl ExportedController {
    /// The controller as one JSON object.
    ///
    /// # Errors
    /// Where it cannot be told in JSON.
    pub fn to_json(&self) -> Result<String, StudyError> {
        let text = serde_json::to_string(&ControllerFile::of(self));
        text.map(|text| text + "\n").map_err(|error| StudyError::Usage(error.to_string()))
    }

    /// Writes it to a file; to two, `NAME.c` and `NAME.h`, where it is C. What was written.
    ///
    /// # Errors
    /// Where the path names no file, ends otherwise than the C source, or cannot be written.
    pub fn write(&self, format: ControllerFormat, path: &Path) -> Result<Vec<PathBuf>, StudyError> {
        check_out(format, path)?;
        match format {
            ControllerFormat::Json => write_text(path, self.to_json()?.as_bytes())?,
            ControllerFormat::Npz => write_text(path, &npz::bytes(&ControllerFile::of(self), path)?)?,
            ControllerFormat::C => {
                let header = path.with_extension("h");
                let name = header.file_name().unwrap_or_default().to_string_lossy().into_owned();
                let CSource { header: declared, source } = CSource::of(self, &name)?;
                write_text(&header, declared.as_bytes())?;
                write_text(path, source.as_bytes())?;
                return Ok(vec![path.to_owned(), header]);
            }
        }
        Ok(vec![path.to_owned()])
    }
}

/// Checks that a controller can be written to a path.
///
/// # Errors
/// Where the path names no file, ends otherwise than the C source, or cannot be written.
///
/// Example: [`ExportedController::write`] checks its path by it, in the example of the [module](crate::controller).
pub fn check_out(format: ControllerFormat, path: &Path) -> Result<(), StudyError> {
    let Some(name) = path.file_name().map(|name| name.to_string_lossy()) else {
        return Err(StudyError::usage(format!("{} is not a file name", path.display())));
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    if format == ControllerFormat::C {
        let stem = name.strip_suffix(".c").unwrap_or_default();
        if stem.is_empty() || stem.contains(['"', '\\', '\n']) {
            let message = "the source of C must be a file NAME.c; NAME.h is written beside it";
            return Err(StudyError::usage(format!("{}: {message}", path.display())));
        }
        check_writable(folder, &format!("{stem}.h"))?;
    }
    check_writable(folder, &name)
}
