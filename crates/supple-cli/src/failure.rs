use std::io::Write;

use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, NamedSource, SourceSpan};
use supple::FileError;
use supple_study::StudyError;

/// Why a command could not do what was asked.
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
        Self(StudyError::Usage(message))
    }

    pub fn write(what: impl std::fmt::Display, error: std::io::Error) -> Self {
        Self(StudyError::Io { what: what.to_string(), error })
    }

    /// 1 where it was stopped before there was anything to keep, or else 2.
    pub fn exit_code(&self) -> u8 {
        if matches!(self.0, StudyError::Stopped) { 1 } else { 2 }
    }

    /// Tells the user, on standard error; where that cannot be written, the exit code has to do.
    pub fn report(&self) {
        // One line for programs and logs, then the place in the file for people.
        let picture = match self {
            Self(StudyError::File(error)) => picture(error).unwrap_or_default(),
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
