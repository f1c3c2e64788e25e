//! All plain data of a task.

use std::sync::Arc;

use serde::Deserialize;
use supple::design::DesignSettings;
use supple::lqg::ControlBounds;
use supple::noise::{Covariance, NamedVariance, NoiseModel};
use supple::parameters::{Parameter, Parameters};
use supple::plan::PlanSettings;
use supple::system::System;
use supple::{Matrices, Names, Problem, Task, Value};

/// A problem but for its systems.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Described {
    title: String,
    parameters: Vec<Parameter>,
    tasks: Vec<DescribedTask>,
    planning: PlanSettings,
    design: DesignSettings,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DescribedTask {
    name: String,
    steps: usize,
    time_step: Written,
    bound: Option<Written>,
    information_weight: f64,
    initial_state: Vec<Written>,
    /// One row for all steps, or one per step.
    initial_control: Vec<Vec<Written>>,
    /// Least and greatest value of each control; none for infinite ones.
    control_bounds: Option<[Vec<Option<f64>>; 2]>,
    initial: DescribedCovariance,
    process: DescribedCovariance,
    measurement: DescribedCovariance,
    /// What varies of the measurement's variances with the state.
    #[serde(default)]
    varying: Vec<DescribedVariance>,
    /// Why the derivatives of its model are wrong.
    #[serde(default)]
    doubtful_derivatives: Vec<String>,
}

/// A list of variances, all entries, or all entries at each step.
#[derive(Deserialize)]
#[serde(untagged)]
enum DescribedCovariance {
    Diagonal(Vec<Written>),
    Full(Vec<Vec<Written>>),
    Sequence(Vec<Vec<Vec<f64>>>),
}

/// A number as Python gives it: written out, or a text that names parameters.
#[derive(Deserialize)]
#[serde(untagged)]
enum Written {
    Number(f64),
    Text(String),
}

impl Written {
    /// # Errors
    /// What is wrong with the number called `what`.
    fn resolve(&self, what: &str, names: &Names) -> Result<Value, String> {
        match self {
            Self::Number(number) => Ok(Value::Number(*number)),
            Self::Text(text) => names.value(text).map_err(|wrong| format!("{what}: {wrong}")),
        }
    }
}

fn resolve_all(list: &[Written], what: &str, names: &Names) -> Result<Vec<Value>, String> {
    list.iter().map(|number| number.resolve(what, names)).collect()
}

fn resolve_rows(rows: &[Vec<Written>], what: &str, names: &Names) -> Result<Vec<Vec<Value>>, String> {
    rows.iter().map(|row| resolve_all(row, what, names)).collect()
}

/// [`NamedVariance`] with numbers as Python gives them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DescribedVariance {
    measurement: Vec<String>,
    state: String,
    center: Written,
    coefficient: Written,
}

impl Described {
    /// Names of the parameters.
    pub fn parameter_names(&self) -> Vec<String> {
        self.parameters.iter().map(|parameter| parameter.name.clone()).collect()
    }

    /// How many steps each task lasts.
    pub fn steps(&self) -> Vec<usize> {
        self.tasks.iter().map(|task| task.steps).collect()
    }

    /// The problem with these systems, one for each task.
    ///
    /// # Errors
    /// What is wrong with the numbers, and what is valid.
    pub fn problem(self, systems: Vec<Arc<dyn System>>) -> Result<Problem, String> {
        let Self { title, parameters, tasks, planning, design } = self;
        for parameter in &parameters {
            parameter.check().map_err(|unfit| match unfit.key() {
                "name" => unfit.message,
                key => format!("parameter `{}`: {key} {}", parameter.name, unfit.message),
            })?;
        }
        planning.check().map_err(|unfit| format!("planning: {unfit}"))?;
        design.check().map_err(|unfit| format!("design: {unfit}"))?;
        let parameters = Parameters::new(parameters);
        let names = Names::new(parameters.names());
        let tasks = tasks.into_iter().zip(systems).map(|(task, system)| task.build(system, &parameters, &names));
        let tasks: Vec<Task> = tasks.collect::<Result<_, _>>()?;
        let read: Vec<Vec<bool>> = tasks.iter().map(|task| task.system.depends_on(parameters.len())).collect();
        let is_read = |name: &str| parameters.index(name).is_ok_and(|index| read.iter().any(|read| read[index]));
        let unused = names.unused().into_iter().filter(|name| !is_read(name));
        let warnings: Vec<String> =
            unused.map(|name| format!("parameter `{name}` is declared but never used")).collect();
        let every_warning = warnings.clone();
        let problem = Problem::new(title, parameters, tasks).with_planning(planning).with_design(design);
        Ok(Problem { warnings, every_warning, ..problem })
    }
}

impl DescribedTask {
    fn build(self, system: Arc<dyn System>, parameters: &Parameters, names: &Names) -> Result<Task, String> {
        let at = |what: &str| format!("task `{}`: {what}", self.name);
        let in_task = |what: String| at(&what);
        let time_step = self.time_step.resolve("time_step", names).map_err(in_task)?;
        let bound = self.bound.map(|bound| bound.resolve("bound", names)).transpose().map_err(in_task)?;
        let bounds = self.control_bounds.map(|[lower, upper]| {
            let or = |bound: Option<f64>, infinite: f64| bound.unwrap_or(infinite);
            let pairs = lower.into_iter().zip(upper);
            pairs.map(|(lower, upper)| [or(lower, f64::NEG_INFINITY), or(upper, f64::INFINITY)]).collect::<Vec<_>>()
        });
        let mut channels = system.channels();
        // States are addressed by the system's names, whatever names are shown to people.
        channels.states.iter_mut().zip(system.state_names()).for_each(|(channel, name)| channel.name = name);
        let find = |(number, law): (usize, &DescribedVariance)| {
            let at = |wrong: &dyn std::fmt::Display| at(&format!("noise: varying[{number}].{wrong}"));
            let law = NamedVariance {
                measurement: law.measurement.clone(),
                state: law.state.clone(),
                center: law.center.resolve("center", names).map_err(|wrong| at(&wrong))?,
                coefficient: law.coefficient.resolve("coefficient", names).map_err(|wrong| at(&wrong))?,
            };
            law.find(&channels, parameters).map_err(|wrong| at(&wrong))
        };
        let varying = self.varying.iter().enumerate().map(find).collect::<Result<Vec<_>, _>>()?.concat();
        let noise = NoiseModel {
            initial: self.initial.build("initial", names).map_err(in_task)?,
            process: self.process.build("process", names).map_err(in_task)?,
            measurement: self.measurement.build("measurement", names).map_err(in_task)?,
            varying,
        };
        let task = Task::sharing(&self.name, system, noise, self.steps, time_step)
            .starting_at(resolve_all(&self.initial_state, "initial_state", names).map_err(in_task)?)
            .guessing_each(resolve_rows(&self.initial_control, "initial_control", names).map_err(in_task)?)
            .weighing_information(self.information_weight);
        let control_bounds = bounds.map(|bounds| ControlBounds::new(&bounds));
        let task = Task { bound, control_bounds, doubtful_derivatives: self.doubtful_derivatives, ..task };
        task.check(parameters).map_err(|unfit| at(&unfit.to_string()))?;
        Ok(task)
    }
}

impl DescribedCovariance {
    /// The covariance, or what is wrong with its shape.
    fn build(&self, what: &str, names: &Names) -> Result<Covariance, String> {
        let noise = || format!("noise: {what}");
        match self {
            Self::Diagonal(entries) => resolve_all(entries, &noise(), names).map(Covariance::Diagonal),
            Self::Full(rows) => resolve_rows(rows, &noise(), names).map(Covariance::full),
            Self::Sequence(matrices) => sequence(matrices, what).map(Covariance::Sequence),
        }
    }
}

/// A matrix for each step.
fn sequence(matrices: &[Vec<Vec<f64>>], what: &str) -> Result<Matrices, String> {
    let order = matrices.first().map_or(0, Vec::len);
    let mut out = Matrices::zeros(matrices.len(), order, order);
    for (t, matrix) in matrices.iter().enumerate() {
        if matrix.len() != order || matrix.iter().any(|row| row.len() != order) {
            return Err(format!("the {what} covariance of step {t} must be {order} x {order}, as that of step 0"));
        }
        for (i, row) in matrix.iter().enumerate() {
            for (j, &entry) in row.iter().enumerate() {
                out.set(t, i, j, entry);
            }
        }
    }
    Ok(out)
}
