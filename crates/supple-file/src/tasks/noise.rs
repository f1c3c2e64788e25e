//! `[tasks.noise]`: variances, standard deviations and covariances.

use serde::Deserialize;
use supple_kernels::{Matrices, rows};
use supple_lqg::refuse_indefinite;
use supple_model::Value;
use supple_model::document::Place;
use supple_model::model::AnyModel;
use supple_model::noise::{Covariance, NamedVariance, NoiseModel, VaryingVariance};
use supple_model::value::symmetrise;
use supple_text::FileError;

use super::Reader;
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
            (Rows::Nested(mut rows), _) => {
                // Matrices that are not square are refused with the order that is valid.
                if rows.iter().all(|row| row.len() == rows.len()) {
                    symmetrise(&mut rows).map_err(|found| {
                        let at = [keys[0], keys[1], found.row.into(), found.column.into()];
                        self.error(&at, found.message(&self.parameters.names()))
                    })?;
                }
                Ok(Covariance::Full(rows))
            }
            (Rows::Named(given), Some(states)) => {
                for (name, &variance) in &given {
                    self.variance((key, &[Place::Key(name)]), variance)?;
                }
                self.named(&keys, &given, states).map(Covariance::Diagonal)
            }
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
            if let Some(least) = self.parameters.least(*value).filter(|&least| least < 0.0) {
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
                self.read_covariance(key, rows, names).map(Some)
            }
        }
    }

    pub(super) fn noise(
        &self,
        file: NoiseFile,
        model: &dyn AnyModel,
        states: &[String],
    ) -> Result<NoiseModel, FileError> {
        let size = model.dimensions();
        let own_states = size.states - model.recalled().len();
        let missing = |key: &'static str| self.error(&["noise".into(), key.into()], "is missing");
        let own =
            self.given("measurement", "measurement_deviation", file.measurement, file.measurement_deviation, None)?;
        let measurement = match (own, model.variances()) {
            (Some(own), _) => self.equipped(own, model)?,
            (None, Some(variances)) => Covariance::Diagonal(variances),
            (None, None) => return Err(missing("measurement")),
        };
        let initial = self.given("initial", "initial_deviation", file.initial, file.initial_deviation, Some(states))?;
        let process = self.given("process", "process_deviation", file.process, file.process_deviation, Some(states))?;
        let file = NoiseModel {
            initial: initial.ok_or_else(|| missing("initial"))?,
            process: process.ok_or_else(|| missing("process"))?,
            measurement,
            varying: self.varying(&file.varying, model)?,
        };
        self.covariance("initial", &file.initial, own_states)?;
        self.covariance("process", &file.process, own_states)?;
        self.covariance("measurement", &file.measurement, size.measurements)?;
        let v = self.at_start(&file.measurement);
        let stride = v.stride();
        if let Err(minor) = rows::cholesky(&mut v.at(0).to_vec(), size.measurements, stride) {
            let message = format!("must be positive definite; its leading {} x {0} block is not", minor + 1);
            return Err(self.error(&["noise".into(), "measurement".into()], message));
        }
        Ok(file)
    }

    /// What varies of the noise.
    fn varying(&self, given: &[NamedVariance], model: &dyn AnyModel) -> Result<Vec<VaryingVariance>, FileError> {
        varying::read(self.document, (self.index, given), (&model.channels(), self.parameters))
    }

    /// The noise of all measurements from that of the model's own, where a catalogue adds some.
    fn equipped(&self, own: Covariance, model: &dyn AnyModel) -> Result<Covariance, FileError> {
        let Some(equipment) = model.equipment() else { return Ok(own) };
        self.covariance("measurement", &own, equipment.own)?;
        equipment.covariance(&own).map_err(|found| {
            let message =
                format!("must have one entry for each measurement of the model, {}; found {found}", equipment.own);
            self.error(&["noise".into(), "measurement".into()], message)
        })
    }

    /// A covariance at the parameters' initial values.
    fn at_start(&self, covariance: &Covariance) -> Matrices {
        let mut matrix = Matrices::constant(covariance.order(), covariance.order());
        covariance.resolve(&self.parameters.initial(), &mut matrix);
        matrix
    }

    /// Checks a variance, given the covariance that it is in and its place there.
    fn variance(&self, (key, at): (&'static str, &[Place]), variance: Value) -> Result<(), FileError> {
        let Some(least) = self.parameters.least(variance) else { return Ok(()) };
        let valid = match key {
            "measurement" if least <= 0.0 => "must be above 0, as every sensor has some noise",
            _ if least < 0.0 => "must be at least 0, as a variance",
            _ => return Ok(()),
        };
        let at: Vec<Place> = ["noise".into(), key.into()].into_iter().chain(at.iter().copied()).collect();
        Err(self.error(&at, format!("{valid}; {}", variance.found(least))))
    }

    fn covariance(&self, key: &'static str, covariance: &Covariance, order: usize) -> Result<(), FileError> {
        let error = |places: &[Place], message: String| {
            let at: Vec<Place> = ["noise".into(), key.into()].into_iter().chain(places.iter().copied()).collect();
            Err(self.error(&at, message))
        };
        match covariance {
            Covariance::Diagonal(variances) => {
                if variances.len() != order {
                    return error(&[], format!("must have {order} variances; found {}", variances.len()));
                }
                for (i, &variance) in variances.iter().enumerate() {
                    self.variance((key, &[i.into()]), variance)?;
                }
            }
            Covariance::Full(rows) => {
                if rows.len() != order || rows.iter().any(|row| row.len() != order) {
                    let widths: Vec<_> = rows.iter().map(Vec::len).collect();
                    return error(&[], format!("must be {order} x {order}; found rows of {widths:?} numbers"));
                }
                for (i, row) in rows.iter().enumerate() {
                    self.variance((key, &[i.into(), i.into()]), row[i])?;
                }
            }
            Covariance::Sequence(_) => return error(&[], "must be constant over time in a task file".into()),
        }
        if let Err(minor) = refuse_indefinite(&self.at_start(covariance), 0) {
            return error(&[], format!("must be positive semidefinite; its leading {minor} x {minor} block is not"));
        }
        Ok(())
    }
}
