use supple_study::StudyError;

/// Why a page could not be made.
///
/// ```
/// let error = supple_report::page(&[]).unwrap_err();
/// assert_eq!(error.to_string(), "there is no result to report: the folders hold none");
/// ```
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A folder could not be read.
    #[error("{0}")]
    Study(#[from] StudyError),
    /// There is nothing to show.
    #[error("{0}")]
    Nothing(String),
    /// Data of a plot could not be written as JSON.
    #[error("data of the page cannot be written: {0}")]
    Data(#[from] serde_json::Error),
    /// The page's data could not be packed.
    #[error("data of the page cannot be packed: {0}")]
    Pack(#[from] std::io::Error),
}
