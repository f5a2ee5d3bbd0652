//! Scenes and their queries.

use std::sync::{Arc, PoisonError, RwLock};

use bih_core::build::Precision;
use bih_core::instances::{Model, Scene as CoreScene, SceneHitLists, SceneHits, SceneTracer};
use bih_core::memory::room;
use bih_core::simd::FloatEnvironment;
use bih_core::traverse::{Float, RayBatch};
use bih_core::{Control, Error};
use numpy::{Element, PyArray, PyArray1, PyArrayDescrMethods, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyList;
use rayon::ThreadPool;

use crate::arrays::{Limit, as_array, converted, kind, wrong};
use crate::errors::{GeometryError, to_exception};
use crate::hits::{HitLists, Hits};
use crate::query::{Rays, SUPERVISED, few};
use crate::stats::Stats;
use crate::supervise::{run, supervise};
use crate::tree::{Pair, State, Tree, bounds_array, cost_arrays, count, node_array, thread_pool};

/// Instances of trees: a tree over trees, with the same queries.
#[pyclass(frozen, module = "bihtree")]
pub struct Scene {
    trees: Vec<Py<Tree>>,
    rows: Vec<u32>,
    precision: Precision,
    is_double: bool,
    /// Replaced as a whole, so that a query goes on with what it began with.
    placed: RwLock<Arc<Placed>>,
    pool: Option<ThreadPool>,
}

/// A scene and the trees as they stood when it was made.
pub struct Placed {
    pub core: CoreScene,
    pub trees: Vec<Arc<State>>,
}

type Matrices = Vec<[[f64; 4]; 4]>;

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (trees, instances, matrices, *, threads=0))]
    fn new(
        py: Python<'_>,
        trees: &Bound<'_, PyAny>,
        instances: &Bound<'_, PyAny>,
        matrices: &Bound<'_, PyAny>,
        threads: i64,
    ) -> PyResult<Self> {
        let trees = read_trees(trees)?;
        let precision = common_precision(&trees)?;
        let rows = read_rows(instances, trees.len())?;
        let matrices = read_matrices(matrices, rows.len())?;
        let pool = thread_pool(count("threads", threads, 0)?)?;
        let mut is_double = false;
        for tree in &trees {
            is_double |= tree.get().is_double(py)?;
        }
        let placed = Placed::new(py, &trees, &rows, &matrices, pool.as_ref())?;
        Ok(Self { trees, rows, precision, is_double, placed: RwLock::new(Arc::new(placed)), pool })
    }

    /// The nearest hit of each ray.
    #[pyo3(signature = (origins, directions, *, t_min=Limit::Number(0.0), t_max=Limit::Number(f64::INFINITY)),
        text_signature = "($self, origins, directions, *, t_min=0.0, t_max=1e999)")]
    fn intersect(
        &self,
        py: Python<'_>,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        t_min: Limit<'_>,
        t_max: Limit<'_>,
    ) -> PyResult<Hits> {
        let rays = Rays { origins, directions, t_min, t_max };
        if self.is_double { self.closest::<f64>(py, &rays) } else { self.closest::<f32>(py, &rays) }
    }

    /// Whether each ray hits anything.
    #[pyo3(signature = (origins, directions, *, t_min=Limit::Number(0.0), t_max=Limit::Number(f64::INFINITY)),
        text_signature = "($self, origins, directions, *, t_min=0.0, t_max=1e999)")]
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_min: Limit<'py>,
        t_max: Limit<'py>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let rays = Rays { origins, directions, t_min, t_max };
        let answers = self.query(py, &rays, SUPERVISED, |tracer, rays, control| tracer.occluded_of(rays, control))?;
        Ok(PyArray::from_vec(py, answers))
    }

    /// All triangles that each ray hits, nearest first.
    #[pyo3(signature = (origins, directions, *, t_min=Limit::Number(0.0), t_max=Limit::Number(f64::INFINITY),
        max_hits=None), text_signature = "($self, origins, directions, *, t_min=0.0, t_max=1e999, max_hits=None)")]
    fn intersect_all(
        &self,
        py: Python<'_>,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        t_min: Limit<'_>,
        t_max: Limit<'_>,
        max_hits: Option<i64>,
    ) -> PyResult<HitLists> {
        let rays = Rays { origins, directions, t_min, t_max };
        let most = max_hits.map(|most| count("max_hits", most, 1)).transpose()?.unwrap_or(usize::MAX);
        if self.is_double { self.all::<f64>(py, &rays, most) } else { self.all::<f32>(py, &rays, most) }
    }

    /// How often each ray crosses the surfaces.
    #[pyo3(signature = (origins, directions, *, t_min=Limit::Number(0.0), t_max=Limit::Number(f64::INFINITY)),
        text_signature = "($self, origins, directions, *, t_min=0.0, t_max=1e999)")]
    fn count<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_min: Limit<'py>,
        t_max: Limit<'py>,
    ) -> PyResult<Bound<'py, PyArray1<i32>>> {
        let rays = Rays { origins, directions, t_min, t_max };
        let counts = self.query(py, &rays, self.few(), |tracer, rays, control| tracer.count_of(rays, control))?;
        Ok(PyArray::from_vec(py, counts))
    }

    /// Nodes visited and triangles tested by `intersect` for each ray.
    fn traversal_cost<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
    ) -> PyResult<Pair<'py>> {
        let counts = self.query(py, &Rays::endless(origins, directions), SUPERVISED, |tracer, rays, control| {
            tracer.cost_of(rays, control)
        })?;
        Ok(cost_arrays(py, &counts))
    }

    /// Put every instance to another place; the trees stay as they are.
    fn set_matrices(&self, py: Python<'_>, matrices: &Bound<'_, PyAny>) -> PyResult<()> {
        let matrices = read_matrices(matrices, self.rows.len())?;
        let placed = Arc::new(Placed::new(py, &self.trees, &self.rows, &matrices, self.pool.as_ref())?);
        *self.placed.write().unwrap_or_else(PoisonError::into_inner) = placed;
        Ok(())
    }

    /// The trees that instances are of.
    #[getter]
    fn trees<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        PyList::new(py, &self.trees)
    }

    /// What the upper tree is and what it cost.
    #[getter]
    fn stats(&self) -> Stats {
        let (placed, mesh_bytes) = (self.placed(), 0);
        Stats::new(placed.core.stats(), ["bih", "compact", "sah", self.precision.name()], "eager", mesh_bytes)
    }

    /// (2, 3) lower and upper corner; inf and -inf where there is nothing to hit.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        bounds_array(py, self.placed().core.bounds(), self.is_double)
    }

    /// The upper tree as a structured array, one row a node, breadth first.
    #[pyo3(signature = (*, max_depth=None, limit=None))]
    fn nodes<'py>(&self, py: Python<'py>, max_depth: Option<i64>, limit: Option<i64>) -> PyResult<Bound<'py, PyAny>> {
        let placed = self.placed();
        node_array(py, max_depth, limit, |max_depth, limit| {
            run(py, self.pool.as_ref(), |control| placed.core.nodes(max_depth, limit, control))
        })
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(PyTypeError::new_err("a bihtree.Scene cannot be pickled; save its trees and load them where it is needed"))
    }

    fn __repr__(&self) -> String {
        let (stats, trees) = (self.placed().core.stats().clone(), self.trees.len());
        format!("<bihtree.Scene: {} instances of {trees} trees, {} triangles>", self.rows.len(), stats.triangles)
    }
}

impl Scene {
    /// The scene as it stands.
    pub fn placed(&self) -> Arc<Placed> {
        self.placed.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Rows of the trees that instances show.
    pub fn rows(&self) -> &[u32] {
        &self.rows
    }

    /// The threads of its own, if it has some.
    pub fn pool(&self) -> Option<&ThreadPool> {
        self.pool.as_ref()
    }

    fn closest<F: Float + Element>(&self, py: Python<'_>, rays: &Rays<'_, '_>) -> PyResult<Hits> {
        let SceneHits { hits, instance } =
            self.query(py, rays, SUPERVISED, |tracer, rays, control| tracer.closest_of::<F>(rays, control))?;
        Ok(Hits::of(py, hits, instance))
    }

    fn all<F: Float + Element>(&self, py: Python<'_>, rays: &Rays<'_, '_>, most: usize) -> PyResult<HitLists> {
        let SceneHitLists { lists, instance } =
            self.query(py, rays, self.few(), |tracer, rays, control| tracer.all_of::<F>(rays, most, control))?;
        Ok(HitLists::of(py, lists, instance))
    }

    /// Fewer rays than this are not supervised where each may meet every triangle.
    fn few(&self) -> usize {
        few(self.placed().core.stats().triangles)
    }

    /// Check the rays and hand them to `work` with the scene, supervised unless there are `few`.
    fn query<T: Send>(
        &self,
        py: Python<'_>,
        rays: &Rays<'_, '_>,
        few: usize,
        work: impl FnOnce(&SceneTracer, &RayBatch, &Control) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let (placed, pool) = (self.placed(), self.pool.as_ref());
        rays.check(|batch| {
            with_models(py, &placed.trees, |models| {
                let work = |control: &Control| work(&SceneTracer { scene: &placed.core, models }, batch, control);
                if batch.len() < few { run(py, pool, work) } else { supervise(py, pool, None, work) }
            })
        })
    }
}

impl Placed {
    fn new(
        py: Python<'_>,
        trees: &[Py<Tree>],
        rows: &[u32],
        matrices: &Matrices,
        pool: Option<&ThreadPool>,
    ) -> PyResult<Self> {
        let _standard = FloatEnvironment::standard();
        let trees: Vec<_> = trees.iter().map(|tree| tree.get().state()).collect();
        let core = with_models(py, &trees, |models| {
            supervise(py, pool, None, |control| CoreScene::new(models, rows, matrices, control))
        })?;
        Ok(Self { core, trees })
    }
}

/// Call `read` with the trees and views of their triangles.
pub fn with_models<R>(py: Python<'_>, trees: &[Arc<State>], read: impl FnOnce(&[Model]) -> PyResult<R>) -> PyResult<R> {
    let views = trees.iter().map(|tree| tree.mesh.view(py)).collect::<PyResult<Vec<_>>>()?;
    let models = trees
        .iter()
        .zip(&views)
        .map(|(tree, view)| Ok(Model { tree: &tree.core, triangles: view.triangles()? }))
        .collect::<PyResult<Vec<_>>>()?;
    read(&models)
}

fn read_trees(trees: &Bound<'_, PyAny>) -> PyResult<Vec<Py<Tree>>> {
    let refuse = |text: String| PyTypeError::new_err(text);
    let items = trees.try_iter().map_err(|_| refuse("trees: expected a sequence of bihtree.Tree".to_owned()))?;
    items
        .enumerate()
        .map(|(row, item)| {
            let item = item?;
            let name = item.get_type().name()?;
            item.cast_into::<Tree>()
                .map(Bound::unbind)
                .map_err(|_| refuse(format!("trees: row {row} is a {name}; expected a bihtree.Tree")))
        })
        .collect()
}

/// The precision that all trees have.
fn common_precision(trees: &[Py<Tree>]) -> PyResult<Precision> {
    let precision = |tree: &Py<Tree>| tree.get().state().core.precision();
    let first = trees.first().map(precision).unwrap_or_default();
    match trees.iter().position(|tree| precision(tree) != first) {
        None => Ok(first),
        Some(row) => {
            let (first, other) = (first.name(), precision(&trees[row]).name());
            let text = format!("trees: row {row} has precision {other:?}, row 0 {first:?}; a scene has one of them");
            Err(PyValueError::new_err(text))
        }
    }
}

/// (M,) integers, each a row of the trees.
fn read_rows(instances: &Bound<'_, PyAny>, trees: usize) -> PyResult<Vec<u32>> {
    let array = as_array("instances", instances)?;
    let is_empty = array.len() == 0;
    if !matches!(array.shape(), [_]) || !(matches!(kind(&array), 'i' | 'u') || is_empty) {
        return wrong("instances", "(M,) integers", &array);
    }
    room("the instances", (size_of::<i128>() + size_of::<u32>()) * array.len()).map_err(to_exception)?;
    let is_large = kind(&array) == 'u' && array.dtype().itemsize() == 8;
    let rows: Vec<i128> = if is_large {
        converted(&array, "uint64")?
            .cast_into::<PyArray1<u64>>()?
            .try_readonly()?
            .as_slice()?
            .iter()
            .map(|&row| row.into())
            .collect()
    } else {
        converted(&array, "int64")?
            .cast_into::<PyArray1<i64>>()?
            .try_readonly()?
            .as_slice()?
            .iter()
            .map(|&row| row.into())
            .collect()
    };
    rows.iter()
        .enumerate()
        .map(|(place, &row)| match usize::try_from(row) {
            Ok(number) if number < trees => Ok(number as u32),
            _ => Err(GeometryError::new_err(format!(
                "instances: row {place} refers to tree {row}, but there are {trees} trees"
            ))),
        })
        .collect()
}

/// (M, 4, 4) finite numbers, the last row of each 0, 0, 0, 1.
fn read_matrices(matrices: &Bound<'_, PyAny>, instances: usize) -> PyResult<Matrices> {
    let array = as_array("matrices", matrices)?;
    if !matches!(array.shape(), [_, 4, 4]) || !matches!(kind(&array), 'f' | 'i' | 'u') {
        return wrong("matrices", "(M, 4, 4) real numbers", &array);
    }
    if array.shape()[0] != instances {
        let rows = array.shape()[0];
        return Err(GeometryError::new_err(format!("matrices: {rows} rows, but instances has {instances}")));
    }
    let array = converted(&array, "float64")?.cast_into::<PyArray<f64, numpy::Ix3>>()?;
    let array = array.try_readonly()?;
    let matrices: &[[[f64; 4]; 4]] = bytemuck::cast_slice(array.as_slice()?);
    for (row, matrix) in matrices.iter().enumerate() {
        if let Some(x) = matrix.as_flattened().iter().find(|x| !x.is_finite()) {
            return Err(GeometryError::new_err(format!("matrices: row {row} holds {x}")));
        }
        if matrix[3] != [0.0, 0.0, 0.0, 1.0] {
            let [x, y, z, w] = matrix[3];
            let text = format!("matrices: row {row} ends with ({x}, {y}, {z}, {w}); expected (0, 0, 0, 1)");
            return Err(GeometryError::new_err(text));
        }
    }
    room("the matrices", size_of_val(matrices)).map_err(to_exception)?;
    Ok(matrices.to_vec())
}
