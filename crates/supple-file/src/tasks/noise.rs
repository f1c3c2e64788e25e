//! `[tasks.noise]`: variances, standard deviations and covariances.

use serde::Deserialize;
use supple_lqg::Dimensions;
use supple_model::Value;
use supple_model::document::{Content, Place, Spanned, Unfit, matches};
use supple_model::model::AnyModel;
use supple_model::noise::{Covariance, NamedVariance, NoiseModel, VaryingVariance};
use supple_text::FileError;

use super::reader::Reader;
use crate::rows::Rows;
use crate::varying;

/// The noise of a task: variances, variances by the states' names, or full symmetric matrices; or standard deviations
/// in the place of variances.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct NoiseFile {
    /// Covariance of the initial state, n.
    initial: Option<Rows>,
    /// Standard deviations of the initial state; replaces `initial`.
    initial_deviation: Option<Rows>,
    /// Of the process, n; may be singular.
    process: Option<Rows>,
    /// Standard deviations of the process, in the place of `process`.
    process_deviation: Option<Rows>,
    /// Of the measurement, p; positive definite. Default: that of the model's sensors.
    measurement: Option<Rows>,
    /// Standard deviations of the measurement, in the place of `measurement`.
    measurement_deviation: Option<Rows>,
    /// What is added to the variances of measurements where they depend on the state.
    #[serde(default)]
    varying: Vec<NamedVariance>,
}

impl Reader<'_> {
    /// A covariance of the states, or of measurements, which have no names.
    fn read_covariance(
        &self,
        key: &'static str,
        rows: Rows,
        names: Option<&[String]>,
    ) -> Result<Covariance, FileError> {
        let keys = ["noise".into(), key.into()];
        match (rows, names) {
            (Rows::Flat(variances), _) => Ok(Covariance::Diagonal(variances)),
            (Rows::Nested(rows), _) => Ok(Covariance::full(rows)),
            (Rows::Named(given), Some(states)) => self.named(&keys, &given, states).map(Covariance::Diagonal),
            (Rows::Named(_), None) => Err(self
                .error(&keys, "must be a list of numbers, or a list of rows of numbers: measurements have no names")),
        }
    }

    /// A covariance that is given by one of two keys: variances or a matrix, or standard deviations.
    fn given(
        &self,
        key: &'static str,
        deviation_key: &'static str,
        rows: Option<Rows>,
        deviations: Option<Rows>,
        names: Option<&[String]>,
    ) -> Result<Option<Covariance>, FileError> {
        let wrong = |places: &[Place], message: String| {
            let at: Vec<Place> =
                ["noise".into(), deviation_key.into()].into_iter().chain(places.iter().copied()).collect();
            self.error(&at, message)
        };
        let square = |place: Place, value: &mut Value| {
            if let Some(least) = self.parameters.least(value).filter(|&least| least < 0.0) {
                let message = format!("must be at least 0, as a standard deviation; {}", value.found(least));
                return Err(wrong(&[place], message));
            }
            *value = value.squared();
            Ok(())
        };
        match (rows, deviations) {
            (Some(_), Some(_)) => Err(wrong(&[], format!("`{key}` and `{deviation_key}` are both given; keep one"))),
            (Some(rows), None) => self.read_covariance(key, rows, names).map(Some),
            (None, None) => Ok(None),
            (None, Some(mut rows)) => {
                match &mut rows {
                    Rows::Flat(list) => {
                        list.iter_mut().enumerate().try_for_each(|(i, value)| square(i.into(), value))?
                    }
                    Rows::Named(table) => {
                        table.iter_mut().try_for_each(|(name, value)| square(Place::Key(name), value))?;
                    }
                    Rows::Nested(_) => {
                        let message = "must be a list of numbers, or numbers by name; a matrix is given by";
                        return Err(wrong(&[], format!("{message} `{key}`")));
                    }
                }
                self.read_covariance(deviation_key, rows, names).map(Some)
            }
        }
    }

    pub(super) fn noise(
        &self,
        file: NoiseFile,
        model: &dyn AnyModel,
        states: &[String],
        steps: usize,
    ) -> Result<NoiseModel, FileError> {
        let size = model.dimensions();
        let own_states = size.states - model.recalled().len();
        let missing = |key: &'static str| self.error(&["noise".into(), key.into()], "is missing");
        let own =
            self.given("measurement", "measurement_deviation", file.measurement, file.measurement_deviation, None)?;
        let measurement = match (own, model.variances()) {
            (Some(own), _) => self.equipped(own, model, steps)?,
            (None, Some(variances)) => Covariance::Diagonal(variances),
            (None, None) => return Err(missing("measurement")),
        };
        let initial = self.given("initial", "initial_deviation", file.initial, file.initial_deviation, Some(states))?;
        let process = self.given("process", "process_deviation", file.process, file.process_deviation, Some(states))?;
        let initial = initial.ok_or_else(|| missing("initial"))?;
        let process = process.ok_or_else(|| missing("process"))?;
        let noise = NoiseModel::new(initial, process, measurement);
        let own_size = Dimensions { states: own_states, ..size };
        noise.check(own_size, steps, self.parameters).map_err(|unfit| self.misfit(unfit, states))?;
        Ok(NoiseModel { varying: self.varying(&file.varying, model)?, ..noise })
    }

    /// What varies of the noise.
    fn varying(&self, given: &[NamedVariance], model: &dyn AnyModel) -> Result<Vec<VaryingVariance>, FileError> {
        varying::read(self.document, self.index, given, &model.channels(), self.parameters)
    }

    /// The noise of all measurements from that of the model's own, where a catalogue adds some.
    fn equipped(&self, own: Covariance, model: &dyn AnyModel, steps: usize) -> Result<Covariance, FileError> {
        let Some(equipment) = model.equipment() else { return Ok(own) };
        let none = || Covariance::Diagonal(Vec::new());
        let alone = NoiseModel::new(none(), none(), own.clone());
        let size = Dimensions { states: 0, controls: 0, measurements: equipment.own };
        alone.check(size, steps, self.parameters).map_err(|unfit| self.misfit(unfit, &[]))?;
        equipment.covariance(&own).map_err(|found| {
            let message =
                format!("must have one entry for each measurement of the model, {}; found {found}", equipment.own);
            self.error(&["noise".into(), "measurement".into()], message)
        })
    }

    /// The error of what does not fit in the noise: at the standard deviations or at the name of a state, where the file
    /// has these instead of variances or a list.
    fn misfit(&self, Unfit { place, message, help }: Unfit, states: &[String]) -> FileError {
        let deviation = match place.first() {
            Some(Place::Key("initial")) => "initial_deviation",
            Some(Place::Key("process")) => "process_deviation",
            Some(Place::Key("measurement")) => "measurement_deviation",
            _ => "",
        };
        let mut at: Vec<Place> = ["tasks".into(), self.index.into(), "noise".into()].into_iter().chain(place).collect();
        let deviations = [at[0], at[1], at[2], deviation.into()];
        let mut message = message;
        if self.document.get(&deviations).is_some() {
            at[3] = deviation.into();
            message = message.replace("variances", "standard deviations");
        }
        if let (Some(Content::Table(table)), [.., Place::Index(state)]) =
            (self.document.get(&at[..4.min(at.len())]).map(Spanned::get_ref), &at[..])
        {
            let names = || table.keys().map(|key| key.get_ref().as_ref());
            let state = states.get(*state).map_or("", String::as_str);
            let named = names().find(|name| *name == state).or_else(|| names().find(|name| matches(name, state)));
            at.pop();
            at.extend(named.map(Place::Key));
        }
        FileError { help, ..self.document.error(&at, message) }
    }
}
