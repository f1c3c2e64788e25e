//! What a page can adjust: parameters, cost limits, and noise levels.

use serde::Serialize;
use supple::noise::Covariance;
use supple::parameters::{Role, Scale};
use supple::{Problem, Task, Value};
use supple_study::LoadedTask;
use supple_text::{digits, printed_unit};

/// Up to this many measured numbers, each has a slider of its own for its noise.
const MOST_CHANNELS: usize = 6;
/// Magnitudes of noise go from a tenth to ten times what the file says.
const NOISE_RANGE: [f64; 2] = [0.1, 10.0];
/// Limits go from a quarter to four times what the file says.
const LIMIT_RANGE: [f64; 2] = [0.25, 4.0];

/// A number that a page can change.
#[derive(Clone, Debug, Serialize)]
pub struct Knob {
    /// Its name.
    pub name: String,
    /// The heading below which it stands.
    pub group: &'static str,
    /// What it is, for people.
    pub about: String,
    /// Its unit, as it is printed; `×` of factors.
    pub unit: String,
    /// How its slider moves.
    pub scale: Scale,
    /// Ends of its slider.
    pub bounds: [f64; 2],
    /// Whether values beyond the ends can be typed.
    pub open: bool,
    /// The value to begin with.
    pub start: f64,
    /// Whether searches change it.
    pub designed: bool,
    /// What it changes.
    #[serde(skip)]
    target: Target,
}

/// What a knob changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Target {
    /// The parameter with this index.
    Parameter(usize),
    /// The limit of this task.
    Limit(usize),
    /// Standard deviations of a covariance of this task: of all its numbers, or of one.
    Noise(usize, Kind, Option<usize>),
}

/// A covariance of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Of the first state.
    Initial,
    /// Of the process.
    Process,
    /// Of the measurement.
    Measurement,
}

/// Noise that was changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseFactor<'a> {
    /// The name of its knob.
    pub name: &'a str,
    /// The task's place in the file.
    pub task: usize,
    /// Which of its covariances.
    pub kind: Kind,
    /// The entry of a diagonal that it is about; all numbers where there is none.
    pub one: Option<usize>,
    /// Factor on standard deviations.
    pub factor: f64,
}

/// All knobs of a task file, with its design as it was set.
pub fn knobs(loaded: &LoadedTask) -> Vec<Knob> {
    let LoadedTask { problem, phi, .. } = loaded;
    let parameters = problem.parameters.iter().zip(phi).enumerate().map(|(index, (parameter, &start))| Knob {
        name: parameter.name.clone(),
        group: if parameter.role == Role::Design { "Design parameters" } else { "Other parameters" },
        about: String::new(),
        unit: printed_unit(&parameter.unit),
        scale: parameter.scale,
        bounds: parameter.bounds,
        open: false,
        start,
        designed: parameter.role == Role::Design,
        target: Target::Parameter(index),
    });
    let several = problem.tasks.len() > 1;
    let tasks = || problem.tasks.iter().enumerate();
    let limits = tasks().filter_map(|(index, task)| limit(index, task, several));
    let noises = tasks().flat_map(|(index, task)| noises(index, task, several));
    parameters.chain(limits).chain(noises).collect()
}

/// A limit that is a number; one that is a parameter has a knob as such.
fn limit(index: usize, task: &Task, several: bool) -> Option<Knob> {
    let Some(Value::Number(start)) = task.bound else { return None };
    let (scale, bounds) = if start > 0.0 {
        (Scale::Log, LIMIT_RANGE.map(|factor| factor * start))
    } else {
        let size = 1.0 + 2.0 * start.abs();
        (Scale::Linear, [start - size, start + size])
    };
    Some(Knob {
        name: if several { format!("limit of {}", task.name) } else { "cost limit".to_owned() },
        group: "Cost limits",
        about: "Limit on the expected cost.".to_owned(),
        unit: String::new(),
        scale,
        bounds,
        open: true,
        start,
        designed: false,
        target: Target::Limit(index),
    })
}

fn noises(index: usize, task: &Task, several: bool) -> Vec<Knob> {
    let of = |text: &str| if several { format!("{text}, {}", task.name) } else { text.to_owned() };
    let knob = |name: &str, kind: Kind, one: Option<usize>| Knob {
        name: of(name),
        group: "Noise",
        about: "Factor on standard deviations that are numbers in the task file; parameters have their own sliders."
            .to_owned(),
        unit: "×".to_owned(),
        scale: Scale::Log,
        bounds: NOISE_RANGE,
        open: false,
        start: 1.0,
        designed: false,
        target: Target::Noise(index, kind, one),
    };
    let mut list = Vec::new();
    for (name, kind) in [("initial uncertainty", Kind::Initial), ("process noise", Kind::Process)] {
        if (0..covariance(task, kind).order()).any(|entry| has_number(covariance(task, kind), entry)) {
            list.push(knob(name, kind, None));
        }
    }
    let measurement = &task.noise.measurement;
    let numbers: Vec<usize> = (0..measurement.order()).filter(|&entry| has_number(measurement, entry)).collect();
    if !matches!(measurement, Covariance::Diagonal(_)) || numbers.len() > MOST_CHANNELS {
        list.push(knob("sensor noise", Kind::Measurement, None));
    } else {
        let channels = task.system.channels().measurements;
        for entry in numbers {
            let name = channels.get(entry).map_or_else(|| format!("y{}", entry + 1), |channel| channel.name.clone());
            list.push(knob(&format!("noise of {name}"), Kind::Measurement, Some(entry)));
        }
    }
    list
}

/// A covariance of a task, by its kind.
pub fn covariance(task: &Task, kind: Kind) -> &Covariance {
    match kind {
        Kind::Initial => &task.noise.initial,
        Kind::Process => &task.noise.process,
        Kind::Measurement => &task.noise.measurement,
    }
}

/// Whether an entry of the diagonal has a number above 0.
fn has_number(covariance: &Covariance, entry: usize) -> bool {
    let positive = |value: &Value| matches!(value, Value::Number(number) if *number > 0.0);
    match covariance {
        Covariance::Diagonal(values) => values.get(entry).is_some_and(positive),
        Covariance::Full(rows) => rows.get(entry).and_then(|row| row.get(entry)).is_some_and(positive),
        Covariance::Sequence(matrices) => (0..matrices.count()).any(|step| matrices.get(step, entry, entry) > 0.0),
    }
}

/// Standard deviations times a factor: of all entries that are numbers, or of one entry of a diagonal.
fn scaled(covariance: &mut Covariance, factor: f64, one: Option<usize>) {
    let square = factor * factor;
    let scale = |value: &mut Value| {
        if let Value::Number(number) = value {
            *number *= square;
        }
    };
    match covariance {
        Covariance::Diagonal(values) => {
            let wanted = |entry: usize| one.is_none_or(|one| one == entry);
            values.iter_mut().enumerate().filter(|(entry, _)| wanted(*entry)).for_each(|(_, value)| scale(value));
        }
        Covariance::Full(rows) => rows.iter_mut().flatten().for_each(scale),
        Covariance::Sequence(matrices) => matrices.as_mut_slice().iter_mut().for_each(|entry| *entry *= square),
    }
}

/// What values of all knobs mean.
pub struct Turned {
    /// The problem, with its limits and noise as they are turned.
    pub problem: Problem,
    /// All parameters.
    pub phi: Vec<f64>,
}

/// The problem and parameters that values of all knobs mean.
///
/// # Errors
/// Where there are too few or too many values, or one is not valid.
pub fn turned(loaded: &LoadedTask, knobs: &[Knob], values: &[f64]) -> Result<Turned, String> {
    if values.len() != knobs.len() {
        return Err(format!("there are {} sliders; found {} values", knobs.len(), values.len()));
    }
    let (mut problem, mut phi) = (loaded.problem.clone(), loaded.phi.clone());
    for (knob, &value) in knobs.iter().zip(values) {
        let [lower, upper] = knob.bounds;
        if !value.is_finite() || !knob.open && !(lower..=upper).contains(&value) {
            let [lower, upper, value] = [lower, upper, value].map(digits);
            return Err(format!("`{}` must be from {lower} to {upper}; found {value}", knob.name));
        }
        if value == knob.start && !matches!(knob.target, Target::Parameter(_)) {
            continue;
        }
        match knob.target {
            Target::Parameter(index) => phi[index] = value,
            Target::Limit(task) => problem.tasks[task].bound = Some(Value::Number(value)),
            Target::Noise(task, kind, one) => {
                let noise = &mut problem.tasks[task].noise;
                let covariance = match kind {
                    Kind::Initial => &mut noise.initial,
                    Kind::Process => &mut noise.process,
                    Kind::Measurement => &mut noise.measurement,
                };
                scaled(covariance, value, one);
            }
        }
    }
    Ok(Turned { problem, phi })
}

/// What differs from the task file.
#[derive(Default)]
pub struct Changes<'a> {
    /// Parameters that are not at their initial value.
    pub parameters: Vec<(&'a str, f64)>,
    /// Limits: the name of the knob, the task's place in the file, the limit.
    pub limits: Vec<(&'a str, usize, f64)>,
    /// Factors of noise that are not 1.
    pub noise: Vec<NoiseFactor<'a>>,
}

/// What differs from the task file at values of all knobs.
pub fn changes<'a>(problem: &Problem, knobs: &'a [Knob], values: &[f64]) -> Changes<'a> {
    let mut changes = Changes::default();
    for (knob, &value) in knobs.iter().zip(values) {
        match knob.target {
            Target::Parameter(index) if value != problem.parameters.get(index).initial => {
                changes.parameters.push((&knob.name, value));
            }
            Target::Limit(task) if value != knob.start => changes.limits.push((&knob.name, task, value)),
            Target::Noise(task, kind, one) if value != knob.start => {
                changes.noise.push(NoiseFactor { name: &knob.name, task, kind, one, factor: value });
            }
            _ => {}
        }
    }
    changes
}

/// The values of all knobs at other parameters, the rest as it was.
pub fn with_parameters(knobs: &[Knob], values: &[f64], phi: &[f64]) -> Vec<f64> {
    let value = |(knob, &value): (&Knob, &f64)| match knob.target {
        Target::Parameter(index) => phi.get(index).copied().unwrap_or(value),
        _ => value,
    };
    knobs.iter().zip(values).map(value).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::path::Path;

    use super::*;
    use crate::curves::quantities;

    #[test]
    fn units_of_all_shipped_tasks_are_shown_as_figures_print_them() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks");
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let mut seen = std::collections::BTreeSet::new();
        for file in files.filter(|path| path.extension().is_some_and(|ending| ending == "toml")) {
            let loaded = LoadedTask::load(&file).unwrap();
            seen.extend(knobs(&loaded).into_iter().map(|knob| knob.unit));
            for task in &loaded.problem.tasks {
                seen.extend(quantities(task, &loaded.phi).into_iter().map(|quantity| quantity.unit));
            }
        }
        let wrong: Vec<&String> = seen.iter().filter(|unit| unit.contains(['^', '*', ' '])).collect();
        assert!(wrong.is_empty(), "{wrong:?} of {seen:?}");
        assert!(["m²/s²", "N·m", "N·m/rad", "(N·m)²", "×"].iter().all(|unit| seen.contains(*unit)), "{seen:?}");
    }
}
