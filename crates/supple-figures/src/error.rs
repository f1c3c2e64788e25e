use supple_study::StudyError;

/// Why a figure could not be drawn.
///
/// ```
/// use supple_figures::{Kind, draw};
///
/// let error = draw(Kind::Pareto, &[], None).unwrap_err();
/// assert_eq!(error.to_string(), "the figure `pareto` requires a folder of `supple pareto`; given: nothing");
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FigureError {
    /// A folder cannot be read.
    #[error("{0}")]
    Study(#[from] StudyError),
    /// The results given are not those that the figure shows.
    #[error("the figure `{figure}` requires {needs}; given: {given}")]
    Needs {
        /// The figure.
        figure: &'static str,
        /// What it shows.
        needs: &'static str,
        /// What there is.
        given: String,
    },
    /// No result has a task of this name.
    #[error("no task is named `{name}`; valid names: {valid}")]
    UnknownTask {
        /// What was asked for.
        name: String,
        /// The tasks there are.
        valid: String,
    },
    /// A result has not what the figure shows.
    #[error("{folder}: {message}")]
    Content {
        /// Its folder.
        folder: String,
        /// What is missing, and what to do.
        message: String,
    },
    /// The file of a figure could not be made.
    #[error("the figure `{figure}` cannot be written as {format}: {message}")]
    Render {
        /// The figure.
        figure: String,
        /// The format.
        format: &'static str,
        /// Why.
        message: String,
    },
}
