//! Trees and their queries.

use std::path::PathBuf;
use std::sync::{Arc, PoisonError, RwLock};

use bih_core::build::{Heuristic, Structure, refit};
use bih_core::memory::room;
use bih_core::saved::{self, Access, Saved};
use bih_core::simd::FloatEnvironment;
use bih_core::traverse::{Counts, Decisions, contains};
use bih_core::tree::NodeRow;
use bih_core::{Bounds, BuildOptions, Tree as CoreTree, tree};
use numpy::{PyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyByteArray, PyType};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::arrays::{Limit, vectors};
use crate::errors::{BihError, to_exception};
use crate::hits::{HitLists, Hits};
use crate::mesh::Mesh;
use crate::options::{named_build, named_heuristic, named_layout, named_precision, named_structure};
use crate::query::{Rays, SUPERVISED};
use crate::stats::Stats;
use crate::supervise::{run, supervise};

/// An acceleration structure over one triangle mesh.
#[pyclass(frozen, module = "bihtree")]
pub struct Tree {
    /// Replaced as a whole when the vertices move, so that a query goes on with what it began with.
    state: RwLock<Arc<State>>,
    pub pool: Option<ThreadPool>,
}

/// A tree and the mesh that it is over.
pub struct State {
    pub core: CoreTree,
    pub mesh: Mesh,
}

pub type Pair<'py> = (Bound<'py, PyArray1<i32>>, Bound<'py, PyArray1<i32>>);

#[pymethods]
impl Tree {
    #[new]
    #[pyo3(signature = (vertices, triangles=None, *, structure="bih", layout=None, build="eager",
        heuristic=None, presort=None, precision="watertight", leaf_size=None, threads=0, copy=true, progress=None))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
    fn new(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        triangles: Option<&Bound<'_, PyAny>>,
        structure: &str,
        layout: Option<&str>,
        build: &str,
        heuristic: Option<&str>,
        presort: Option<bool>,
        precision: &str,
        leaf_size: Option<i64>,
        threads: i64,
        copy: bool,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let structure = named_structure(structure)?;
        let layout = layout.map_or(Ok(structure.layout()), named_layout)?;
        let build = named_build(build)?;
        let heuristic = heuristic.map_or(Ok(structure.heuristic()), named_heuristic)?;
        let precision = named_precision(precision)?;
        if structure == Structure::Bih && presort == Some(true) && heuristic != Heuristic::Global {
            let text = "presort: the bucket sort is of the cells of heuristic \"global\"; leave it out";
            return Err(PyValueError::new_err(text));
        }
        let leaf_size = leaf_size.map(|size| count("leaf_size", size, 1)).transpose()?;
        let options = BuildOptions { structure, layout, build, piece: None, heuristic, presort, precision, leaf_size };
        options.check().map_err(to_exception)?;
        let threads = count("threads", threads, 0)?;
        if let Some(progress) = progress.filter(|progress| !progress.is_callable()) {
            return Err(PyValueError::new_err(format!("progress: {} is not callable", progress.repr()?)));
        }

        let _standard = FloatEnvironment::standard();
        let mesh = Mesh::new(vertices, triangles, copy)?;
        let pool = thread_pool(threads)?;
        let core = mesh.with_triangles(py, |triangles| {
            supervise(py, pool.as_ref(), progress, |control| bih_core::build(&triangles, &options, control))
        })??;
        mesh.freeze(py)?;
        Ok(Self::of(core, mesh, pool))
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
        let _standard = FloatEnvironment::standard();
        if self.is_double(py)? { self.closest::<f64>(py, &rays) } else { self.closest::<f32>(py, &rays) }
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
        let answers = self
            .query(py, &rays, SUPERVISED, |core, triangles, rays, control| rays.occluded(core, triangles, control))?;
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
        let _standard = FloatEnvironment::standard();
        if self.is_double(py)? { self.all::<f64>(py, &rays, most) } else { self.all::<f32>(py, &rays, most) }
    }

    /// How often each ray crosses the surface.
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
        let counts =
            self.query(py, &rays, self.few(), |core, triangles, rays, control| rays.count(core, triangles, control))?;
        Ok(PyArray::from_vec(py, counts))
    }

    /// Whether each point is inside the surface or on it.
    fn contains<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let _standard = FloatEnvironment::standard();
        let points = vectors("points", points)?;
        let view = points.view()?;
        let answers = self.work(py, points.rows(), self.few(), |core, triangles, control| {
            contains(&view, core, triangles, control)
        })?;
        Ok(PyArray::from_vec(py, answers))
    }

    /// Nodes visited and triangles tested by `intersect` for each ray.
    fn traversal_cost<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
    ) -> PyResult<Pair<'py>> {
        let counts =
            self.query(py, &Rays::endless(origins, directions), SUPERVISED, |core, triangles, rays, control| {
                rays.cost(core, triangles, control)
            })?;
        Ok(cost_arrays(py, &counts))
    }

    /// How many tests of each ray of `intersect` came to each means of deciding.
    fn decision_cost<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<i32>>> {
        let decisions =
            self.query(py, &Rays::endless(origins, directions), SUPERVISED, |core, triangles, rays, control| {
                rays.decisions(core, triangles, control)
            })?;
        let counts = decisions.iter().flat_map(Decisions::counts).map(u32::cast_signed);
        PyArray1::from_iter(py, counts).reshape([decisions.len(), 5])
    }

    /// What the tree is and what it cost.
    #[getter]
    fn stats(&self) -> Stats {
        let State { core, mesh } = &*self.state();
        let layout = match core.wide() {
            Some(wide) if wide.records.are_ordered() => "wide",
            Some(_) => "compact",
            None => "classic",
        };
        let names = [core.structure().name(), layout, core.heuristic().name(), core.precision().name()];
        Stats::new(&core.stats(), names, core.build().name(), mesh.owned_bytes)
    }

    /// (2, 3) lower and upper corner; inf and -inf where no triangle can be hit.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let State { core, mesh } = &*self.state();
        let is_double = mesh.with_triangles(py, |triangles| triangles.is_double())?;
        bounds_array(py, core.bounds(), is_double)
    }

    /// The tree as a structured array, one row a node, breadth first.
    #[pyo3(signature = (*, max_depth=None, limit=None))]
    fn nodes<'py>(&self, py: Python<'py>, max_depth: Option<i64>, limit: Option<i64>) -> PyResult<Bound<'py, PyAny>> {
        let (State { core, mesh }, pool) = (&*self.state(), self.pool.as_ref());
        node_array(py, max_depth, limit, |max_depth, limit| {
            mesh.with_triangles(py, |triangles| {
                run(py, pool, |control| tree::node_table(core, &triangles, max_depth, limit, control))
            })?
        })
    }

    /// The caller's rows in leaf order, then the rejected ones.
    fn order<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<i32>>> {
        let core = &self.state().core;
        let stats = core.stats();
        room("the order", size_of::<i32>() * (stats.references + stats.rejected)).map_err(to_exception)?;
        Ok(PyArray1::from_vec(py, core.order().into_iter().map(|row| row as i32).collect()))
    }

    /// Check every rule that a tree keeps.
    fn validate(&self, py: Python<'_>) -> PyResult<()> {
        let State { core, mesh } = &*self.state();
        mesh.with_triangles(py, |triangles| run(py, self.pool.as_ref(), |_| tree::validate(core, &triangles)))?
    }

    /// Build all that no ray has come to yet; nothing for a tree that was built at once.
    fn build_all(&self, py: Python<'_>) -> PyResult<()> {
        let State { core, mesh } = &*self.state();
        mesh.with_triangles(py, |triangles| {
            supervise(py, self.pool.as_ref(), None, |control| core.build_all(&triangles, control))
        })?
    }

    /// Move the vertices of the same triangles.
    fn refit(&self, py: Python<'_>, vertices: &Bound<'_, PyAny>) -> PyResult<()> {
        let _standard = FloatEnvironment::standard();
        let State { core, mesh } = &*self.state();
        let mesh = mesh.moved(py, vertices)?;
        let core = mesh.with_triangles(py, |triangles| {
            supervise(py, self.pool.as_ref(), None, |control| refit(core, &triangles, control))
        })??;
        *self.state.write().unwrap_or_else(PoisonError::into_inner) = Arc::new(State { core, mesh });
        Ok(())
    }

    /// Write the tree and its mesh to a file.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let State { core, mesh } = &*self.state();
        mesh.with_triangles(py, |triangles| {
            supervise(py, self.pool.as_ref(), None, |control| saved::save(core, &triangles, &path, control))
        })?
    }

    /// A tree that `save` wrote.
    #[classmethod]
    #[pyo3(signature = (path, *, mmap=true))]
    fn load(_class: &Bound<'_, PyType>, py: Python<'_>, path: PathBuf, mmap: bool) -> PyResult<Self> {
        let access = if mmap { Access::Map } else { Access::Read };
        let Saved { tree, mesh } = run(py, None, |_| saved::load(&path, access))?;
        Ok(Self::of(tree, mesh.into(), None))
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(pyo3::exceptions::PyTypeError::new_err(
            "a bihtree.Tree cannot be pickled; save it and load it where it is needed",
        ))
    }

    fn __repr__(&self) -> String {
        let state = self.state();
        let (stats, name) = (state.core.stats(), state.core.structure().name());
        let tree_bytes = stats.tree_bytes;
        format!("<bihtree.Tree: {name}, {} triangles, {} nodes, {tree_bytes} bytes>", stats.triangles, stats.nodes)
    }
}

impl Tree {
    fn of(core: CoreTree, mesh: Mesh, pool: Option<ThreadPool>) -> Self {
        Self { state: RwLock::new(Arc::new(State { core, mesh })), pool }
    }

    /// The tree as it stands.
    pub fn state(&self) -> Arc<State> {
        self.state.read().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// A whole number that is not below `least`.
pub fn count(name: &str, value: i64, least: usize) -> PyResult<usize> {
    usize::try_from(value)
        .ok()
        .filter(|value| *value >= least)
        .ok_or_else(|| PyValueError::new_err(format!("{name}: {value} is below {least}")))
}

/// Threads of one's own; none of them where the number is 0.
pub fn thread_pool(threads: usize) -> PyResult<Option<ThreadPool>> {
    (threads > 0)
        .then(|| ThreadPoolBuilder::new().num_threads(threads).build())
        .transpose()
        .map_err(|error| BihError::new_err(format!("threads: {threads} could not be started ({error})")))
}

/// Nodes visited and triangles tested.
pub fn cost_arrays<'py>(py: Python<'py>, counts: &[Counts]) -> Pair<'py> {
    let nodes = counts.iter().map(|counts| counts.nodes as i32).collect();
    let triangles = counts.iter().map(|counts| counts.triangles as i32).collect();
    (PyArray1::from_vec(py, nodes), PyArray1::from_vec(py, triangles))
}

/// (2, 3) lower and upper corner.
pub fn bounds_array<'py>(py: Python<'py>, bounds: &Bounds, is_double: bool) -> PyResult<Bound<'py, PyAny>> {
    let array = PyArray2::from_vec2(py, &[bounds.lower.to_vec(), bounds.upper.to_vec()])
        .map_err(|error| BihError::new_err(error.to_string()))?;
    array.call_method1("astype", (if is_double { "float64" } else { "float32" },))
}

/// Rows of nodes as a structured array.
pub fn node_array<'py>(
    py: Python<'py>,
    max_depth: Option<i64>,
    limit: Option<i64>,
    read: impl FnOnce(u32, usize) -> PyResult<Vec<NodeRow>>,
) -> PyResult<Bound<'py, PyAny>> {
    let max_depth = max_depth.map(|depth| count("max_depth", depth, 0)).transpose()?.unwrap_or(usize::MAX);
    let limit = limit.map(|limit| count("limit", limit, 0)).transpose()?.unwrap_or(usize::MAX);
    let rows = read(u32::try_from(max_depth).unwrap_or(u32::MAX), limit)?;
    let numpy = py.import("numpy")?;
    let dtype = numpy.call_method1("dtype", (node_fields(),))?;
    let rows: &[u8] = bytemuck::cast_slice(&rows);
    room("the rows of nodes", rows.len()).map_err(to_exception)?;
    let bytes = PyByteArray::new_with(py, rows.len(), |bytes| {
        bytes.copy_from_slice(rows);
        Ok(())
    })?;
    numpy.call_method("frombuffer", (bytes,), Some(&[("dtype", dtype)].into_py_dict(py)?))
}

fn node_fields() -> Vec<(&'static str, &'static str)> {
    vec![
        ("parent", "<i4"),
        ("depth", "<i4"),
        ("kind", "u1"),
        ("axis", "i1"),
        ("clip", "2<f4"),
        ("lower", "3<f4"),
        ("upper", "3<f4"),
        ("first", "<i8"),
        ("count", "<i8"),
    ]
}
