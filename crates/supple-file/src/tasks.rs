use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;
use supple::plan::bounds_of;
use supple::{Task, most_steps};
use supple_kernels::{Matrices, rows};
use supple_lqg::Dimensions;
use supple_model::Value;
use supple_model::cost::{self, Cost};
use supple_model::document::{Document, Place};
use supple_model::model::{AnyModel, Kinds};
use supple_model::noise::{Covariance, NamedVariance, NoiseModel, VaryingVariance, semidefinite_factor};
use supple_model::parameters::Parameters;
use supple_model::quantity::Context;
use supple_text::{FileError, quoted};
use toml::de::DeValue;

use crate::first_state::{FirstState, InitialState, outside_limits};
use crate::followed;
use crate::rows::{Guess, Rows, by_name};
use crate::varying;

/// One of `[[tasks]]`. Its costs are read by kind.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct TaskFile {
    /// Its name, unlike that of any other task.
    name: String,
    /// How many steps it lasts, from 1 to 1,000,000; fewer for models with many states.
    #[schemars(range(min = 1, max = 1_000_000))]
    steps: usize,
    /// Time step, s.
    time_step: Value,
    /// The expected cost may be at most this. Without it there is no limit.
    bound: Option<Value>,
    /// Weight of its information in the objective; default: 1.
    #[serde(default = "one")]
    information_weight: f64,
    /// Mean of the first state: one number per state, or by the states' names. What is left out of a robot is at rest
    /// at 0, or at the middle of its range where that does not hold 0; of other models it is 0.
    initial_state: Option<InitialState>,
    /// First guess of the controls: one row for all steps, or one row per step. Where left out, what holds the first
    /// state: the torques that carry a robot's weight.
    initial_control: Option<Guess>,
    /// Whether plans keep the limits that the model has of its controls: a robot's are the efforts of its joints, and the
    /// ranges of the actuators of its file.
    #[serde(default)]
    enforce_effort_limits: bool,
    /// What the noise of process and measurement and the weights of stages are per. Those per second stay what they are by time
    /// with another time step: in a step, variances of the process and weights of stages count times the time step, and
    /// variances of measurements, those of sensors too, divided by it.
    #[serde(default)]
    per: Per,
    /// Its noise.
    noise: NoiseFile,
    /// What it costs: a list of tables, each with a `kind`.
    #[schemars(skip)]
    #[allow(dead_code)]
    costs: IgnoredAny,
    /// Limits of quantities, reported where plans exceed them: a list of tables, each with a `kind`.
    #[serde(default)]
    #[schemars(skip)]
    #[allow(dead_code)]
    limits: IgnoredAny,
    /// Quantities to show over time: a list of tables, each with a `kind`.
    #[serde(default)]
    #[schemars(skip)]
    #[allow(dead_code)]
    curves: IgnoredAny,
}

fn one() -> f64 {
    1.0
}

/// What noise and weights are per.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Per {
    /// One time step.
    #[default]
    Step,
    /// One second.
    Second,
}

/// The noise of a task: variances, variances by the states' names, or full symmetric matrices; or standard deviations in the
/// place of variances.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct NoiseFile {
    /// Of the first state, n.
    initial: Option<Rows>,
    /// Standard deviations of the first state, in the place of `initial`.
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

/// Keys of costs by which weights of the end are given.
const FINAL_WEIGHTS: [&str; 2] = ["final_weight", "final"];

/// Where limits of controls come from.
const NO_LIMITS: &str =
    "the robot's file gives efforts to the joints with drives, whose gears must be numbers, or ranges to its actuators";

/// Reads `[[tasks]]`.
///
/// Also what looks like a mistake.
pub(super) fn read(
    document: &Document,
    model: &dyn AnyModel,
    parameters: &Parameters,
    kinds: &Kinds,
) -> Result<(Vec<Task>, Vec<String>), FileError> {
    let at = ["tasks".into()];
    let count = match document.get(&at).map(|value| value.get_ref()) {
        Some(DeValue::Array(list)) if !list.is_empty() => list.len(),
        _ => return Err(document.error(&at, "must be a list of one or more tables: [[tasks]]")),
    };
    let mut tasks: Vec<Task> = Vec::with_capacity(count);
    for index in 0..count {
        let task = Reader { document, index, parameters, kinds }.read(model)?;
        if tasks.iter().any(|other| other.name == task.name) {
            let at = ["tasks".into(), index.into(), "name".into()];
            return Err(document.error(&at, format!("`{}` names two tasks", task.name)));
        }
        tasks.push(task);
    }
    let warnings = tasks.iter().flat_map(|task| outside_limits(task, &parameters.initial())).collect();
    Ok((tasks, warnings))
}

/// Reads one task.
struct Reader<'a> {
    document: &'a Document<'a>,
    index: usize,
    parameters: &'a Parameters,
    kinds: &'a Kinds,
}

impl Reader<'_> {
    fn error(&self, keys: &[Place], message: impl Into<String>) -> FileError {
        let at: Vec<Place> = ["tasks".into(), self.index.into()].into_iter().chain(keys.iter().copied()).collect();
        self.document.error(&at, message)
    }

    fn read(&self, model: &dyn AnyModel) -> Result<Task, FileError> {
        let size = model.dimensions();
        let file: TaskFile = self.document.read(&["tasks".into(), self.index.into()])?;
        if file.name.is_empty() {
            return Err(self.error(&["name".into()], "must not be empty"));
        }
        let most = most_steps(size);
        if !(1..=most).contains(&file.steps) {
            let message = format!("must be from 1 to {most} with {} states; found {}", size.states, file.steps);
            return Err(self.error(&["steps".into()], message));
        }
        if !(file.information_weight >= 0.0 && file.information_weight.is_finite()) {
            let message = format!("must be a number of at least 0; found {}", file.information_weight);
            return Err(self.error(&["information_weight".into()], message));
        }
        if let Some(least) = self.parameters.least(file.time_step).filter(|&least| least <= 0.0) {
            let message = format!("must be above 0; {}", file.time_step.found(least));
            return Err(self.error(&["time_step".into()], message));
        }
        if let Some(bound) = file.bound
            && let Some(least) = self.parameters.least(bound).filter(|&least| least < 0.0)
        {
            let message = format!("must be at least 0, as every expected cost is; {}", bound.found(least));
            return Err(self.error(&["bound".into()], message));
        }
        let vocabulary = model.vocabulary();
        let quantities = &self.kinds.quantities;
        let context = Context { kinds: quantities, vocabulary: &vocabulary, parameters: self.parameters };
        let followed = followed::read((self.document, self.index), &context)?;
        let states = &vocabulary.states;
        let first = FirstState { document: self.document, index: self.index, parameters: self.parameters, model };
        let initial_state = first.read(file.initial_state)?;
        let mut noise = self.noise(file.noise, model, states)?;
        let mut costs = self.costs(&context)?;
        if file.per == Per::Second {
            noise.per_second(file.time_step);
            for (number, cost) in costs.iter_mut().enumerate() {
                cost.stage.scale(file.time_step);
                // A weight of the end that is not given is that of a stage.
                let given = |key: &'static str| {
                    let at = ["tasks".into(), self.index.into(), "costs".into(), number.into(), key.into()];
                    self.document.get(&at).is_some()
                };
                if !FINAL_WEIGHTS.into_iter().any(given) {
                    cost.last.scale(file.time_step);
                }
            }
        }
        let initial_control = match file.initial_control {
            Some(guess) => self.guess(guess, size, file.steps)?,
            None => Vec::new(),
        };
        let system = model.system((costs, followed), file.time_step, self.parameters.len());
        let control_bounds = bounds_of(&system.limits(), size.controls).filter(|_| file.enforce_effort_limits);
        if file.enforce_effort_limits && control_bounds.is_none() {
            let message = "must be false, as the model has no limits of its controls; found true";
            return Err(self.error(&["enforce_effort_limits".into()], message).with_help(NO_LIMITS));
        }
        Ok(Task {
            name: file.name,
            steps: file.steps,
            time_step: file.time_step,
            bound: file.bound,
            information_weight: file.information_weight,
            initial_state,
            initial_control,
            control_bounds,
            noise,
            system,
        })
    }

    fn guess(&self, guess: Guess, size: Dimensions, steps: usize) -> Result<Vec<Vec<Value>>, FileError> {
        let m = size.controls;
        let valid = format!("one row of {m} numbers, or {steps} such rows");
        match guess.0 {
            Rows::Flat(row) if row.len() == m => Ok(vec![row]),
            Rows::Flat(column) if m == 1 && column.len() == steps => {
                Ok(column.into_iter().map(|value| vec![value]).collect())
            }
            Rows::Flat(row) => {
                let message = format!("must be {valid}; found {} numbers", row.len());
                Err(self.error(&["initial_control".into()], message))
            }
            Rows::Named(_) => Err(self.error(&["initial_control".into()], format!("must be {valid}"))),
            Rows::Nested(rows) => {
                if let Some(row) = rows.iter().position(|row| row.len() != m) {
                    let message = format!("must be {valid}; this row has {} numbers", rows[row].len());
                    return Err(self.error(&["initial_control".into(), row.into()], message));
                }
                if rows.len() != 1 && rows.len() != steps {
                    let message = format!("must be {valid}; found {} rows", rows.len());
                    return Err(self.error(&["initial_control".into()], message));
                }
                Ok(rows)
            }
        }
    }

    fn costs(&self, context: &Context) -> Result<Vec<Cost>, FileError> {
        let at = ["tasks".into(), self.index.into(), "costs".into()];
        let count = match self.document.get(&at).map(|value| value.get_ref()) {
            Some(DeValue::Array(list)) if !list.is_empty() => list.len(),
            _ => return Err(self.error(&["costs".into()], "must be a list of one or more tables: [[tasks.costs]]")),
        };
        let kinds = cost::kinds(context.kinds);
        let read = |number: usize| {
            let at = ["tasks".into(), self.index.into(), "costs".into(), number.into()];
            let table = self.document.table_with_kind(&at, &kinds)?;
            cost::read(table, (self.document, &at), context, &self.kinds.norms)
        };
        (0..count).map(read).collect()
    }

    /// Numbers by the names of states.
    fn named(
        &self,
        keys: &[Place],
        given: &BTreeMap<String, Value>,
        states: &[String],
    ) -> Result<Vec<Value>, FileError> {
        by_name(given, states).map_err(|(key, help)| {
            let keys: Vec<Place> = keys.iter().copied().chain([Place::Key(&key)]).collect();
            let fits = if key.contains('*') { "fits" } else { "is" };
            let message = format!("no state {fits} `{key}`: there are {}", quoted(states));
            FileError { help, ..self.error(&keys, message) }
        })
    }

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
            (Rows::Nested(rows), _) => Ok(Covariance::Full(rows)),
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
        (key, deviation_key): (&'static str, &'static str),
        (rows, deviations): (Option<Rows>, Option<Rows>),
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
            (Some(_), Some(_)) => Err(wrong(&[], format!("stands in the place of `{key}`: give one of them"))),
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

    fn noise(&self, file: NoiseFile, model: &dyn AnyModel, states: &[String]) -> Result<NoiseModel, FileError> {
        let size = model.dimensions();
        let missing = |key: &'static str| self.error(&["noise".into(), key.into()], "is missing");
        let own =
            self.given(("measurement", "measurement_deviation"), (file.measurement, file.measurement_deviation), None)?;
        let measurement = match (own, model.variances()) {
            (Some(own), _) => self.equipped(own, model)?,
            (None, Some(variances)) => Covariance::Diagonal(variances),
            (None, None) => return Err(missing("measurement")),
        };
        let initial =
            self.given(("initial", "initial_deviation"), (file.initial, file.initial_deviation), Some(states))?;
        let process =
            self.given(("process", "process_deviation"), (file.process, file.process_deviation), Some(states))?;
        let file = NoiseModel {
            initial: initial.ok_or_else(|| missing("initial"))?,
            process: process.ok_or_else(|| missing("process"))?,
            measurement,
            varying: self.varying(&file.varying, model)?,
        };
        self.covariance("initial", &file.initial, size.states)?;
        self.covariance("process", &file.process, size.states)?;
        self.covariance("measurement", &file.measurement, size.measurements)?;
        let v = self.at_start(&file.measurement);
        let stride = v.stride();
        if let Err(minor) = rows::cholesky(&mut v.at(0).to_vec(), size.measurements, stride) {
            let message = format!(
                "must be positive definite, as every sensor has some noise; its leading {} x {0} part is not",
                minor + 1
            );
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
            let message = format!("must be that of the model's own measurements, {}; found {found}", equipment.own);
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
                    if let Some(j) = (0..i).find(|&j| row[j] != rows[j][i]) {
                        return error(&[i.into(), j.into()], "must be symmetric: it differs from its mirror".into());
                    }
                }
            }
            Covariance::Sequence(_) => return error(&[], "must hold at every step in a task file".into()),
        }
        if semidefinite_factor(&self.at_start(covariance), 0).is_none() {
            return error(&[], "must be positive semidefinite".into());
        }
        Ok(())
    }
}
