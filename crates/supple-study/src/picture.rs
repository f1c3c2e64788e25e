use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, NamedSource, SourceSpan};
use supple::FileError;

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

/// Bytes up to which a line of a file is worth showing.
const LONGEST: usize = 400;

/// The lines that an error is about, with marks, for people; none where there are none to show.
pub fn picture(error: &FileError) -> Option<String> {
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
