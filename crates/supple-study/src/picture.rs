use std::path::Path;

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

/// Extensions of files whose lines are shown. An untrusted task file may name any file, whose lines must not leak.
const SHOWN: [&str; 8] = ["toml", "urdf", "xml", "sdf", "world", "mjcf", "csv", "json"];

/// Whether lines of a file are shown.
fn is_shown(file: &str) -> bool {
    let ending = Path::new(file).extension().map(|ending| ending.to_string_lossy().to_lowercase());
    ending.is_some_and(|ending| SHOWN.contains(&&*ending))
}

/// The lines that an error is about, with marks, for people; `None` if there are none to show.
///
/// ```
/// use supple_study::picture;
///
/// let task = r#"
///     [model]
///     kind = "two_masses"
///     [[tasks]]
/// "#;
/// let error = supple_file::parse(task, "press.toml").err().ok_or("there is no such kind")?;
/// let shown = picture(&error).ok_or("lines of task files are shown")?;
/// assert!(shown.contains(r#"kind = "two_masses""#));
/// # Ok::<(), &'static str>(())
/// ```
pub fn picture(error: &FileError) -> Option<String> {
    let line = error.line.checked_sub(1)?;
    if !is_shown(&error.file) {
        return None;
    }
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
