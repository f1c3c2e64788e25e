//! Models that Python wrote down as tapes: no Python is called after this.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use supple::system::{Authored, System};
use supple::{ParameterHandle, Recorded, Value};

use super::context::{Context, field};
use crate::errors;

/// The system of `{"kind": "recorded", "model": JSON of a supple::Recorded, "time_step": a number or a parameter's
/// name}`.
///
/// # Errors
/// Where the model is not valid, or does not have the parameters of its problem.
pub fn system(description: &Bound<'_, PyDict>, context: &Context<'_>) -> PyResult<Arc<dyn System>> {
    let wrong = |message: String| errors::usage(description.py(), &message);
    let text: String = field(description, "model")?.extract()?;
    let model: Recorded =
        serde_json::from_str(&text).map_err(|error| wrong(format!("the tapes of the model: {error}")))?;
    let (found, expected) = (model.parts().parameters, context.parameters.len());
    if found != expected {
        return Err(wrong(format!("the tapes of the model have {found} parameters, the problem has {expected}")));
    }
    let time_step = value(&field(description, "time_step")?, context)?;
    Ok(Arc::new(Authored::new(model, Vec::new(), time_step, expected)))
}

/// A number, or the name of a parameter.
fn value(given: &Bound<'_, PyAny>, context: &Context<'_>) -> PyResult<Value> {
    let Ok(name) = given.extract::<String>() else { return Ok(Value::Number(given.extract()?)) };
    let place = context.parameters.iter().position(|parameter| *parameter == name);
    place.map(|place| ParameterHandle::at(place).into()).ok_or_else(|| {
        let valid = context.parameters.join(", ");
        errors::usage(given.py(), &format!("time_step: no parameter `{name}`; there are: {valid}"))
    })
}
