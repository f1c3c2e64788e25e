use supple_model::Channels;
use supple_model::document::Document;
use supple_model::noise::{NamedVariance, VaryingVariance};
use supple_model::parameters::Parameters;
use supple_text::FileError;

/// The state-dependent part of the noise of task `task`, `[[tasks.noise.varying]]`: one entry per named measurement.
///
/// # Errors
/// A name that is none of those there are, with advice; a coefficient that is or can be negative.
pub(super) fn read(
    document: &Document,
    task: usize,
    given: &[NamedVariance],
    channels: &Channels,
    parameters: &Parameters,
) -> Result<Vec<VaryingVariance>, FileError> {
    let read = |(number, law): (usize, &NamedVariance)| {
        law.find(channels, parameters).map_err(|wrong| {
            wrong.at(document, &["tasks".into(), task.into(), "noise".into(), "varying".into(), number.into()])
        })
    };
    let read = given.iter().enumerate().map(read).collect::<Result<Vec<_>, _>>()?;
    Ok(read.concat())
}
