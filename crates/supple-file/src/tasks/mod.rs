mod noise;
mod reader;

use std::collections::BTreeMap;

use serde::de::{Error, IgnoredAny, Unexpected, Visitor};
use serde::{Deserialize, Deserializer};
use supple::Task;
use supple::plan::{PlanMode, bounds_of};
use supple_lqg::{ControlBounds, Dimensions};
use supple_model::Value;
use supple_model::cost::{self, Cost};
use supple_model::document::{Content, Document, Place, Spanned};
use supple_model::followed::Followed;
use supple_model::model::{AnyModel, Kinds};
use supple_model::noise::NoiseModel;
use supple_model::parameters::{Named, Parameter, Parameters, Role};
use supple_model::quantity::Context;
use supple_text::{FileError, digits, nearest, quoted, significant};

use crate::first_state::{FirstState, InitialState, outside_limits};
use crate::followed;
use crate::rows::{Guess, Rows};
use crate::targets::out_of_reach;
use noise::NoiseFile;
use reader::Reader;

/// Reads a count of at least 1. 0 is refused later, when the maximum is known.
fn count<'de, D: Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
    struct Count;

    impl Visitor<'_> for Count {
        type Value = usize;

        fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
            f.write_str("a whole number of at least 1")
        }
        fn visit_i64<E: Error>(self, number: i64) -> Result<usize, E> {
            usize::try_from(number).map_err(|_| E::invalid_value(Unexpected::Signed(number), &self))
        }
    }

    deserializer.deserialize_i64(Count)
}

/// One of `[[tasks]]`. Its costs are read by kind.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct TaskFile {
    /// Its name, unlike that of any other task.
    name: String,
    /// Number of steps, from 1 to 1,000,000; fewer for models with many states.
    #[schemars(range(min = 1, max = 1_000_000))]
    #[serde(deserialize_with = "count")]
    steps: usize,
    /// Time step, s.
    time_step: Value,
    /// The expected cost may be at most this. Without it there is no limit.
    bound: Option<Value>,
    /// Weight of its information in the objective; default: 1.
    #[serde(default = "one")]
    information_weight: f64,
    /// Mean of the initial state: one number per state, or a table by name. Omitted joints of robots rest at 0, or at
    /// the middle of their range if it excludes 0; omitted states of other models are 0.
    initial_state: Option<InitialState>,
    /// Initial guess of the controls: one row for all steps, or one row per step; default: controls that hold the
    /// initial state, such as torques that support the robot's weight.
    initial_control: Option<Guess>,
    /// Whether plans keep the limits that the model has of its controls and drives: a robot's are the efforts of its
    /// joints, and the ranges of the actuators of its file.
    #[serde(default)]
    enforce_effort_limits: bool,
    /// Whether process noise, measurement noise and stage weights are per step or per second. Those per second do not
    /// depend on the time step: in each step, process variances and stage weights are multiplied by the time
    /// step, and measurement variances, including those of sensors, are divided by it.
    #[serde(default)]
    per: Per,
    /// Numbers of parameters with role = "study" in this task alone, in place of their values: other payloads, walls, users.
    #[serde(default)]
    #[allow(dead_code)]
    set: BTreeMap<String, f64>,
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

/// Whether noise and weights are given per step or per second.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Per {
    /// One time step.
    #[default]
    Step,
    /// One second.
    Second,
}

/// The table that a key of a task or of its noise belongs to.
fn table_of(key: &str) -> Option<&'static str> {
    let has = |schema: schemars::Schema| schema.get("properties").is_some_and(|keys| keys.get(key).is_some());
    let tables = [("[[tasks]]", schemars::schema_for!(TaskFile)), ("[tasks.noise]", schemars::schema_for!(NoiseFile))];
    tables.into_iter().find_map(|(name, schema)| has(schema).then_some(name))
}

/// An error about a name in a table of numbers by name; it may be a key of the task that was written below the table's
/// header.
fn misplaced(error: FileError, index: usize, states: &[String]) -> FileError {
    let here = format!("tasks[{index}].");
    let found = error.key.strip_prefix(&here).and_then(|key| key.rsplit_once('.')).and_then(|(table, key)| {
        let by_name = table == "initial_state" || table.starts_with("noise.") && !table.contains('[');
        let of = table_of(key).filter(|_| by_name && !states.iter().any(|state| state == key))?;
        Some(format!("`{key}` is a key of {of}: write it there, above the headers of the tables in it"))
    });
    match found {
        Some(message) => FileError { message, help: None, ..error },
        None => error,
    }
}

/// Time step of a robot from which it is probably in milliseconds, s.
const SLOW: f64 = 1.0;

/// Keys of costs by which weights of the end are given.
const FINAL_WEIGHTS: [&str; 2] = ["final_weight", "final"];

/// Where limits of controls come from.
const NO_LIMITS: &str =
    "limits require effort limits of driven joints whose gears are numbers, or actuator ranges, in the robot file";

/// Adds to the noise what sensors recall of the last step: nothing at first; then the process noise of the states whose
/// rates they measure, over the time step (theory, equation R.28).
fn recall(noise: &mut NoiseModel, model: &dyn AnyModel, time_step: &Value) {
    let recalled = model.recalled();
    if recalled.is_empty() {
        return;
    }
    let none = |_: usize| Vec::new();
    noise.initial.extend(recalled.len(), none);
    noise.process.extend(recalled.len(), |index| {
        recalled[index].rate_of.map(|state| (state, Value::Number(1.0).over(time_step))).into_iter().collect()
    });
}

/// Whether the limit at a place is one of controls by numbers.
fn is_box(document: &Document, limit: &[Place]) -> bool {
    let get = |key: &'static str| {
        let at: Vec<Place> = limit.iter().copied().chain([key.into()]).collect();
        document.get(&at).map(Spanned::get_ref)
    };
    let is_text = |value: &Content| match value {
        Content::List(list) => list.iter().any(|entry| matches!(entry.get_ref(), Content::Text(_))),
        value => matches!(value, Content::Text(_)),
    };
    let is_named = matches!(get("kind"), Some(Content::Text(kind)) if kind == "control");
    is_named && !["lower", "upper"].into_iter().filter_map(get).any(is_text)
}

/// Checks that plans of this kind can keep all limits that tasks enforce.
pub(super) fn check_enforced(document: &Document, plan: PlanMode) -> Result<(), FileError> {
    let is_set = |at: &[Place]| matches!(document.get(at).map(Spanned::get_ref), Some(Content::Boolean(true)));
    let refuse = |at: &[Place], what: &str| {
        let message = format!("must be false with plan = \"{plan}\", which does not support {what}; found true");
        Err(document.error(at, message).with_help("use plan = \"nominal\" in [planning], or leave this key out"))
    };
    for task in 0..document.tables(&["tasks".into()])? {
        let limits = ["tasks".into(), task.into(), "limits".into()];
        for limit in 0..document.tables(&limits)? {
            let at: Vec<Place> = limits.into_iter().chain([limit.into(), "enforce".into()]).collect();
            let limit = &at[..at.len() - 1];
            let is_kept = plan.keeps_limits() || plan.keeps_control_limits() && is_box(document, limit);
            if !is_kept && is_set(&at) {
                return refuse(&at, "enforced limits");
            }
        }
        let at = ["tasks".into(), task.into(), "enforce_effort_limits".into()];
        if !plan.keeps_control_limits() && is_set(&at) {
            return refuse(&at, "control limits");
        }
    }
    Ok(())
}

/// A task's own reading of the file, in which some parameters stand for numbers.
pub(super) struct Variant<'a> {
    pub document: Document<'a>,
    pub model: Box<dyn AnyModel>,
    /// The parameters that are set.
    pub set: Named,
}

/// An error that only a task with these parameters has.
pub(super) fn of_set(error: FileError, set: &Named) -> FileError {
    let set: Vec<String> = set.0.iter().map(|(name, number)| format!("{name} = {}", digits(*number))).collect();
    FileError { message: format!("{} (in a task with {})", error.message, set.join(", ")), ..error }
}

/// The parameters that each task sets, `[tasks.set]`, in the order of declaration.
pub(super) fn sets(document: &Document, parameters: &Parameters) -> Result<Vec<Named>, FileError> {
    let at = ["tasks".into()];
    let count = match document.get(&at).map(|value| value.get_ref()) {
        Some(Content::List(list)) if !list.is_empty() => list.len(),
        _ => return Err(document.error(&at, "must be a list of one or more tables: [[tasks]]")),
    };
    let of_task = |index: usize| {
        let at = ["tasks".into(), index.into(), "set".into()];
        if document.get(&at).is_none() {
            return Ok(Named::default());
        }
        let given: BTreeMap<String, f64> = document.read(&at)?;
        for (name, &number) in &given {
            let here = [at[0], at[1], at[2], Place::Key(name)];
            let study = || parameters.iter().filter(|parameter| parameter.role == Role::Study);
            let valid: Vec<&str> = study().map(|parameter| parameter.name.as_str()).collect();
            let Some(parameter) = parameters.iter().find(|parameter| parameter.name == *name) else {
                let message =
                    format!("no parameter is named `{name}`; those with role = \"study\": {}", quoted(&valid));
                return Err(FileError { help: nearest(name, &valid), ..document.error_at_key(&here, message) });
            };
            if parameter.role != Role::Study {
                let message =
                    format!("`{name}` is shared by all tasks: a task may only set parameters with role = \"study\"");
                return Err(document
                    .error_at_key(&here, message)
                    .with_help("give it that role, or a number in each task's costs"));
            }
            let [lower, upper] = parameter.bounds;
            if !(lower..=upper).contains(&number) {
                let [lower, upper, found] = [lower, upper, number].map(digits);
                return Err(document
                    .error(&here, format!("must be within the bounds [{lower}, {upper}] of `{name}`; found {found}")));
            }
        }
        let set = |parameter: &Parameter| Some((parameter.name.clone(), *given.get(&parameter.name)?));
        Ok(Named(parameters.iter().filter_map(set).collect()))
    };
    (0..count).map(of_task).collect()
}

/// Reads `[[tasks]]`, given the file with its model, and the variants of tasks that set parameters.
///
/// Also what looks like a mistake.
pub(super) fn read(
    (document, model): (&Document, &dyn AnyModel),
    variants: &[Option<Variant>],
    parameters: &Parameters,
    kinds: &Kinds,
) -> Result<(Vec<Task>, Vec<String>), FileError> {
    let mut tasks: Vec<Task> = Vec::with_capacity(variants.len());
    let mut doubts = Vec::new();
    for (index, variant) in variants.iter().enumerate() {
        let own = variant.as_ref().map(|variant| (&variant.document, &*variant.model));
        let (document, model) = own.unwrap_or((document, model));
        let read = Reader { document, index, parameters, kinds }.read(model);
        let (task, doubtful) = read.map_err(|error| misplaced(error, index, &model.vocabulary().states))?;
        let task = Task { set: variant.as_ref().map(|variant| variant.set.clone()).unwrap_or_default(), ..task };
        if tasks.iter().any(|other| other.name == task.name) {
            let at = ["tasks".into(), index.into(), "name".into()];
            return Err(document.error(&at, format!("`{}` names two tasks", task.name)));
        }
        tasks.push(task);
        doubts.extend(doubtful);
    }
    let mut warnings: Vec<String> = tasks.iter().flat_map(|task| outside_limits(task, &parameters.initial())).collect();
    warnings.extend(doubts);
    if model.starts_by_itself() {
        let steps = tasks.iter().map(|task| (&task.name, task.time_step.resolve::<f64>(&parameters.initial())));
        warnings.extend(steps.filter(|(_, time_step)| *time_step >= SLOW).map(|(name, time_step)| {
            let (found, right) = (digits(time_step), digits(significant(1e-3 * time_step, 6)));
            format!(
                "task `{name}`: `time_step` is {found} s, which is long for a robot (times are in s: {found} ms are {right})"
            )
        }));
    }
    Ok((tasks, warnings))
}

impl Reader<'_> {
    /// The task, and what to say of its numbers.
    fn read(&self, model: &dyn AnyModel) -> Result<(Task, Vec<String>), FileError> {
        let size = model.dimensions();
        let file: TaskFile = self.document.read(&["tasks".into(), self.index.into()])?;
        if file.name.is_empty() {
            return Err(self.error(&["name".into()], "must not be empty"));
        }
        let vocabulary = model.vocabulary();
        let quantities = &self.kinds.quantities;
        let context = Context { kinds: quantities, vocabulary: &vocabulary, parameters: self.parameters };
        let mut followed = followed::read(self.document, self.index, &context)?;
        let of_model = if file.enforce_effort_limits { model.limits() } else { Vec::new() };
        let mut without = followed.clone();
        let boxed: Vec<_> = without.iter_mut().flat_map(Followed::take_control_bounds).collect();
        let mut control_bounds = bounds_of(of_model.iter().chain(&boxed), size.controls);
        // Bounds that exclude one another remain limits: the plan then reports which of them it exceeds.
        match control_bounds.as_ref().is_none_or(ControlBounds::can_be_kept) {
            true => followed = without,
            false => control_bounds = bounds_of(&of_model, size.controls),
        }
        let efforts = Followed::efforts(&vocabulary).map_err(|unfit| self.error(&[], unfit.to_string()))?;
        let efforts = efforts.map(|efforts| Followed { enforced: file.enforce_effort_limits, ..efforts });
        let limits_efforts = efforts.is_some();
        followed.extend(efforts);
        let states = &vocabulary.states;
        let first = FirstState { document: self.document, index: self.index, parameters: self.parameters, model };
        let mut initial_state = first.read(file.initial_state)?;
        // Nothing happened before the first step.
        initial_state.resize(size.states, Value::Number(0.0));
        let mut noise = self.noise(file.noise, model, states, file.steps)?;
        let mut costs = self.costs(&context)?;
        if file.per == Per::Second {
            noise.per_second(&file.time_step);
            for (number, cost) in costs.iter_mut().enumerate() {
                cost.stage.scale(&file.time_step);
                // A final weight that is not given equals the stage weight.
                let given = |key: &'static str| {
                    let at = ["tasks".into(), self.index.into(), "costs".into(), number.into(), key.into()];
                    self.document.get(&at).is_some()
                };
                if !FINAL_WEIGHTS.into_iter().any(given) {
                    cost.last.scale(&file.time_step);
                }
            }
        }
        recall(&mut noise, model, &file.time_step);
        let initial_control = match file.initial_control {
            Some(guess) => self.guess(guess, size, file.steps)?,
            None => Vec::new(),
        };
        let system = model.system(costs.clone(), followed.clone(), file.time_step.clone(), self.parameters.len());
        if file.enforce_effort_limits && bounds_of(&of_model, size.controls).is_none() && !limits_efforts {
            let message = "must be false: the model has no control limits; found true";
            return Err(self.error(&["enforce_effort_limits".into()], message).with_help(NO_LIMITS));
        }
        let task = Task::sharing(file.name, system, noise, file.steps, file.time_step)
            .starting_at(initial_state)
            .guessing_each(initial_control)
            .weighing_information(file.information_weight);
        let task = Task { bound: file.bound, control_bounds, doubts: model.doubts(), ..task };
        task.check(self.parameters).map_err(|unfit| self.unfit(unfit))?;
        let doubts = out_of_reach(&task, &costs, &followed, &self.parameters.initial());
        Ok((task, doubts))
    }

    /// The rows of a first guess, whose lengths are checked with the task: one row, or one for each step; of one control,
    /// also one number for each step.
    fn guess(&self, guess: Guess, size: Dimensions, steps: usize) -> Result<Vec<Vec<Value>>, FileError> {
        match guess.0 {
            Rows::Flat(column) if size.controls == 1 && column.len() == steps => {
                Ok(column.into_iter().map(|value| vec![value]).collect())
            }
            Rows::Flat(row) => Ok(vec![row]),
            Rows::Nested(rows) => Ok(rows),
            Rows::Named(_) => {
                Err(self.error(&["initial_control".into()], "must be a list of numbers, or of such lists"))
            }
        }
    }

    fn costs(&self, context: &Context) -> Result<Vec<Cost>, FileError> {
        let at = ["tasks".into(), self.index.into(), "costs".into()];
        let count = match self.document.get(&at).map(|value| value.get_ref()) {
            Some(Content::List(list)) if !list.is_empty() => list.len(),
            _ => return Err(self.error(&["costs".into()], "must be a list of one or more tables: [[tasks.costs]]")),
        };
        let kinds = cost::kinds(context.kinds);
        let read = |number: usize| {
            let at = ["tasks".into(), self.index.into(), "costs".into(), number.into()];
            let (kind, table) = self.document.table_with_kind(&at, &kinds)?;
            cost::read(kind, table, self.document.spot(&at), context, &self.kinds.norms)
        };
        (0..count).map(read).collect()
    }
}
