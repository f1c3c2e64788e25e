//! `initial_state` of a task.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Visitor};
use supple::Task;
use supple_model::document::{Document, Place};
use supple_model::model::{AnyModel, PoseFile, Start};
use supple_model::parameters::Parameters;
use supple_model::physics::DependentJoint;
use supple_model::quantity::Unfit;
use supple_model::{Limit, Limited, Value};
use supple_text::{FileError, degrees, digits, quoted};

use crate::rows::{Rows, given_by_name};

/// Relative tolerance on limits, for numbers that were rounded in the file.
const ROUNDING: f64 = 1e-9;
/// Upper limit on positions of a pose, m: the same as for positions in robot files.
const FURTHEST: f64 = 1e30;

/// The mean of the first state as a task file gives it.
#[derive(Debug)]
pub(super) enum InitialState {
    /// One value per state.
    List(Rows),
    /// Where the robot starts, and values of single states by name.
    Table { key: Option<String>, pose: Option<PoseFile>, given: BTreeMap<String, Value> },
}

impl<'de> Deserialize<'de> for InitialState {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct State;

        impl<'de> Visitor<'de> for State {
            type Value = InitialState;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a list of numbers, or a table of numbers by name with `key` or `pose`")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<InitialState, A::Error> {
                Rows::deserialize(de::value::SeqAccessDeserializer::new(list)).map(InitialState::List)
            }
            fn visit_map<A: MapAccess<'de>>(self, mut table: A) -> Result<InitialState, A::Error> {
                let (mut key, mut pose, mut given) = (None, None, BTreeMap::new());
                while let Some(name) = table.next_key::<String>()? {
                    match name.as_str() {
                        "key" => key = Some(table.next_value()?),
                        "pose" => pose = Some(table.next_value()?),
                        _ => {
                            given.insert(name, table.next_value()?);
                        }
                    }
                }
                Ok(InitialState::Table { key, pose, given })
            }
        }

        deserializer.deserialize_any(State)
    }
}

impl schemars::JsonSchema for InitialState {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "InitialState".into()
    }
    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let value = generator.subschema_for::<Value>();
        let pose = generator.subschema_for::<PoseFile>();
        schemars::json_schema!({
            "description": "One number per state, or a table: where the robot starts, and numbers by the names of \
                            states, with * as a wildcard",
            "anyOf": [
                { "type": "array", "items": value },
                {
                    "type": "object",
                    "properties": {
                        "key": { "type": "string", "description": "Name of a keyframe of the robot's MJCF file" },
                        "pose": pose
                    },
                    "additionalProperties": value
                }
            ]
        })
    }
}

/// What the first state of a task is read with.
pub(super) struct FirstState<'a> {
    pub document: &'a Document<'a>,
    /// Index of the task.
    pub index: usize,
    pub parameters: &'a Parameters,
    pub model: &'a dyn AnyModel,
}

impl FirstState<'_> {
    fn error(&self, keys: &[Place], message: impl Into<String>) -> FileError {
        let here = ["tasks".into(), self.index.into(), "initial_state".into()];
        let at: Vec<Place> = here.into_iter().chain(keys.iter().copied()).collect();
        self.document.error(&at, message)
    }

    /// The mean of the first state, one value per state.
    ///
    /// # Errors
    /// Where it does not fit the model.
    pub fn read(&self, file: Option<InitialState>) -> Result<Vec<Value>, FileError> {
        let states = self.model.vocabulary().states;
        let is_left_out = file.is_none();
        let found = match file {
            Some(InitialState::List(Rows::Flat(list))) if list.len() == states.len() => return Ok(list),
            Some(InitialState::List(Rows::Flat(list))) => list.len(),
            Some(InitialState::List(Rows::Nested(rows))) => rows.len(),
            Some(InitialState::List(Rows::Named(given))) => return self.table(None, None, &given),
            Some(InitialState::Table { key, pose, given }) => return self.table(key, pose, &given),
            None if self.model.starts_by_itself() => return self.table(None, None, &BTreeMap::new()),
            None => 0,
        };
        if is_left_out {
            return Err(self.error(&[], "is missing"));
        }
        Err(self.error(&[], format!("must have {} entries ({}); found {found}", states.len(), quoted(&states))))
    }

    fn table(
        &self,
        key: Option<String>,
        pose: Option<PoseFile>,
        given: &BTreeMap<String, Value>,
    ) -> Result<Vec<Value>, FileError> {
        let vocabulary = self.model.vocabulary();
        let states = &vocabulary.states;
        let asked = [("key", key.is_some()), ("pose", pose.is_some())];
        if let Some((asked, _)) = asked.into_iter().find(|(_, asked)| *asked).filter(|_| !self.model.starts_by_itself())
        {
            let message =
                format!("this model does not support `{asked}`; valid names are its states: {}", quoted(states));
            return Err(self.error(&[asked.into()], message));
        }
        if let Some(pose) = &pose
            && let Some((name, _)) =
                pose.numbers().into_iter().find(|(_, numbers)| !numbers.iter().all(|n| n.is_finite()))
        {
            return Err(self.error(&["pose".into(), name.into()], "must be finite numbers"));
        }
        if let Some(number) = pose.iter().flat_map(|pose| pose.position).find(|number| number.abs() >= FURTHEST) {
            let message = format!("must be below {FURTHEST:e} m; found {}", digits(number));
            return Err(self.error(&["pose".into(), "position".into()], message));
        }
        let given = given_by_name(given, states).map_err(|(name, help)| {
            if let Some((message, help)) = DependentJoint::message(&name, &vocabulary.dependent) {
                return self.error(&[Place::Key(&name)], message).with_help(help);
            }
            let fits = if name.contains('*') { "fits" } else { "is" };
            let message = format!("no state {fits} `{name}`; states: {}", quoted(states));
            FileError { help, ..self.error(&[Place::Key(&name)], message) }
        })?;
        let phi = self.parameters.initial();
        let known: Vec<Option<f64>> = given.iter().map(|value| value.map(|value| value.resolve(&phi))).collect();
        let start = Start { key: key.as_deref(), pose: pose.as_ref(), given: &known, phi: &phi };
        let first = self
            .model
            .first_state(&start)
            .map_err(|Unfit { place, message, help }| FileError { help, ..self.error(&place, message) })?;
        let mut x: Vec<Value> =
            given.iter().zip(first).map(|(given, first)| given.cloned().unwrap_or(Value::Number(first))).collect();
        for (state, leader) in self.model.followers() {
            if given[state].is_none() {
                x[state] = x[leader].clone();
            }
        }
        Ok(x)
    }
}

/// What to say of limits that a task does not keep at its start, at `phi`.
pub(super) fn outside_limits(task: &Task, phi: &[f64]) -> Vec<String> {
    let states = task.system.channels().states;
    let outside = |limit: Limit| {
        let Limited::State(state) = limit.of else { return None };
        let at = task.initial_state.get(state)?.resolve(phi);
        let Limit { name, lower, upper, .. } = limit;
        let within = at >= lower - ROUNDING * lower.abs() && at <= upper + ROUNDING * upper.abs();
        (!within).then(|| {
            let is_angle = states.get(state).is_some_and(|channel| channel.unit == "rad");
            let advice = degrees(at).filter(|_| is_angle).map_or_else(String::new, |advice| format!(" ({advice})"));
            let task = &task.name;
            format!("task `{task}`: the initial value of {name}, {at}, is outside its range [{lower}, {upper}]{advice}")
        })
    };
    task.system.limits().into_iter().filter_map(outside).collect()
}
