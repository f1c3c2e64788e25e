//! Linear problems from arrays.

use std::sync::Arc;

use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use supple::system::{Arrays, Sequence, System};
use supple::{Channel, Channels, Matrices};

use super::context::{Context, field};
use crate::errors;

/// The system of a description: arrays of float64 by the names of [`Arrays`], those that are left out being `None`, and
/// `states`, `controls` and `measurements` as lists of names and units.
///
/// A matrix with one axis fewer than a list of them has holds at every step.
///
/// # Errors
/// Where an array is missing or of a wrong shape.
pub fn system(description: &Bound<'_, PyDict>, context: &Context<'_>) -> PyResult<Arc<dyn System>> {
    let py = description.py();
    let matrix = |name| field(description, name).and_then(|array| matrices(name, &array, 2));
    let optional = |name, axes| {
        let array = field(description, name)?;
        if array.is_none() { Ok(None) } else { matrices(name, &array, axes).map(Some) }
    };
    let channels = |key| -> PyResult<Vec<Channel>> {
        let list: Vec<(String, String)> = field(description, key)?.extract()?;
        Ok(list.iter().map(|(name, unit)| Channel::new(name, unit)).collect())
    };
    let arrays = Arrays {
        A: matrix("A")?,
        B: matrix("B")?,
        C: matrix("C")?,
        c: optional("c", 1)?,
        d: optional("d", 1)?,
        Q: matrix("Q")?,
        S: optional("S", 2)?,
        R: matrix("R")?,
        q: optional("q", 1)?,
        r: optional("r", 1)?,
        QN: optional("QN", 2)?,
        qN: optional("qN", 1)?,
    };
    let channels = Channels {
        states: channels("states")?,
        controls: channels("controls")?,
        measurements: channels("measurements")?,
    };
    let system = Sequence::new(context.steps, &arrays).and_then(|system| system.with_channels(channels));
    Ok(Arc::new(system.map_err(|error| errors::of_compute(py, &error.into()))?))
}

/// Checks an array of one covariance, or of one for each step, which errors call `name`: symmetric up to rounding, and
/// positive semidefinite, or definite.
#[pyfunction]
pub fn check_covariance(name: &str, array: &Bound<'_, PyAny>, definite: bool) -> PyResult<()> {
    let found = matrices(name, array, 2)?;
    supple::noise::check_matrices(&found, definite).map_err(|mut unfit| {
        if found.is_constant() {
            unfit.place.remove(0);
        }
        let colon = if unfit.place.is_empty() { ": " } else { "" };
        errors::usage(array.py(), &format!("{name}{colon}{unfit}"))
    })
}

/// An array of `axes` axes as one that is the same at every step, or of one axis more as one for each step.
fn matrices(name: &str, array: &Bound<'_, PyAny>, axes: usize) -> PyResult<Matrices> {
    let wrong = |found: &str| {
        let message = format!("`{name}` {found}; expected a float64 array with {axes} or {} axes", axes + 1);
        errors::usage(array.py(), &message)
    };
    let array: PyReadonlyArrayDyn<'_, f64> = array.extract().map_err(|_| wrong("is not a float64 array"))?;
    let shape = array.shape().to_vec();
    let (each, count) = match shape.len().checked_sub(axes) {
        Some(0) => (&shape[..], None),
        Some(1) => (&shape[1..], Some(shape[0])),
        _ => return Err(wrong(&format!("has the shape {shape:?}"))),
    };
    let &[rows, cols] = (if axes == 1 { &[1, each[0]] } else { &[each[0], each[1]] }) as &[usize; 2];
    let mut out = count.map_or_else(|| Matrices::constant(rows, cols), |count| Matrices::zeros(count, rows, cols));
    if rows * cols > 0 {
        for (index, &entry) in array.as_array().iter().enumerate() {
            let (row, col) = (index / cols, index % cols);
            out.set(row / rows, row % rows, col, entry);
        }
    }
    Ok(out)
}
