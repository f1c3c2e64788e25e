//! Arrays on their way to a backend and back.

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use supple::Matrices;

use crate::errors;

/// An array on its way to Python: its numbers, and the lengths of its axes.
pub struct Given(pub Vec<f64>, pub Vec<usize>);

/// Arguments of a method of the backend.
pub enum Argument {
    Array(Given),
    /// Two arrays as a tuple.
    Pair(Given, Given),
    Nothing,
}

impl Given {
    fn to_python<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyArray1::from_slice(py, &self.0).reshape(self.1.clone())?.into_any())
    }
}

impl Argument {
    pub fn into_python(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        match self {
            Self::Array(array) => array.to_python(py),
            Self::Pair(first, second) => {
                Ok(PyTuple::new(py, [first.to_python(py)?, second.to_python(py)?])?.into_any())
            }
            Self::Nothing => Ok(py.None().into_bound(py)),
        }
    }
}

/// Vectors `first` to `first + count`, without padding: (count, length).
pub fn vectors(of: &Matrices, first: usize, count: usize) -> Argument {
    let numbers = (first..first + count).flat_map(|index| of.vector(index)).copied().collect();
    Argument::Array(Given(numbers, vec![count, of.cols()]))
}

/// The left upper parts, `rows` x `cols`, of matrices `first` to `first + count`: (count, rows, cols).
pub fn matrices(of: &Matrices, first: usize, count: usize, rows: usize, cols: usize) -> Given {
    let mut numbers = Vec::with_capacity(count * rows * cols);
    for index in first..first + count {
        let stride = of.stride();
        of.at(index).chunks(stride).take(rows).for_each(|row| numbers.extend_from_slice(&row[..cols]));
    }
    Given(numbers, vec![count, rows, cols])
}

/// A list.
pub fn numbers(list: &[f64]) -> Argument {
    Argument::Array(Given(list.to_vec(), vec![list.len()]))
}

/// Writes rows of `cols` numbers into the rows of matrix `index`, with `apply`.
pub fn write(out: &mut Matrices, index: usize, numbers: &[f64], cols: usize, apply: impl Fn(&mut f64, f64)) {
    let stride = out.stride();
    for (row, numbers) in out.at_mut(index).chunks_mut(stride).zip(numbers.chunks(cols)) {
        row.iter_mut().zip(numbers).for_each(|(to, &from)| apply(to, from));
    }
}

fn set(to: &mut f64, from: f64) {
    *to = from;
}

/// Adds a number, for [`write`].
pub fn add(to: &mut f64, from: f64) {
    *to += from;
}

/// The numbers of a result: one array, or a tuple of `K` of them.
pub fn read<const K: usize>(name: &str, results: &Bound<'_, PyAny>, shapes: [&[usize]; K]) -> PyResult<[Vec<f64>; K]> {
    let mut out = [const { Vec::new() }; K];
    if K == 1 {
        out[0] = read_array(name, results, shapes[0])?;
        return Ok(out);
    }
    let tuple = results.cast::<PyTuple>().ok().filter(|tuple| tuple.len() == K);
    let Some(tuple) = tuple else {
        let found = results.get_type().name()?;
        let message = format!("`{name}` of the backend returned {found}: it must return a tuple of {K} arrays");
        return Err(errors::usage(results.py(), &message));
    };
    for ((out, array), shape) in out.iter_mut().zip(tuple.iter()).zip(shapes) {
        *out = read_array(name, &array, shape)?;
    }
    Ok(out)
}

fn read_array(name: &str, array: &Bound<'_, PyAny>, shape: &[usize]) -> PyResult<Vec<f64>> {
    if shape.is_empty()
        && let Ok(number) = array.extract::<f64>()
    {
        return Ok(vec![number]);
    }
    let Ok(found) = array.cast::<PyArrayDyn<f64>>() else {
        let kind = match array.getattr("dtype") {
            Ok(dtype) => format!("an array of {dtype}"),
            Err(_) => array.get_type().name()?.to_string(),
        };
        let message = format!(
            "`{name}` of the backend returned {kind}: it must return NumPy arrays of float64; np.asarray(..., \
             dtype=np.float64) makes one"
        );
        return Err(errors::usage(array.py(), &message));
    };
    if found.shape() != shape {
        let message = format!(
            "`{name}` of the backend returned an array of the shape {:?}: it must have the shape {shape:?}, with the batch \
             of points along the first axis",
            found.shape()
        );
        return Err(errors::usage(array.py(), &message));
    }
    let found = found.readonly();
    // `as_slice` takes arrays in Fortran's order too.
    let in_order = found.is_c_contiguous().then(|| found.as_slice().ok()).flatten();
    Ok(in_order.map_or_else(|| found.as_array().iter().copied().collect(), <[f64]>::to_vec))
}

/// One vector as a batch.
pub fn row(vector: &[f64]) -> Argument {
    Argument::Array(Given(vector.to_vec(), vec![1, vector.len()]))
}

/// Writes matrices of `rows` x `cols`, or NaN where there are none.
pub fn fill(out: &mut Matrices, numbers: Option<&[f64]>, count: usize, rows: usize, cols: usize) {
    let nothing = vec![f64::NAN; if numbers.is_some() { 0 } else { rows * cols }];
    for index in 0..count {
        let own = numbers.map_or(&*nothing, |numbers| &numbers[index * rows * cols..(index + 1) * rows * cols]);
        write(out, index, own, cols, set);
    }
}

/// Makes all that is added to NaN.
pub fn poison(out: &mut Matrices) {
    let (count, rows, cols) = (out.count(), out.rows(), out.cols());
    fill(out, None, count, rows, cols);
}

/// Writes `[l_zz | l_z]` of `width` variables from matrix `first` on; the gradient is column `joint`.
pub fn write_quadratics(
    out: &mut Matrices,
    first: usize,
    count: usize,
    width: usize,
    joint: usize,
    found: Option<&[Vec<f64>; 2]>,
) {
    let nothing = vec![f64::NAN; width * width];
    for offset in 0..count {
        let index = first + offset;
        let (second, gradient) = match found {
            Some([second, gradient]) => {
                (&second[offset * width * width..][..width * width], &gradient[offset * width..][..width])
            }
            None => (&*nothing, &nothing[..width]),
        };
        // The engine may have convexified the previous result in place and filled entries that are not written now.
        out.at_mut(index).fill(0.0);
        write(out, index, second, width, set);
        let (stride, matrix) = (out.stride(), out.at_mut(index));
        gradient.iter().enumerate().for_each(|(i, number)| matrix[i * stride + joint] = *number);
    }
}
