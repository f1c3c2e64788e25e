use std::io::Write;

use supple::FileError;
use supple_study::{StudyError, picture};

use supple_text::plain;

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct Failure(#[from] StudyError);

impl From<supple::Error> for Failure {
    fn from(error: supple::Error) -> Self {
        Self(error.into())
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        Self(error.into())
    }
}

impl Failure {
    pub fn usage(message: String) -> Self {
        Self(StudyError::Usage(message))
    }

    pub fn write(what: impl std::fmt::Display, error: std::io::Error) -> Self {
        Self(StudyError::Io { what: what.to_string(), error })
    }

    /// Whether the error already names the file at fault.
    pub fn is_of_file(&self) -> bool {
        matches!(self.0, StudyError::File(_) | StudyError::Io { .. })
    }

    /// 1 if stopped before there was anything to store, otherwise 2.
    pub fn exit_code(&self) -> u8 {
        if matches!(self.0, StudyError::Stopped) { 1 } else { 2 }
    }

    /// Prints the error on standard error; if that fails, the exit code is all the user gets.
    pub fn report(&self) {
        // One line for programs and logs, then the place in the file for people.
        let picture = match self {
            Self(StudyError::File(error)) => picture(error).unwrap_or_default(),
            _ => String::new(),
        };
        let _ = write!(std::io::stderr(), "{}", plain(&format!("error: {self}\n{picture}")));
    }
}
