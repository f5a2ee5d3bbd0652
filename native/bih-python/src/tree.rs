//! Trees and their queries.

use std::path::PathBuf;

use bih_core::build::{Heuristic, Precision, Structure};
use bih_core::geometry::Triangles;
use bih_core::saved::{self, Access, Saved};
use bih_core::simd::FloatEnvironment;
use bih_core::traverse::{Float, Limits, RayBatch, contains};
use bih_core::{BuildOptions, Control, Error, Tree as CoreTree, tree};
use numpy::{Element, PyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyByteArray, PyType};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::arrays::{Limit, LimitArray, limits, vectors};
use crate::errors::{BihError, GeometryError, to_exception};
use crate::hits::{HitLists, Hits};
use crate::mesh::Mesh;
use crate::options::{named_build, named_heuristic, named_layout, named_precision, named_structure};
use crate::stats::Stats;
use crate::supervise::{run, supervise};

/// Batches of fewer rays are over before anyone could cancel them.
const SUPERVISED: usize = 1 << 14;

/// Batches of fewer tests are, where each ray may meet every triangle.
const SUPERVISED_TESTS: usize = 1 << 24;

/// An acceleration structure over one triangle mesh.
#[pyclass(frozen, module = "bihtree")]
pub struct Tree {
    pub core: CoreTree,
    mesh: Mesh,
    pub pool: Option<ThreadPool>,
}

type Pair<'py> = (Bound<'py, PyArray1<i32>>, Bound<'py, PyArray1<i32>>);

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
        let pool = (threads > 0)
            .then(|| ThreadPoolBuilder::new().num_threads(threads).build())
            .transpose()
            .map_err(|error| BihError::new_err(format!("threads: {threads} could not be started ({error})")))?;
        let core = mesh.with_triangles(py, |triangles| {
            supervise(py, pool.as_ref(), progress, |control| bih_core::build(&triangles, &options, control))
        })??;
        mesh.freeze(py)?;
        Ok(Self { core, mesh, pool })
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
        let _standard = FloatEnvironment::standard();
        if self.is_double(py)? {
            self.closest::<f64>(py, origins, directions, &t_min, &t_max)
        } else {
            self.closest::<f32>(py, origins, directions, &t_min, &t_max)
        }
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
        let answers =
            self.query(py, origins, directions, &t_min, &t_max, SUPERVISED, |core, triangles, rays, control| {
                Ok(rays.occluded(core, triangles, control)?)
            })?;
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
        let most = max_hits.map(|most| count("max_hits", most, 1)).transpose()?.unwrap_or(usize::MAX);
        let _standard = FloatEnvironment::standard();
        if self.is_double(py)? {
            self.all::<f64>(py, origins, directions, &t_min, &t_max, most)
        } else {
            self.all::<f32>(py, origins, directions, &t_min, &t_max, most)
        }
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
        let counts =
            self.query(py, origins, directions, &t_min, &t_max, self.few(), |core, triangles, rays, control| {
                Ok(rays.count(core, triangles, control)?)
            })?;
        Ok(PyArray::from_vec(py, counts))
    }

    /// Whether each point is inside the surface or on it.
    fn contains<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let _standard = FloatEnvironment::standard();
        let points = vectors("points", points)?;
        let view = points.view()?;
        let answers = self.work(py, points.rows(), self.few(), |triangles, control| {
            Ok(contains(&view, &self.core, triangles, control)?)
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
        let counts = self.query(
            py,
            origins,
            directions,
            &Limit::Number(0.0),
            &Limit::Number(f64::INFINITY),
            SUPERVISED,
            |core, triangles, rays, control| Ok(rays.cost(core, triangles, control)?),
        )?;
        let nodes = PyArray1::from_iter(py, counts.iter().map(|counts| counts.nodes as i32));
        let triangles = PyArray1::from_iter(py, counts.iter().map(|counts| counts.triangles as i32));
        Ok((nodes, triangles))
    }

    /// What the tree is and what it cost.
    #[getter]
    fn stats(&self) -> Stats {
        let layout = match self.core.wide() {
            Some(wide) if wide.records.are_ordered() => "wide",
            Some(_) => "compact",
            None => "classic",
        };
        let names = [self.core.structure().name(), layout, self.core.heuristic().name(), self.core.precision().name()];
        Stats::new(&self.core.stats(), names, self.core.build().name(), self.mesh.owned_bytes)
    }

    /// (2, 3) lower and upper corner; inf and -inf where no triangle can be hit.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let bounds = self.core.bounds();
        let array = PyArray2::from_vec2(py, &[bounds.lower.to_vec(), bounds.upper.to_vec()])
            .map_err(|error| BihError::new_err(error.to_string()))?;
        let is_double = self.mesh.with_triangles(py, |triangles| triangles.is_double())?;
        array.call_method1("astype", (if is_double { "float64" } else { "float32" },))
    }

    /// The tree as a structured array, one row a node, breadth first.
    #[pyo3(signature = (*, max_depth=None, limit=None))]
    fn nodes<'py>(&self, py: Python<'py>, max_depth: Option<i64>, limit: Option<i64>) -> PyResult<Bound<'py, PyAny>> {
        let max_depth = max_depth.map(|depth| count("max_depth", depth, 0)).transpose()?.unwrap_or(usize::MAX);
        let limit = limit.map(|limit| count("limit", limit, 0)).transpose()?.unwrap_or(usize::MAX);
        let max_depth = u32::try_from(max_depth).unwrap_or(u32::MAX);
        let rows = self.mesh.with_triangles(py, |triangles| {
            run(py, self.pool.as_ref(), |control| tree::node_table(&self.core, &triangles, max_depth, limit, control))
        })??;
        let numpy = py.import("numpy")?;
        let dtype = numpy.call_method1("dtype", (node_fields(),))?;
        let bytes = PyByteArray::new(py, bytemuck::cast_slice(&rows));
        numpy.call_method("frombuffer", (bytes,), Some(&[("dtype", dtype)].into_py_dict(py)?))
    }

    /// The caller's rows in leaf order, then the rejected ones.
    fn order<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i32>> {
        PyArray1::from_iter(py, self.core.order().into_iter().map(|row| row as i32))
    }

    /// Check every rule that a tree keeps.
    fn validate(&self, py: Python<'_>) -> PyResult<()> {
        self.mesh
            .with_triangles(py, |triangles| run(py, self.pool.as_ref(), |_| tree::validate(&self.core, &triangles)))?
    }

    /// Build all that no ray has come to yet; nothing for a tree that was built at once.
    fn build_all(&self, py: Python<'_>) -> PyResult<()> {
        self.mesh.with_triangles(py, |triangles| {
            supervise(py, self.pool.as_ref(), None, |control| Ok(self.core.build_all(&triangles, control)?))
        })?
    }

    /// Write the tree and its mesh to a file.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        self.mesh.with_triangles(py, |triangles| {
            supervise(py, self.pool.as_ref(), None, |control| saved::save(&self.core, &triangles, &path, control))
        })?
    }

    /// A tree that `save` wrote.
    #[classmethod]
    #[pyo3(signature = (path, *, mmap=true))]
    fn load(_class: &Bound<'_, PyType>, py: Python<'_>, path: PathBuf, mmap: bool) -> PyResult<Self> {
        let access = if mmap { Access::Map } else { Access::Read };
        let Saved { tree, mesh } = run(py, None, |_| saved::load(&path, access))?;
        Ok(Self { core: tree, mesh: mesh.into(), pool: None })
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(pyo3::exceptions::PyTypeError::new_err(
            "a bihtree.Tree cannot be pickled; save it and load it where it is needed",
        ))
    }

    fn __repr__(&self) -> String {
        let (stats, name) = (self.core.stats(), self.core.structure().name());
        let tree_bytes = stats.tree_bytes;
        format!("<bihtree.Tree: {name}, {} triangles, {} nodes, {tree_bytes} bytes>", stats.triangles, stats.nodes)
    }
}

impl Tree {
    /// The nearest hit of each ray, in numbers of one precision.
    fn closest<F: Float + Element>(
        &self,
        py: Python<'_>,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        t_min: &Limit<'_>,
        t_max: &Limit<'_>,
    ) -> PyResult<Hits> {
        let hits =
            self.query(py, origins, directions, t_min, t_max, SUPERVISED, |core, triangles, rays, control| {
                Ok(rays.closest::<F>(core, triangles, control)?)
            })?;
        Ok(Hits::new(py, hits))
    }

    /// Whether distances and weights are doubles.
    fn is_double(&self, py: Python<'_>) -> PyResult<bool> {
        Ok(self.core.precision() == Precision::Exact
            || self.mesh.with_triangles(py, |triangles| triangles.is_double())?)
    }

    /// All hits of each ray, in numbers of one precision.
    fn all<F: Float + Element>(
        &self,
        py: Python<'_>,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        t_min: &Limit<'_>,
        t_max: &Limit<'_>,
        most: usize,
    ) -> PyResult<HitLists> {
        let lists =
            self.query(py, origins, directions, t_min, t_max, self.few(), |core, triangles, rays, control| {
                Ok(rays.all::<F>(core, triangles, most, control)?)
            })?;
        Ok(HitLists::new(py, lists))
    }

    /// Check the rays and hand them to `work` with the triangles, supervised unless there are `few`.
    #[expect(clippy::too_many_arguments, reason = "four of them are the rays")]
    fn query<'py, T: Send>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_min: &Limit<'py>,
        t_max: &Limit<'py>,
        few: usize,
        work: impl FnOnce(&CoreTree, &Triangles, &RayBatch, &Control) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let _standard = FloatEnvironment::standard();
        let origins = vectors("origins", origins)?;
        let directions = vectors("directions", directions)?;
        let rays = origins.rows();
        if directions.rows() != rays {
            let others = directions.rows();
            return Err(GeometryError::new_err(format!("directions: {others} rows, but origins has {rays}")));
        }
        let (t_min, t_max) = (limits("t_min", t_min, rays)?, limits("t_max", t_max, rays)?);
        let readonly = |limit: &LimitArray<'py>| match limit {
            LimitArray::All(_) => Ok(None),
            LimitArray::Each(array) => array.try_readonly().map(Some),
        };
        let (t_min_array, t_max_array) = (readonly(&t_min)?, readonly(&t_max)?);
        let batch = RayBatch {
            origins: origins.view()?,
            directions: directions.view()?,
            t_min: match (&t_min, &t_min_array) {
                (LimitArray::All(limit), _) => Limits::All(*limit),
                (_, array) => Limits::Each(array.as_ref().map_or(Ok(&[][..]), |array| array.as_slice())?),
            },
            t_max: match (&t_max, &t_max_array) {
                (LimitArray::All(limit), _) => Limits::All(*limit),
                (_, array) => Limits::Each(array.as_ref().map_or(Ok(&[][..]), |array| array.as_slice())?),
            },
        };
        self.work(py, rays, few, |triangles, control| work(&self.core, triangles, &batch, control))
    }

    /// Fewer rays than this are not supervised where each may meet every triangle.
    fn few(&self) -> usize {
        SUPERVISED.min(SUPERVISED_TESTS / self.core.stats().triangles.max(1))
    }

    /// Answer this many questions about the triangles, supervised unless there are `few`.
    fn work<T: Send>(
        &self,
        py: Python<'_>,
        questions: usize,
        few: usize,
        work: impl FnOnce(&Triangles, &Control) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let pool = self.pool.as_ref();
        self.mesh.with_triangles(py, |triangles| {
            let work = |control: &Control| work(&triangles, control);
            if questions < few { run(py, pool, work) } else { supervise(py, pool, None, work) }
        })?
    }

    /// Call `read` with a view of the triangles.
    pub fn with_triangles<R>(&self, py: Python<'_>, read: impl FnOnce(Triangles<'_>) -> R) -> PyResult<R> {
        self.mesh.with_triangles(py, read)
    }
}

/// A whole number that is not below `least`.
pub fn count(name: &str, value: i64, least: usize) -> PyResult<usize> {
    usize::try_from(value)
        .ok()
        .filter(|value| *value >= least)
        .ok_or_else(|| PyValueError::new_err(format!("{name}: {value} is below {least}")))
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
