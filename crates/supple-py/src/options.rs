//! What is asked for, from plain Python objects.

use pyo3::prelude::*;
use supple::parameters::Scale;
use supple::simulate::Rollouts;
use supple_study::LoadedTask;
use supple_study::robustness::{DesignChoice, RobustnessOptions};
use supple_study::sweep::{Axis, SweepOptions};

use crate::errors;

/// The values of an axis, or a text such as `log:50:600:100`.
#[derive(FromPyObject)]
pub enum AxisValues {
    Text(String),
    Values(Vec<f64>),
}

impl AxisValues {
    /// The axis of a parameter.
    ///
    /// # Errors
    /// Where the parameter is unknown, the text is none of the forms, or a value is out of bounds.
    pub fn axis(self, py: Python<'_>, name: &str, task: &LoadedTask, spread: Scale) -> PyResult<Axis> {
        match self {
            Self::Text(text) => {
                let text = format!("{name}={text}");
                Axis::parse_as(&text, task, spread).map_err(|error| errors::of_study(py, &error))
            }
            Self::Values(values) => {
                let parameters = &task.problem.parameters;
                let index = parameters.index(name).map_err(|error| errors::of_compute(py, &error.into()))?;
                let unit = parameters.get(index).unit.clone();
                Ok(Axis { parameter: name.to_owned(), unit, scale: spread_of(&values), values })
            }
        }
    }
}

/// How values are spread: by ratios where all of these are equal and the differences are not.
fn spread_of(values: &[f64]) -> Scale {
    let same = |pairs: Vec<f64>| pairs.windows(2).all(|two| (two[0] - two[1]).abs() <= 1e-9 * two[0].abs());
    let pairs = || values.windows(2);
    let by_ratios = values.len() > 2
        && values.iter().all(|&value| value > 0.0)
        && same(pairs().map(|pair| pair[1] / pair[0]).collect())
        && !same(pairs().map(|pair| pair[1] - pair[0]).collect());
    if by_ratios { Scale::Log } else { Scale::Linear }
}

/// A design of a robustness study: a new name with parameter values, or a reserved name.
#[derive(FromPyObject)]
pub enum Designed {
    Named(String, Vec<(String, f64)>),
    Standing(String),
}

impl Designed {
    /// The design; its values are not checked yet.
    ///
    /// # Errors
    /// If a name is not one of the reserved ones.
    pub fn choice(self, py: Python<'_>, task: &LoadedTask) -> PyResult<DesignChoice> {
        match self {
            Self::Standing(name) => match &*name {
                "start" => Ok(DesignChoice::Start),
                "optimum" => Ok(DesignChoice::Optimum),
                _ => {
                    let message =
                        format!("`{name}` is not a design; valid: `start`, `optimum`, and designs with values");
                    Err(errors::usage(py, &message))
                }
            },
            Self::Named(name, values) => {
                let mut phi = task.phi.clone();
                for (parameter, value) in &values {
                    let set = task.problem.parameters.set(&mut phi, parameter, *value);
                    set.map_err(|error| errors::of_compute(py, &error.into()))?;
                }
                Ok(DesignChoice::Named(name, values))
            }
        }
    }
}

/// What a sweep is asked to do; `branches` are the attempts on other branches.
///
/// # Errors
/// Where an axis is wrong.
pub fn sweep(
    py: Python<'_>,
    task: &LoadedTask,
    grid: Vec<(String, AxisValues)>,
    rollouts: usize,
    starts: usize,
    branches: usize,
    seed: u64,
) -> PyResult<SweepOptions> {
    let axis = |(name, values): (String, AxisValues)| values.axis(py, &name, task, Scale::Linear);
    let axes = grid.into_iter().map(axis).collect::<PyResult<_>>()?;
    Ok(SweepOptions { axes, rollouts, starts, branches, seed })
}

/// What a study of robustness is asked to do, with the parameter that varies and its values.
///
/// # Errors
/// Where an axis or a design is wrong.
pub fn robustness(
    py: Python<'_>,
    task: &LoadedTask,
    designs: Vec<Designed>,
    name: &str,
    values: AxisValues,
    Rollouts { count: rollouts, seed }: Rollouts,
) -> PyResult<RobustnessOptions> {
    let parameter = task.problem.parameters.iter().find(|parameter| parameter.name == name);
    let spread = parameter.map_or(Scale::Linear, |parameter| parameter.scale);
    let vary = values.axis(py, name, task, spread)?;
    let designs = designs.into_iter().map(|design| design.choice(py, task)).collect::<PyResult<_>>()?;
    Ok(RobustnessOptions { designs, vary, rollouts, seed })
}
