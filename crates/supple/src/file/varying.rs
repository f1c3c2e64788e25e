use serde::Deserialize;
use supple_files::{FileError, nearest, quoted};

use super::document::{Document, Place};
use super::tasks::matches;
use crate::noise::VaryingVariance;
use crate::parameters::Parameters;
use crate::{Channel, Value};

/// One of `[[tasks.noise.varying]]`: `coefficient (state - center)^2` on top of the variances of measurements.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct VaryingFile {
    /// Names of the measurements, in which * stands for any letters: of each the variance varies.
    #[schemars(length(min = 1))]
    measurement: Vec<String>,
    /// Name of the state.
    state: String,
    /// Where the state is seen best, in its unit.
    center: Value,
    /// Variance per square of the state's unit, at least 0.
    coefficient: Value,
}

/// Which names there are.
pub(super) struct Named<'a> {
    pub measurements: &'a [Channel],
    pub states: &'a [String],
    pub parameters: &'a Parameters,
}

/// What varies of the noise of task `task`: one entry for each measurement that is named.
///
/// # Errors
/// A name that is none of those there are, with advice; a coefficient that is or can be negative.
pub(super) fn read(
    document: &Document,
    (task, given): (usize, &[VaryingFile]),
    named: &Named,
) -> Result<Vec<VaryingVariance>, FileError> {
    let read = |(number, file): (usize, &VaryingFile)| {
        let at = |keys: &[Place<'static>]| -> Vec<Place<'static>> {
            let head = ["tasks".into(), task.into(), "noise".into(), "varying".into(), number.into()];
            head.into_iter().chain(keys.iter().copied()).collect()
        };
        let Some(state) = named.states.iter().position(|name| *name == file.state) else {
            let message = format!("no state is `{}`: there are {}", file.state, quoted(named.states));
            let help = nearest(&file.state, named.states);
            return Err(FileError { help, ..document.error(&at(&["state".into()]), message) });
        };
        if let Some(least) = named.parameters.least(file.coefficient).filter(|&least| least < 0.0) {
            let message = format!("must be at least 0, as it adds to a variance; {}", file.coefficient.found(least));
            return Err(document.error(&at(&["coefficient".into()]), message));
        }
        let measurements = measurements(file, named.measurements).map_err(|(entry, message, help)| {
            let keys: Vec<Place> = ["measurement".into()].into_iter().chain(entry.map(Place::from)).collect();
            FileError { help, ..document.error(&at(&keys), message) }
        })?;
        let &VaryingFile { center, coefficient, .. } = file;
        Ok(measurements.into_iter().map(move |measurement| VaryingVariance { measurement, state, center, coefficient }))
    };
    let read = given.iter().enumerate().map(read).collect::<Result<Vec<_>, _>>()?;
    Ok(read.into_iter().flatten().collect())
}

/// Which entry of a list is wrong, why, and what to do.
type Wrong = (Option<usize>, String, Option<String>);

/// Places of the measurements that are named, each once.
fn measurements(file: &VaryingFile, channels: &[Channel]) -> Result<Vec<usize>, Wrong> {
    if file.measurement.is_empty() {
        return Err((None, "must name at least one measurement; found an empty list".to_owned(), None));
    }
    let names: Vec<&str> = channels.iter().map(|channel| channel.name.as_str()).collect();
    let fits = |pattern: &str, place: usize| matches(pattern, names[place]);
    for (entry, pattern) in file.measurement.iter().enumerate() {
        if !(0..names.len()).any(|place| fits(pattern, place)) {
            let verb = if pattern.contains('*') { "fits" } else { "is" };
            let message = format!("no measurement {verb} `{pattern}`: there are {}", quoted(&names));
            return Err((Some(entry), message, nearest(pattern, &names)));
        }
    }
    Ok((0..names.len()).filter(|&place| file.measurement.iter().any(|pattern| fits(pattern, place))).collect())
}
