//! Plants that Python moves, and tasks with other numbers for their contacts and couplings.

use pyo3::prelude::*;
use pyo3::types::PyTuple;
use supple::scene::LandmarkKind;
use supple::simulate::Rollouts;
use supple::{Channels, Dimensions, Error, Limited, Matrices};
use supple::{Elsewhere, Names, Other, ValueError};
use supple_study::{LoadedTask, Source};

use crate::errors;
use crate::own::{Failures, fill, read, vectors};

/// An entry of a task file's value.
#[derive(FromPyObject)]
pub enum Entry {
    Number(f64),
    /// Of a parameter, or an expression of parameters.
    Name(String),
}

impl Entry {
    fn value(&self) -> toml::Value {
        match self {
            Self::Number(number) => toml::Value::Float(*number),
            Self::Name(name) => toml::Value::String(name.clone()),
        }
    }
}

/// Plans a task and rolls it out on a plant, as [`supple::Problem::roll_out_elsewhere`]: `plant` is called with states
/// (R, n), controls (R, m) and the number of the step, and returns the next states (R, n).
///
/// # Errors
/// As those of the roll-outs.
pub fn roll_out(
    task: &LoadedTask,
    failures: &Failures,
    name: &str,
    truth: &LoadedTask,
    plant: &Py<PyAny>,
    rollouts: Rollouts,
) -> Result<Elsewhere, Error> {
    let step = |t: usize, states: &Matrices, controls: &Matrices, next: &mut Matrices| {
        let found = call(plant, failures, t, states, controls);
        fill(next, found.as_deref(), states.count(), 1, states.cols());
    };
    let other = Other { task: truth.problem.task(name)?, phi: &truth.phi, plant: &step };
    task.problem.roll_out_elsewhere(&task.phi, name, other, rollouts)
}

/// The next states of all samples; `None` if anything went wrong, now or before.
fn call(plant: &Py<PyAny>, failures: &Failures, t: usize, states: &Matrices, controls: &Matrices) -> Option<Vec<f64>> {
    if failures.any() {
        return None;
    }
    let count = states.count();
    let shape = [count, states.cols()];
    let outcome = Python::attach(|py| {
        let arrays = [vectors(states, 0, count), vectors(controls, 0, count)];
        let mut given = arrays.into_iter().map(|array| array.into_python(py)).collect::<PyResult<Vec<_>>>()?;
        given.push(t.into_pyobject(py)?.into_any());
        let found = plant.bind(py).call1(PyTuple::new(py, given)?)?;
        read("plant", &found, [&shape])
    });
    outcome.map_err(|error| failures.keep(error)).ok().map(|[numbers]| numbers)
}

/// The text of a task file as JSON. Walls that are geoms of the robot's file are given by `normal` and `point`.
///
/// # Errors
/// Where the task is not one of a file.
pub fn tables(py: Python<'_>, task: &LoadedTask) -> PyResult<String> {
    let mut table = table(py, task)?;
    let elements = table.get_mut("model").and_then(|model| model.get_mut("compliance"));
    let elements = elements.and_then(toml::Value::as_array_mut).into_iter().flatten();
    for element in elements.filter_map(toml::Value::as_table_mut).filter(|element| element.contains_key("geom")) {
        let name = element.get("name").and_then(toml::Value::as_str);
        if let Some(sides) = name.and_then(|name| wall(task, name)) {
            element.remove("geom");
            element.remove("face");
            for (key, entries) in ["normal", "point"].into_iter().zip(sides) {
                element.insert(key.to_owned(), toml::Value::Array(entries.map(toml::Value::Float).to_vec()));
            }
        }
    }
    serde_json::to_string(&table).map_err(|error| errors::usage(py, &error.to_string()))
}

/// Normal and point of a contact's wall, from which its position is measured.
fn wall(task: &LoadedTask, name: &str) -> Option<[[f64; 3]; 2]> {
    let system = &task.problem.tasks.first()?.system;
    let Dimensions { states, controls, .. } = system.dimensions();
    let seen = system.picture(&vec![0.0; states], &vec![0.0; controls], &task.phi)?;
    let mut walls = seen.picture.landmarks.iter().zip(seen.positions);
    walls.find_map(|(landmark, point)| match landmark.kind {
        LandmarkKind::Wall { normal, .. } if landmark.name == name => Some([normal, point]),
        _ => None,
    })
}

/// The same task with other numbers: one or several of an element of a list of `[model]` by the list, its name and a key, of
/// parameters, which may lie outside of their bounds, and of sub-steps.
///
/// # Errors
/// Where there is no such element, or the task with these numbers is refused.
pub fn changed(
    py: Python<'_>,
    task: &LoadedTask,
    numbers: &[(String, String, String, Vec<Entry>)],
    parameters: &[(String, f64)],
    substeps: Option<u32>,
) -> PyResult<LoadedTask> {
    let LoadedTask { phi, sources, .. } = task;
    let mut table = table(py, task)?;
    for (list, name, key, number) in numbers {
        let elements = table.get_mut("model").and_then(|model| model.get_mut(list)).and_then(toml::Value::as_array_mut);
        let mut listed = elements.into_iter().flatten();
        let named = |element: &&mut toml::Value| element.get("name").and_then(toml::Value::as_str) == Some(name);
        let found = listed.find(named).and_then(toml::Value::as_table_mut);
        let Some(found) = found else {
            return Err(errors::usage(py, &format!("[[model.{list}]] has no element named `{name}`")));
        };
        let value = match &number[..] {
            [one] => one.value(),
            several => toml::Value::Array(several.iter().map(Entry::value).collect()),
        };
        found.insert(key.clone(), value);
    }
    if let (Some(count), Some(model)) = (substeps, table.get_mut("model").and_then(toml::Value::as_table_mut)) {
        model.insert("substeps".to_owned(), toml::Value::Integer(count.into()));
    }
    for of_task in table.get_mut("tasks").and_then(toml::Value::as_array_mut).into_iter().flatten() {
        if let Some(set) = of_task.get_mut("set").and_then(toml::Value::as_table_mut) {
            // What is given counts for all tasks.
            set.retain(|name, _| parameters.iter().all(|(given, _)| given != name));
        }
    }
    let text = text(table, &task.problem.parameters.names()).map_err(|error| errors::usage(py, &error))?;
    let mut texts: Vec<Source> = sources.clone();
    texts[0].text = text;
    let mut loaded = LoadedTask::restore(&texts).map_err(|error| errors::of_study(py, &error))?;
    loaded.phi.clone_from(phi);
    for (name, value) in parameters {
        if let Some(place) = loaded.problem.parameters.names().iter().position(|known| known == name) {
            loaded.phi[place] = *value;
        }
    }
    Ok(loaded)
}

/// A task file, with its parameters in the order in which they were declared.
///
/// # Errors
/// Where a value cannot be written.
fn text(mut table: toml::Table, parameters: &[String]) -> Result<String, String> {
    let declared = table.remove("parameters");
    let mut text = toml::to_string(&table).map_err(|error| error.to_string())?;
    for name in parameters {
        let entries = declared.as_ref().and_then(|declared| declared.get(name)).and_then(toml::Value::as_table);
        let quoted = |key: &str| toml::Value::String(key.to_owned());
        text += &format!("\n[parameters.{}]\n", quoted(name));
        for (key, value) in entries.into_iter().flatten() {
            text += &format!("{} = {value}\n", quoted(key));
        }
    }
    Ok(text)
}

/// What a text in the place of a number means: the name of a parameter, or an expression of parameters.
///
/// # Errors
/// What is wrong with it.
pub fn number(task: &LoadedTask, text: &str) -> Result<f64, ValueError> {
    let names = Names::new(task.problem.parameters.names().to_vec());
    Ok(names.value(text)?.resolve(&task.phi))
}

/// Names of states, controls and measurements.
///
/// # Errors
/// Where there is no such task.
pub fn channels(task: &LoadedTask, name: &str) -> Result<Channels, Error> {
    Ok(task.problem.task(name)?.system.channels())
}

/// Limits of a task's robot: the names of the limit in reports and of the state, control or effort, and the ends.
///
/// # Errors
/// Where there is no such task.
pub fn robot_limits(task: &LoadedTask, name: &str) -> Result<Vec<(String, String, f64, f64)>, Error> {
    let system = &*task.problem.task(name)?.system;
    let channels = system.channels();
    let own = system.limits().into_iter().filter_map(|limit| {
        let channel = match limit.of {
            Limited::State(index) => channels.states.get(index),
            Limited::Control(index) => channels.controls.get(index),
        };
        channel.map(|channel| (limit.name, channel.name.clone(), limit.lower, limit.upper))
    });
    let efforts = system.followed(&task.phi).into_iter().filter(|number| number.is_of_model()).map(|number| {
        let name = number.channel.name;
        (name.clone(), name, number.limits[0], number.limits[1])
    });
    Ok(own.chain(efforts).collect())
}

fn table(py: Python<'_>, task: &LoadedTask) -> PyResult<toml::Table> {
    let wrong = || errors::usage(py, "this task was not read from a task file");
    let text = task.sources.first().ok_or_else(wrong)?;
    text.text.parse().map_err(|_| wrong())
}
