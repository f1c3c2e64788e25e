use std::io::Write;

use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, NamedSource, SourceSpan};
use supple::FileError;
use supple_study::StudyError;

/// Why a command could not do what was asked: exit code 2, nothing written.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Something is wrong in a task file.
    #[error("{0}")]
    File(#[from] Box<FileError>),
    /// Something is wrong with the arguments.
    #[error("{0}")]
    Usage(String),
    /// Something could not be computed.
    #[error("{0}")]
    Compute(#[from] supple::Error),
    /// Ctrl-C came before there was anything to keep: exit code 1.
    #[error("stopped: nothing is kept")]
    Stopped,
    /// A file or stream could not be written.
    #[error("{what}: {error}")]
    Write { what: String, error: std::io::Error },
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        match error {
            StudyError::File(error) => Self::File(error),
            StudyError::Usage(message) => Self::Usage(message),
            StudyError::Compute(error) => Self::Compute(error),
            StudyError::Io { what, error } => Self::Write { what, error },
            StudyError::Stopped => Self::Stopped,
            kept @ StudyError::Kept { .. } => Self::Usage(kept.to_string()),
        }
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        Self::File(Box::new(error))
    }
}

/// A file error with the lines it is about.
#[derive(Debug, Diagnostic, thiserror::Error)]
#[error("{message}")]
struct Located {
    message: String,
    #[source_code]
    text: NamedSource<String>,
    #[label("here")]
    span: SourceSpan,
    #[help]
    help: Option<String>,
}

impl Failure {
    pub fn usage(message: String) -> Self {
        Self::Usage(message)
    }

    pub fn write(what: impl std::fmt::Display, error: std::io::Error) -> Self {
        Self::Write { what: what.to_string(), error }
    }

    /// Tells the user, on standard error; where that cannot be written, the exit code has to do.
    pub fn report(&self) {
        // One line for programs and logs, then the place in the file for people.
        let picture = match self {
            Self::File(error) => picture(error).unwrap_or_default(),
            _ => String::new(),
        };
        let _ = write!(std::io::stderr(), "error: {self}\n{picture}");
    }
}

/// Bytes up to which a line of a file is worth showing.
const LONGEST: usize = 400;

/// The lines that an error is about; none where there are none to show.
fn picture(error: &FileError) -> Option<String> {
    let line = error.line.checked_sub(1)?;
    let short = |line: &str| line.len() <= LONGEST;
    error.text.lines().nth(line).filter(|line| short(line) && !line.trim().is_empty())?;
    let around = error.text.lines().skip(line.saturating_sub(1)).take(3).all(short);
    // What spans several lines, such as a long list, is shown by its first.
    let start = error.span.start;
    let first = error.text.get(start..)?.lines().next().map_or(0, str::len);
    let located = Located {
        message: if error.key.is_empty() { error.message.clone() } else { format!("{}: {}", error.key, error.message) },
        text: NamedSource::new(&error.file, error.text.clone()),
        span: SourceSpan::from(start..error.span.end.min(start + first)),
        help: error.help.clone(),
    };
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor());
    let mut page = String::new();
    handler.with_context_lines(usize::from(around)).render_report(&mut page, &located).ok()?;
    Some(page)
}
