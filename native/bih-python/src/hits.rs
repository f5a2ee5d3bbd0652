//! The answer to a batch of rays.

use bih_core::Hit;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;

use crate::arrays::floats;

/// The answer to a batch of N rays, as NumPy arrays that own their memory.
#[pyclass(frozen, module = "bihtree")]
pub struct Hits {
    #[pyo3(get)]
    t: Py<PyAny>,
    #[pyo3(get)]
    triangle: Py<PyArray1<i32>>,
    #[pyo3(get)]
    u: Py<PyAny>,
    #[pyo3(get)]
    v: Py<PyAny>,
    #[pyo3(get)]
    instance: Py<PyArray1<i32>>,
    #[pyo3(get)]
    invalid: usize,
    length: usize,
}

impl Hits {
    pub fn new(py: Python<'_>, hits: &[Option<Hit>], invalid: usize, is_double: bool) -> Self {
        let each = |value: fn(&Hit) -> f64, miss: f64| {
            floats(py, is_double, hits.iter().map(move |hit| hit.as_ref().map_or(miss, value)))
        };
        let rows = |value: fn(&Hit) -> i32| {
            PyArray1::from_iter(py, hits.iter().map(|hit| hit.as_ref().map_or(-1, value))).unbind()
        };
        Self {
            t: each(|hit| hit.t, f64::INFINITY),
            triangle: rows(|hit| hit.triangle as i32),
            u: each(|hit| hit.u, 0.0),
            v: each(|hit| hit.v, 0.0),
            instance: rows(|_| 0),
            invalid,
            length: hits.len(),
        }
    }
}

#[pymethods]
impl Hits {
    fn __len__(&self) -> usize {
        self.length
    }

    /// Whether each ray hit anything.
    #[getter]
    fn hit<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let triangle = self.triangle.bind(py).try_readonly()?;
        Ok(PyArray1::from_iter(py, triangle.as_array().iter().map(|&row| row >= 0)))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let hit = self.triangle.bind(py).try_readonly()?.as_array().iter().filter(|&&row| row >= 0).count();
        Ok(format!("<bihtree.Hits: {hit} of {} rays hit, {} invalid>", self.length, self.invalid))
    }
}
