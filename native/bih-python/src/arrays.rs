//! Arrays from Python, checked: what comes out has the shape, the dtype and the layout that the core reads.

use bih_core::traverse::Vectors;
use numpy::{
    PyArray1, PyArray2, PyArrayDescrMethods, PyArrayMethods, PyReadonlyArray2, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;

use crate::errors::GeometryError;

/// Any array-like as an array, with an error that names the argument.
pub fn as_array<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    let numpy = value.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (value,)).map_err(|error| match error {
        error if error.is_instance_of::<PyMemoryError>(value.py()) => error,
        error => GeometryError::new_err(format!("{name}: not an array ({error})")),
    })?;
    Ok(array.cast_into::<PyUntypedArray>()?)
}

/// The kind of numbers: "f" floating point, "i" and "u" integers, and others that are no real numbers.
pub fn kind(array: &Bound<'_, PyUntypedArray>) -> char {
    array.dtype().kind() as char
}

/// A refusal that names the argument and shows what came instead.
pub fn wrong<T>(name: &str, expected: &str, array: &Bound<'_, PyUntypedArray>) -> PyResult<T> {
    let shape = array.getattr("shape")?;
    Err(GeometryError::new_err(format!("{name}: expected {expected}, got shape {shape} dtype {}", array.dtype())))
}

/// The array with this dtype, C-contiguous and aligned; the same object where it is that already.
pub fn converted<'py>(array: &Bound<'py, PyAny>, dtype: &str) -> PyResult<Bound<'py, PyAny>> {
    let numpy = array.py().import("numpy")?;
    let options = [("dtype", dtype)].into_py_dict(array.py())?;
    options.set_item("requirements", ["C", "A"])?;
    numpy.call_method("require", (array,), Some(&options))
}

/// (N, 3) real numbers, checked.
pub enum VectorArray<'py> {
    F32(PyReadonlyArray2<'py, f32>),
    F64(PyReadonlyArray2<'py, f64>),
}

impl VectorArray<'_> {
    pub fn rows(&self) -> usize {
        match self {
            Self::F32(array) => array.shape()[0],
            Self::F64(array) => array.shape()[0],
        }
    }

    pub fn view(&self) -> PyResult<Vectors<'_>> {
        Ok(match self {
            Self::F32(array) => Vectors::F32(bytemuck::cast_slice(array.as_slice()?)),
            Self::F64(array) => Vectors::F64(bytemuck::cast_slice(array.as_slice()?)),
        })
    }
}

/// (N, 3) real numbers as float32 where they are that already, else as doubles.
pub fn vectors<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<VectorArray<'py>> {
    let array = as_array(name, value)?;
    if !matches!(array.shape(), [_, 3]) || !matches!(kind(&array), 'f' | 'i' | 'u') {
        return wrong(name, "(N, 3) real numbers", &array);
    }
    if kind(&array) == 'f' && array.dtype().itemsize() == size_of::<f32>() {
        let array = converted(&array, "float32")?.cast_into::<PyArray2<f32>>()?;
        return Ok(VectorArray::F32(array.try_readonly()?));
    }
    let array = converted(&array, "float64")?.cast_into::<PyArray2<f64>>()?;
    Ok(VectorArray::F64(array.try_readonly()?))
}

/// A square matrix of doubles.
pub fn matrix(name: &str, value: &Bound<'_, PyAny>) -> PyResult<[[f64; 4]; 4]> {
    let array = as_array(name, value)?;
    if array.shape() != [4, 4] || !matches!(kind(&array), 'f' | 'i' | 'u') {
        return wrong(name, "(4, 4) real numbers", &array);
    }
    let array = converted(&array, "float64")?.cast_into::<PyArray2<f64>>()?;
    let array = array.try_readonly()?;
    let view = array.as_array();
    Ok(std::array::from_fn(|i| std::array::from_fn(|j| view[[i, j]])))
}

/// One end of the rays as the caller gives it.
#[derive(FromPyObject)]
pub enum Limit<'py> {
    /// The same for all; every number and array of no dimension.
    Number(f64),
    /// One for each.
    Array(Bound<'py, PyAny>),
}

/// One end of the rays, checked.
pub enum LimitArray<'py> {
    All(f64),
    Each(Bound<'py, PyArray1<f64>>),
}

/// A number, or one for each of `count` rays.
pub fn limits<'py>(name: &str, value: &Limit<'py>, count: usize) -> PyResult<LimitArray<'py>> {
    let array = match value {
        Limit::Number(limit) => return Ok(LimitArray::All(*limit)),
        Limit::Array(array) => as_array(name, array)?,
    };
    if array.shape() != [count] || !matches!(kind(&array), 'f' | 'i' | 'u') {
        return wrong(name, &format!("a number or ({count},) real numbers"), &array);
    }
    Ok(LimitArray::Each(converted(&array, "float64")?.cast_into()?))
}
