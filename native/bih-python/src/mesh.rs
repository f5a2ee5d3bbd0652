//! The arrays of a mesh, owned or borrowed, held as long as the tree lives.

use bih_core::{Triangles, Vertices};
use numpy::{PyArray2, PyArrayDescrMethods, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{as_array, converted, kind, wrong};
use crate::errors::{GeometryError, to_exception};

/// Vertices in the precision they came in, and rows of three of them; read-only.
pub struct Mesh {
    vertices: VertexArray,
    triangles: Option<Py<PyArray2<u32>>>,
    /// Bytes that belong to the tree; what the caller keeps does not count.
    pub owned_bytes: usize,
}

enum VertexArray {
    F32(Py<PyArray2<f32>>),
    F64(Py<PyArray2<f64>>),
}

impl Mesh {
    /// Check both arrays and take a copy, or with `copy` false the arrays themselves where their dtype and layout allow.
    pub fn new(vertices: &Bound<'_, PyAny>, triangles: Option<&Bound<'_, PyAny>>, copy: bool) -> PyResult<Self> {
        let given = as_array("vertices", vertices)?;
        if !matches!(given.shape(), [_, 3]) || !matches!(kind(&given), 'f' | 'i' | 'u') {
            return wrong("vertices", "(V, 3) real numbers", &given);
        }
        // Single precision holds float16 and float32; integers may need more.
        let is_single = kind(&given) == 'f' && given.dtype().itemsize() <= 4;
        let mut owned_bytes = 0;
        let kept = keep(&given, if is_single { "float32" } else { "float64" }, copy, &mut owned_bytes)?;
        let vertices = if is_single {
            VertexArray::F32(kept.cast_into()?.unbind())
        } else {
            VertexArray::F64(kept.cast_into()?.unbind())
        };
        let triangles = match triangles {
            None => None,
            Some(rows) => {
                let rows = vertex_rows(rows)?;
                Some(keep(&rows, "uint32", copy, &mut owned_bytes)?.cast_into()?.unbind())
            }
        };
        let mesh = Self { vertices, triangles, owned_bytes };
        mesh.with(given.py(), |vertices, rows| Triangles::new(vertices, rows).map(drop))?.map_err(to_exception)?;
        Ok(mesh)
    }

    /// Call `read` with borrowed slices of the arrays.
    fn with<R>(&self, py: Python<'_>, read: impl FnOnce(Vertices<'_>, Option<&[[u32; 3]]>) -> R) -> PyResult<R> {
        let rows = self.triangles.as_ref().map(|rows| rows.bind(py).try_readonly()).transpose()?;
        let rows = rows.as_ref().map(|rows| rows.as_slice()).transpose()?.map(bytemuck::cast_slice);
        Ok(match &self.vertices {
            VertexArray::F32(array) => {
                let array = array.bind(py).try_readonly()?;
                read(Vertices::F32(bytemuck::cast_slice(array.as_slice()?)), rows)
            }
            VertexArray::F64(array) => {
                let array = array.bind(py).try_readonly()?;
                read(Vertices::F64(bytemuck::cast_slice(array.as_slice()?)), rows)
            }
        })
    }

    /// Call `read` with a view of the triangles, which were checked when the mesh was made.
    pub fn with_triangles<R>(&self, py: Python<'_>, read: impl FnOnce(Triangles<'_>) -> R) -> PyResult<R> {
        self.with(py, |vertices, rows| read(Triangles::unchecked(vertices, rows)))
    }
}

/// The array in the layout the core reads, made read-only: a copy, or the caller's own.
fn keep<'py>(
    given: &Bound<'py, PyAny>,
    dtype: &str,
    copy: bool,
    owned_bytes: &mut usize,
) -> PyResult<Bound<'py, PyAny>> {
    let mut kept = converted(given, dtype)?;
    let shares_memory = || given.py().import("numpy")?.call_method1("may_share_memory", (given, &kept))?.extract();
    let is_borrowed: bool = shares_memory()?;
    if is_borrowed && copy {
        kept = kept.call_method0("copy")?;
    }
    if !is_borrowed || copy {
        *owned_bytes += kept.getattr("nbytes")?.extract::<usize>()?;
    } else {
        given.call_method1("setflags", (false,))?;
    }
    kept.call_method1("setflags", (false,))?;
    Ok(kept)
}

/// (T, 3) integers from 0 as unsigned ones; a view of the same memory where they have 32 bits.
fn vertex_rows<'py>(value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let array = as_array("triangles", value)?;
    if !matches!(array.shape(), [_, 3]) || !matches!(kind(&array), 'i' | 'u') {
        return wrong("triangles", "(T, 3) integers", &array);
    }
    if let Ok(narrow) = array.cast::<PyArray2<i32>>() {
        for (row, corner) in narrow.try_readonly()?.as_array().rows().into_iter().enumerate() {
            check_row(row, corner.iter().map(|&vertex| i64::from(vertex)))?;
        }
        return array.call_method1("view", ("uint32",));
    }
    if array.cast::<PyArray2<u32>>().is_ok() {
        return Ok(array.into_any());
    }
    let wide = converted(&array, "int64")?.cast_into::<PyArray2<i64>>()?;
    for (row, corner) in wide.try_readonly()?.as_array().rows().into_iter().enumerate() {
        check_row(row, corner.iter().copied())?;
    }
    converted(&wide, "uint32")
}

fn check_row(row: usize, mut vertices: impl Iterator<Item = i64>) -> PyResult<()> {
    match vertices.find(|vertex| u32::try_from(*vertex).is_err()) {
        None => Ok(()),
        Some(vertex) => Err(GeometryError::new_err(format!("triangles: row {row} refers to vertex {vertex}"))),
    }
}
