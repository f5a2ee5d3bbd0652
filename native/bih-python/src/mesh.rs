//! The arrays of a mesh, owned, borrowed or in a file, held as long as the tree lives.

use std::fmt::Display;

use bih_core::saved::SavedMesh;
use bih_core::{Error, Triangles, Vertices};
use numpy::{
    PyArray1, PyArray2, PyArrayDescrMethods, PyArrayMethods, PyReadonlyArray2, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::arrays::{as_array, converted, kind, wrong};
use crate::errors::{GeometryError, to_exception};

/// Vertices in the precision they came in, and rows of three of them.
pub struct Mesh {
    vertices: VertexArray,
    triangles: Option<Py<PyArray2<u32>>>,
    /// Bytes that belong to the tree; what the caller keeps does not count.
    pub owned_bytes: usize,
    /// Those of the rows.
    owned_rows: usize,
    /// The arrays that must not change any more, the caller's own among them.
    borrowed: Vec<Py<PyAny>>,
}

enum VertexArray {
    F32(Py<PyArray2<f32>>),
    F64(Py<PyArray2<f64>>),
    /// With the triangles.
    Saved(SavedMesh),
}

impl From<SavedMesh> for Mesh {
    fn from(mesh: SavedMesh) -> Self {
        let owned_bytes = mesh.bytes();
        Self { vertices: VertexArray::Saved(mesh), triangles: None, owned_bytes, owned_rows: 0, borrowed: Vec::new() }
    }
}

impl Mesh {
    /// Check both arrays and take a copy, or with `copy` false the arrays themselves where their dtype and layout allow.
    pub fn new(vertices: &Bound<'_, PyAny>, triangles: Option<&Bound<'_, PyAny>>, copy: bool) -> PyResult<Self> {
        let given = as_array("vertices", vertices)?;
        let rows = triangles.map(|rows| as_array("triangles", rows)).transpose()?;
        check_shapes(&given, rows.as_ref())?;
        // Single precision holds float16 and float32; integers may need more.
        let is_single = kind(&given) == 'f' && given.dtype().itemsize() <= 4;
        let kept = converted(&given, if is_single { "float32" } else { "float64" })?;
        let vertices = keep(&given, kept, copy)?;
        let triangles = rows.map(|rows| keep(&rows, vertex_rows(&rows)?, copy)).transpose()?;

        let parts = [Some(&vertices), triangles.as_ref()];
        let owned_bytes = parts.iter().flatten().map(|part| part.owned_bytes).sum();
        let borrowed =
            parts.iter().flatten().flat_map(|part| &part.borrowed).map(|array| array.clone().unbind()).collect();
        let owned_rows = triangles.as_ref().map_or(0, |part| part.owned_bytes);
        let py = given.py();
        let mesh = Self {
            vertices: if is_single {
                VertexArray::F32(vertices.array.cast_into()?.unbind())
            } else {
                VertexArray::F64(vertices.array.cast_into()?.unbind())
            },
            triangles: triangles.map(|part| part.array.cast_into()).transpose()?.map(Bound::unbind),
            owned_bytes,
            owned_rows,
            borrowed,
        };
        mesh.with(py, |vertices, rows| Triangles::new(vertices, rows).map(drop))?.map_err(to_exception)?;
        Ok(mesh)
    }

    /// The same triangles between other vertices, as many and in the same precision, of which a copy is taken.
    pub fn moved(&self, py: Python<'_>, vertices: &Bound<'_, PyAny>) -> PyResult<Self> {
        let given = as_array("vertices", vertices)?;
        let (count, is_single) = self.with(py, |vertices, _| (vertices.len(), matches!(vertices, Vertices::F32(_))))?;
        let fits = match kind(&given) {
            'f' => !is_single || given.dtype().itemsize() <= 4,
            kind => matches!(kind, 'i' | 'u') && !is_single,
        };
        if given.shape() != [count, 3] || !fits {
            let expected = format!("({count}, 3) {}", if is_single { "float32" } else { "real numbers" });
            return wrong("vertices", &expected, &given);
        }
        let kept = keep(&given, converted(&given, if is_single { "float32" } else { "float64" })?, true)?;
        let (triangles, owned_rows) = match &self.vertices {
            VertexArray::Saved(mesh) => {
                let rows = mesh.rows().unwrap_or_default();
                let array = PyArray1::from_slice(py, rows.as_flattened()).reshape([rows.len(), 3])?;
                (mesh.rows().map(|_| array.unbind()), size_of_val(rows))
            }
            VertexArray::F32(_) | VertexArray::F64(_) => {
                (self.triangles.as_ref().map(|rows| rows.clone_ref(py)), self.owned_rows)
            }
        };
        Ok(Self {
            vertices: if is_single {
                VertexArray::F32(kept.array.cast_into()?.unbind())
            } else {
                VertexArray::F64(kept.array.cast_into()?.unbind())
            },
            triangles,
            owned_bytes: kept.owned_bytes + owned_rows,
            owned_rows,
            borrowed: Vec::new(),
        })
    }

    /// Make the borrowed arrays read-only.
    pub fn freeze(&self, py: Python<'_>) -> PyResult<()> {
        self.borrowed.iter().try_for_each(|array| array.call_method1(py, "setflags", (false,)).map(drop))
    }

    /// Borrow the arrays.
    pub fn view<'a>(&'a self, py: Python<'a>) -> PyResult<MeshView<'a>> {
        let rows = self.triangles.as_ref().map(|rows| rows.bind(py).try_readonly()).transpose()?;
        let vertices = match &self.vertices {
            VertexArray::F32(array) => VertexView::F32(array.bind(py).try_readonly()?),
            VertexArray::F64(array) => VertexView::F64(array.bind(py).try_readonly()?),
            VertexArray::Saved(mesh) => VertexView::Saved(mesh),
        };
        Ok(MeshView { vertices, rows })
    }

    /// Call `read` with borrowed slices of the arrays.
    fn with<R>(&self, py: Python<'_>, read: impl FnOnce(Vertices<'_>, Option<&[[u32; 3]]>) -> R) -> PyResult<R> {
        let view = self.view(py)?;
        let (vertices, rows) = view.slices()?;
        Ok(read(vertices, rows))
    }

    /// Call `read` with a view of the triangles, which were checked when the mesh was made.
    pub fn with_triangles<R>(&self, py: Python<'_>, read: impl FnOnce(Triangles<'_>) -> R) -> PyResult<R> {
        self.with(py, |vertices, rows| read(Triangles::unchecked(vertices, rows)))
    }
}

/// The arrays of a mesh while they are borrowed.
pub struct MeshView<'a> {
    vertices: VertexView<'a>,
    rows: Option<PyReadonlyArray2<'a, u32>>,
}

enum VertexView<'a> {
    F32(PyReadonlyArray2<'a, f32>),
    F64(PyReadonlyArray2<'a, f64>),
    Saved(&'a SavedMesh),
}

impl MeshView<'_> {
    fn slices(&self) -> PyResult<(Vertices<'_>, Option<&[[u32; 3]]>)> {
        let rows = self.rows.as_ref().map(|rows| rows.as_slice()).transpose()?.map(bytemuck::cast_slice);
        Ok(match &self.vertices {
            VertexView::F32(array) => (Vertices::F32(bytemuck::cast_slice(array.as_slice()?)), rows),
            VertexView::F64(array) => (Vertices::F64(bytemuck::cast_slice(array.as_slice()?)), rows),
            VertexView::Saved(mesh) => (mesh.vertices(), mesh.rows()),
        })
    }

    /// The triangles, which were checked when the mesh was made.
    pub fn triangles(&self) -> PyResult<Triangles<'_>> {
        let (vertices, rows) = self.slices()?;
        Ok(Triangles::unchecked(vertices, rows))
    }
}

/// What can be seen before anything is read: an array may announce more rows than memory holds.
fn check_shapes(vertices: &Bound<'_, PyUntypedArray>, rows: Option<&Bound<'_, PyUntypedArray>>) -> PyResult<()> {
    if !matches!(vertices.shape(), [_, 3]) || !matches!(kind(vertices), 'f' | 'i' | 'u') {
        return wrong("vertices", "(V, 3) real numbers", vertices);
    }
    if let Some(rows) = rows
        && (!matches!(rows.shape(), [_, 3]) || !matches!(kind(rows), 'i' | 'u'))
    {
        return wrong("triangles", "(T, 3) integers", rows);
    }
    let triangles = rows.map_or(vertices.shape()[0] / 3, |rows| rows.shape()[0]);
    if triangles > Triangles::LIMIT {
        return Err(to_exception(Error::TooManyTriangles { triangles, limit: Triangles::LIMIT }));
    }
    const MOST_VERTICES: usize = 1 << 32;
    match vertices.shape()[0] {
        count if count > MOST_VERTICES => {
            Err(GeometryError::new_err(format!("vertices: {count} rows; a mesh has at most {MOST_VERTICES}")))
        }
        _ => Ok(()),
    }
}

/// An array in the layout the core reads.
struct Kept<'py> {
    array: Bound<'py, PyAny>,
    owned_bytes: usize,
    borrowed: Vec<Bound<'py, PyAny>>,
}

/// `converted`, copied if it may still be the caller's memory and `copy` is set.
fn keep<'py>(given: &Bound<'py, PyAny>, converted: Bound<'py, PyAny>, copy: bool) -> PyResult<Kept<'py>> {
    let numpy = given.py().import("numpy")?;
    let is_shared: bool = numpy.call_method1("may_share_memory", (given, &converted))?.extract()?;
    if is_shared && !copy {
        return Ok(Kept { borrowed: vec![given.clone(), converted.clone()], array: converted, owned_bytes: 0 });
    }
    let array = if is_shared { converted.call_method0("copy")? } else { converted };
    Ok(Kept { owned_bytes: array.getattr("nbytes")?.extract()?, array, borrowed: Vec::new() })
}

/// (T, 3) integers as unsigned ones of 32 bits, a view of the same memory where they have 32 bits already.
fn vertex_rows<'py>(array: &Bound<'py, PyUntypedArray>) -> PyResult<Bound<'py, PyAny>> {
    match (kind(array), array.dtype().itemsize()) {
        ('u', ..=4) => converted(array, "uint32"),
        ('u', _) => {
            let rows = converted(array, "uint64")?.cast_into::<PyArray2<u64>>()?;
            check_rows(rows.try_readonly()?.as_slice()?)?;
            converted(&rows, "uint32")
        }
        (_, ..=4) => {
            let rows = converted(array, "int32")?.cast_into::<PyArray2<i32>>()?;
            check_rows(rows.try_readonly()?.as_slice()?)?;
            rows.call_method1("view", ("uint32",))
        }
        _ => {
            let rows = converted(array, "int64")?.cast_into::<PyArray2<i64>>()?;
            check_rows(rows.try_readonly()?.as_slice()?)?;
            converted(&rows, "uint32")
        }
    }
}

/// Every number must be one of 32 bits without a sign.
fn check_rows<T: Copy + Display + TryInto<u32>>(vertices: &[T]) -> PyResult<()> {
    match vertices.iter().position(|&vertex| vertex.try_into().is_err()) {
        None => Ok(()),
        Some(place) => {
            let (row, vertex) = (place / 3, vertices[place]);
            Err(GeometryError::new_err(format!("triangles: row {row} refers to vertex {vertex}")))
        }
    }
}
