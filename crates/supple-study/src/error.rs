use std::path::Path;

use supple::FileError;
use supple::parameters::ParameterError;

/// Why a study could not be made, kept or read.
///
/// ```
/// let error = supple_study::LoadedTask::restore(&[]).err().map(|error| error.to_string());
/// assert_eq!(error.as_deref(), Some("there is no text of a task file"));
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// Something is wrong in a file.
    #[error("{0}")]
    File(#[from] Box<FileError>),
    /// Something is wrong with what was asked for.
    #[error("{0}")]
    Usage(String),
    /// Something could not be computed.
    #[error("{0}")]
    Compute(supple::Error),
    /// Something could not be computed of the task in a file.
    #[error("{file}: {error}")]
    ComputeOf {
        /// The task file.
        file: String,
        /// What could not be computed.
        error: supple::Error,
    },
    /// A file could not be read or written.
    #[error("{what}: {error}")]
    Io {
        /// The file.
        what: String,
        /// Why.
        error: std::io::Error,
    },
    /// Stopped before any result was available.
    #[error("stopped; no result was stored")]
    Stopped,
    /// A journal or result that does not fit: from another task or version, or damaged.
    #[error("{path}: {message}")]
    Kept {
        /// The file or folder.
        path: String,
        /// What is wrong, and what to do.
        message: String,
    },
}

impl From<supple::Error> for StudyError {
    fn from(error: supple::Error) -> Self {
        if matches!(error, supple::Error::Stopped) { Self::Stopped } else { Self::Compute(error) }
    }
}

impl From<supple::lqg::Error> for StudyError {
    fn from(error: supple::lqg::Error) -> Self {
        supple::Error::from(error).into()
    }
}

impl From<ParameterError> for StudyError {
    fn from(error: ParameterError) -> Self {
        Self::Compute(error.into())
    }
}

impl From<FileError> for StudyError {
    fn from(error: FileError) -> Self {
        Self::File(Box::new(error))
    }
}

impl StudyError {
    /// Something wrong with what was asked for.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::Usage(message.into())
    }

    /// A file that could not be read or written.
    #[must_use]
    pub fn io(path: &Path, error: std::io::Error) -> Self {
        Self::Io { what: path.display().to_string(), error }
    }

    /// A journal or result that does not fit.
    pub fn kept(path: &Path, message: impl Into<String>) -> Self {
        Self::Kept { path: path.display().to_string(), message: message.into() }
    }
}
