//! Any result as Python objects: maps as dicts, lists of numbers as NumPy arrays.
//!
//! Sequences of floats become float64 arrays; sequences of equally long sequences become arrays with
//! one more axis. The memory of a list of numbers is handed over, not copied.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyNone};
use serde::Serialize;
use serde::ser::{self, SerializeMap, SerializeSeq, SerializeStruct};

/// A value as Python objects.
///
/// # Errors
/// Where memory runs out.
pub fn to_python<T: Serialize>(py: Python<'_>, value: &T) -> PyResult<Py<PyAny>> {
    let built = value.serialize(Builder(py)).map_err(|Failure(error)| error)?;
    built.finish(py)
}

/// What was built so far: numbers wait for the others of their list.
enum Built {
    Object(Py<PyAny>),
    Number(f64),
    /// Numbers with the lengths of their axes.
    Numbers(Vec<f64>, Vec<usize>),
}

impl Built {
    fn finish(self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(match self {
            Self::Object(object) => object,
            Self::Number(number) => number.into_pyobject(py)?.into_any().unbind(),
            Self::Numbers(numbers, shape) => {
                let flat = PyArray1::from_vec(py, numbers);
                if shape.len() == 1 { flat.into_any().unbind() } else { flat.reshape(shape)?.into_any().unbind() }
            }
        })
    }
}

/// An error of Python's on the way.
#[derive(Debug)]
struct Failure(PyErr);

impl From<PyErr> for Failure {
    fn from(error: PyErr) -> Self {
        Self(error)
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.0)
    }
}

impl std::error::Error for Failure {}

impl ser::Error for Failure {
    fn custom<T: std::fmt::Display>(message: T) -> Self {
        Self(PyValueError::new_err(message.to_string()))
    }
}

#[derive(Clone, Copy)]
struct Builder<'py>(Python<'py>);

impl Builder<'_> {
    fn object<'py, T: IntoPyObjectExt<'py>>(py: Python<'py>, value: T) -> Result<Built, Failure> {
        Ok(Built::Object(value.into_py_any(py)?))
    }
}

/// The methods for kinds of numbers and texts that Python holds as they are.
macro_rules! as_objects {
    ($($method:ident: $kind:ty),* $(,)?) => {
        $(fn $method(self, value: $kind) -> Result<Built, Failure> {
            Self::object(self.0, value)
        })*
    };
}

impl<'py> ser::Serializer for Builder<'py> {
    type Ok = Built;
    type Error = Failure;
    type SerializeSeq = Sequence<'py>;
    type SerializeTuple = Sequence<'py>;
    type SerializeTupleStruct = Sequence<'py>;
    type SerializeTupleVariant = Variant<'py, Sequence<'py>>;
    type SerializeMap = Map<'py>;
    type SerializeStruct = Map<'py>;
    type SerializeStructVariant = Variant<'py, Map<'py>>;

    as_objects! {
        serialize_bool: bool, serialize_i8: i8, serialize_i16: i16, serialize_i32: i32, serialize_i64: i64,
        serialize_u8: u8, serialize_u16: u16, serialize_u32: u32, serialize_u64: u64, serialize_char: char,
        serialize_str: &str, serialize_bytes: &[u8],
    }

    fn serialize_f32(self, value: f32) -> Result<Built, Failure> {
        Ok(Built::Number(value.into()))
    }
    fn serialize_f64(self, value: f64) -> Result<Built, Failure> {
        Ok(Built::Number(value))
    }
    fn serialize_none(self) -> Result<Built, Failure> {
        Ok(Built::Object(PyNone::get(self.0).to_owned().into_any().unbind()))
    }
    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<Built, Failure> {
        value.serialize(self)
    }
    fn serialize_unit(self) -> Result<Built, Failure> {
        self.serialize_none()
    }
    fn serialize_unit_struct(self, _: &'static str) -> Result<Built, Failure> {
        self.serialize_none()
    }
    fn serialize_unit_variant(self, _: &'static str, _: u32, variant: &'static str) -> Result<Built, Failure> {
        self.serialize_str(variant)
    }
    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, _: &'static str, value: &T) -> Result<Built, Failure> {
        value.serialize(self)
    }
    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        value: &T,
    ) -> Result<Built, Failure> {
        let mut map = Map::new(self.0);
        map.set(variant, value)?;
        Ok(Built::Object(map.dict.into_any().unbind()))
    }
    fn serialize_seq(self, length: Option<usize>) -> Result<Sequence<'py>, Failure> {
        Ok(Sequence { py: self.0, built: Vec::new(), numbers: Vec::with_capacity(length.unwrap_or(0)), shape: None })
    }
    fn serialize_tuple(self, length: usize) -> Result<Sequence<'py>, Failure> {
        self.serialize_seq(Some(length))
    }
    fn serialize_tuple_struct(self, _: &'static str, length: usize) -> Result<Sequence<'py>, Failure> {
        self.serialize_seq(Some(length))
    }
    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        length: usize,
    ) -> Result<Variant<'py, Sequence<'py>>, Failure> {
        Ok(Variant { py: self.0, variant, inner: self.serialize_seq(Some(length))? })
    }
    fn serialize_map(self, _: Option<usize>) -> Result<Map<'py>, Failure> {
        Ok(Map::new(self.0))
    }
    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Map<'py>, Failure> {
        Ok(Map::new(self.0))
    }
    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        _: usize,
    ) -> Result<Variant<'py, Map<'py>>, Failure> {
        Ok(Variant { py: self.0, variant, inner: Map::new(self.0) })
    }
}

/// A list: numbers of equal shape as long as there is nothing else, or else objects.
struct Sequence<'py> {
    py: Python<'py>,
    built: Vec<Py<PyAny>>,
    numbers: Vec<f64>,
    /// The shape of each entry and how many there are; none before the first one.
    shape: Option<(Vec<usize>, usize)>,
}

impl Sequence<'_> {
    fn push(&mut self, entry: Built) -> Result<(), Failure> {
        let entry = match entry {
            Built::Number(number) if self.takes(&[]) => {
                self.numbers.push(number);
                return Ok(());
            }
            Built::Numbers(numbers, shape) if self.takes(&shape) => {
                self.numbers.extend(numbers);
                return Ok(());
            }
            other => other,
        };
        self.spill()?;
        self.built.push(entry.finish(self.py)?);
        Ok(())
    }

    /// Whether numbers of this shape extend the current array; if so, they are counted.
    fn takes(&mut self, shape: &[usize]) -> bool {
        match &mut self.shape {
            None if self.built.is_empty() => {
                self.shape = Some((shape.to_vec(), 1));
                true
            }
            Some((of_each, count)) if of_each == shape => {
                *count += 1;
                true
            }
            _ => false,
        }
    }

    /// Converts the numbers so far into objects, because the next entry does not have their shape.
    fn spill(&mut self) -> Result<(), Failure> {
        let Some((shape, count)) = self.shape.take() else { return Ok(()) };
        let size: usize = shape.iter().product();
        let numbers = std::mem::take(&mut self.numbers);
        for i in 0..count {
            let own = &numbers[i * size..(i + 1) * size];
            let entry =
                if shape.is_empty() { Built::Number(own[0]) } else { Built::Numbers(own.to_vec(), shape.clone()) };
            self.built.push(entry.finish(self.py)?);
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Built, Failure> {
        match self.shape.take() {
            Some((mut shape, count)) => {
                shape.insert(0, count);
                Ok(Built::Numbers(self.numbers, shape))
            }
            None => Ok(Built::Object(PyList::new(self.py, self.built)?.into_any().unbind())),
        }
    }
}

impl SerializeSeq for Sequence<'_> {
    type Ok = Built;
    type Error = Failure;
    fn serialize_element<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Failure> {
        let entry = value.serialize(Builder(self.py))?;
        self.push(entry)
    }
    fn end(self) -> Result<Built, Failure> {
        self.finish()
    }
}

impl ser::SerializeTuple for Sequence<'_> {
    type Ok = Built;
    type Error = Failure;
    fn serialize_element<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Failure> {
        SerializeSeq::serialize_element(self, value)
    }
    fn end(self) -> Result<Built, Failure> {
        self.finish()
    }
}

impl ser::SerializeTupleStruct for Sequence<'_> {
    type Ok = Built;
    type Error = Failure;
    fn serialize_field<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Failure> {
        SerializeSeq::serialize_element(self, value)
    }
    fn end(self) -> Result<Built, Failure> {
        self.finish()
    }
}

/// A dict.
struct Map<'py> {
    dict: Bound<'py, PyDict>,
    key: Option<Py<PyAny>>,
}

impl<'py> Map<'py> {
    fn new(py: Python<'py>) -> Self {
        Self { dict: PyDict::new(py), key: None }
    }

    fn set<T: Serialize + ?Sized>(&mut self, key: &str, value: &T) -> Result<(), Failure> {
        let py = self.dict.py();
        let value = value.serialize(Builder(py))?.finish(py)?;
        Ok(self.dict.set_item(key, value)?)
    }
}

impl SerializeMap for Map<'_> {
    type Ok = Built;
    type Error = Failure;
    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), Failure> {
        let py = self.dict.py();
        self.key = Some(key.serialize(Builder(py))?.finish(py)?);
        Ok(())
    }
    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Failure> {
        let py = self.dict.py();
        let value = value.serialize(Builder(py))?.finish(py)?;
        Ok(self.dict.set_item(self.key.take(), value)?)
    }
    fn end(self) -> Result<Built, Failure> {
        Ok(Built::Object(self.dict.into_any().unbind()))
    }
}

impl SerializeStruct for Map<'_> {
    type Ok = Built;
    type Error = Failure;
    fn serialize_field<T: Serialize + ?Sized>(&mut self, key: &'static str, value: &T) -> Result<(), Failure> {
        self.set(key, value)
    }
    fn end(self) -> Result<Built, Failure> {
        SerializeMap::end(self)
    }
}

/// An enum's variant with contents: a dict with its name as the only key.
struct Variant<'py, T> {
    py: Python<'py>,
    variant: &'static str,
    inner: T,
}

impl<T> Variant<'_, T> {
    fn wrap(py: Python<'_>, variant: &'static str, inner: Built) -> Result<Built, Failure> {
        let dict = PyDict::new(py);
        dict.set_item(variant, inner.finish(py)?)?;
        Ok(Built::Object(dict.into_any().unbind()))
    }
}

impl ser::SerializeTupleVariant for Variant<'_, Sequence<'_>> {
    type Ok = Built;
    type Error = Failure;
    fn serialize_field<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Failure> {
        SerializeSeq::serialize_element(&mut self.inner, value)
    }
    fn end(self) -> Result<Built, Failure> {
        let inner = self.inner.finish()?;
        Self::wrap(self.py, self.variant, inner)
    }
}

impl ser::SerializeStructVariant for Variant<'_, Map<'_>> {
    type Ok = Built;
    type Error = Failure;
    fn serialize_field<T: Serialize + ?Sized>(&mut self, key: &'static str, value: &T) -> Result<(), Failure> {
        self.inner.set(key, value)
    }
    fn end(self) -> Result<Built, Failure> {
        let inner = SerializeMap::end(self.inner)?;
        Self::wrap(self.py, self.variant, inner)
    }
}
