//! The answer to a batch of rays.

use bih_core::memory::room;
use bih_core::traverse::Float;
use numpy::{Element, PyArray1, PyArrayMethods};
use pyo3::prelude::*;

use crate::errors::to_exception;

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
    pub fn new<F: Float + Element>(py: Python<'_>, hits: bih_core::traverse::Hits<F>) -> Self {
        let instance = hits.triangle.iter().map(|&row| row.min(0)).collect();
        Self::of(py, hits, instance)
    }

    /// Of a scene, with the rows of the instances.
    pub fn of<F: Float + Element>(py: Python<'_>, hits: bih_core::traverse::Hits<F>, instance: Vec<i32>) -> Self {
        let length = hits.t.len();
        Self {
            instance: PyArray1::from_vec(py, instance).unbind(),
            t: PyArray1::from_vec(py, hits.t).into_any().unbind(),
            triangle: PyArray1::from_vec(py, hits.triangle).unbind(),
            u: PyArray1::from_vec(py, hits.u).into_any().unbind(),
            v: PyArray1::from_vec(py, hits.v).into_any().unbind(),
            invalid: hits.invalid,
            length,
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
        room("the answers", self.length).map_err(to_exception)?;
        let triangle = self.triangle.bind(py).try_readonly()?;
        Ok(PyArray1::from_iter(py, triangle.as_array().iter().map(|&row| row >= 0)))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let hit = self.triangle.bind(py).try_readonly()?.as_array().iter().filter(|&&row| row >= 0).count();
        Ok(format!("<bihtree.Hits: {hit} of {} rays hit, {} invalid>", self.length, self.invalid))
    }
}

/// All triangles hit by each of N rays, as NumPy arrays that own their memory.
#[pyclass(frozen, module = "bihtree")]
pub struct HitLists {
    #[pyo3(get)]
    offsets: Py<PyArray1<i64>>,
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
    rays: usize,
    hits: usize,
}

impl HitLists {
    pub fn new<F: Float + Element>(py: Python<'_>, lists: bih_core::traverse::HitLists<F>) -> PyResult<Self> {
        room("the hits", size_of::<i32>() * lists.t.len()).map_err(to_exception)?;
        let instance = vec![0; lists.t.len()];
        Ok(Self::of(py, lists, instance))
    }

    /// Of a scene, with the rows of the instances.
    pub fn of<F: Float + Element>(py: Python<'_>, lists: bih_core::traverse::HitLists<F>, instance: Vec<i32>) -> Self {
        let (rays, hits) = (lists.offsets.len() - 1, lists.t.len());
        Self {
            offsets: PyArray1::from_vec(py, lists.offsets).unbind(),
            t: PyArray1::from_vec(py, lists.t).into_any().unbind(),
            triangle: PyArray1::from_vec(py, lists.triangle).unbind(),
            u: PyArray1::from_vec(py, lists.u).into_any().unbind(),
            v: PyArray1::from_vec(py, lists.v).into_any().unbind(),
            instance: PyArray1::from_vec(py, instance).unbind(),
            rays,
            hits,
        }
    }
}

#[pymethods]
impl HitLists {
    fn __len__(&self) -> usize {
        self.rays
    }

    fn __repr__(&self) -> String {
        format!("<bihtree.HitLists: {} hits of {} rays>", self.hits, self.rays)
    }
}
