use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, NamedSource, SourceSpan};
use supple::FileError;

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
    /// A file or stream could not be written.
    #[error("{what}: {error}")]
    Write { what: String, error: std::io::Error },
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

    /// Tells the user, on standard error.
    pub fn report(&self) {
        match self {
            Self::File(error) if error.line > 0 => {
                // One line for programs and logs, then the place in the file for people.
                eprintln!("error: {error}");
                let located = Located {
                    message: error.message.clone(),
                    text: NamedSource::new(&error.file, error.text.clone()),
                    span: SourceSpan::from(error.span.start..error.span.end.min(error.text.len())),
                    help: error.help.clone(),
                };
                let mut page = String::new();
                let theme = GraphicalTheme::unicode_nocolor();
                if GraphicalReportHandler::new_themed(theme).render_report(&mut page, &located).is_ok() {
                    eprint!("{page}");
                }
            }
            other => eprintln!("error: {other}"),
        }
    }
}
