//! From a question of Python to the core: rays checked, work supervised.

use bih_core::build::Precision;
use bih_core::geometry::Triangles;
use bih_core::simd::FloatEnvironment;
use bih_core::traverse::{Float, Limits, RayBatch};
use bih_core::{Control, Error, Tree as CoreTree};
use numpy::{Element, PyArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{Limit, LimitArray, limits, vectors};
use crate::errors::GeometryError;
use crate::hits::{HitLists, Hits};
use crate::supervise::{run, supervise};
use crate::tree::{State, Tree};

/// Batches of fewer rays are over before anyone could cancel them.
pub const SUPERVISED: usize = 1 << 14;

/// Batches of fewer tests are, where each ray may meet every triangle.
const SUPERVISED_TESTS: usize = 1 << 24;

/// Fewer rays than this are not supervised where each may meet so many triangles.
pub fn few(triangles: usize) -> usize {
    SUPERVISED.min(SUPERVISED_TESTS / triangles.max(1))
}

impl Tree {
    /// The nearest hit of each ray, in numbers of one precision.
    pub fn closest<F: Float + Element>(&self, py: Python<'_>, rays: &Rays<'_, '_>) -> PyResult<Hits> {
        let hits = self.query(py, rays, SUPERVISED, |core, triangles, rays, control| {
            rays.closest::<F>(core, triangles, control)
        })?;
        Ok(Hits::new(py, hits))
    }

    /// Whether distances and weights are doubles.
    pub fn is_double(&self, py: Python<'_>) -> PyResult<bool> {
        let State { core, mesh } = &*self.state();
        Ok(core.precision() == Precision::Exact || mesh.with_triangles(py, |triangles| triangles.is_double())?)
    }

    /// All hits of each ray, in numbers of one precision.
    pub fn all<F: Float + Element>(&self, py: Python<'_>, rays: &Rays<'_, '_>, most: usize) -> PyResult<HitLists> {
        let lists = self.query(py, rays, self.few(), |core, triangles, rays, control| {
            rays.all::<F>(core, triangles, most, control)
        })?;
        HitLists::new(py, lists)
    }

    /// Check the rays and hand them to `work` with the triangles, supervised unless there are `few`.
    pub fn query<T: Send>(
        &self,
        py: Python<'_>,
        rays: &Rays<'_, '_>,
        few: usize,
        work: impl FnOnce(&CoreTree, &Triangles, &RayBatch, &Control) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        rays.check(|batch| {
            self.work(py, batch.len(), few, |core, triangles, control| work(core, triangles, batch, control))
        })
    }

    /// Fewer rays than this are not supervised where each may meet every triangle.
    pub fn few(&self) -> usize {
        few(self.state().core.stats().triangles)
    }

    /// Answer this many questions about the triangles, supervised unless there are `few`.
    pub fn work<T: Send>(
        &self,
        py: Python<'_>,
        questions: usize,
        few: usize,
        work: impl FnOnce(&CoreTree, &Triangles, &Control) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let (State { core, mesh }, pool) = (&*self.state(), self.pool.as_ref());
        mesh.with_triangles(py, |triangles| {
            let work = |control: &Control| work(core, &triangles, control);
            if questions < few { run(py, pool, work) } else { supervise(py, pool, None, work) }
        })?
    }
}

/// Rays as a caller gives them.
pub struct Rays<'a, 'py> {
    pub origins: &'a Bound<'py, PyAny>,
    pub directions: &'a Bound<'py, PyAny>,
    pub t_min: Limit<'py>,
    pub t_max: Limit<'py>,
}

impl<'a, 'py> Rays<'a, 'py> {
    /// From 0 on, without end.
    pub fn endless(origins: &'a Bound<'py, PyAny>, directions: &'a Bound<'py, PyAny>) -> Self {
        Self { origins, directions, t_min: Limit::Number(0.0), t_max: Limit::Number(f64::INFINITY) }
    }

    /// Check them and hand them to `work`.
    pub fn check<T>(&self, work: impl FnOnce(&RayBatch) -> PyResult<T>) -> PyResult<T> {
        let _standard = FloatEnvironment::standard();
        let origins = vectors("origins", self.origins)?;
        let directions = vectors("directions", self.directions)?;
        let rays = origins.rows();
        if directions.rows() != rays {
            let others = directions.rows();
            return Err(GeometryError::new_err(format!("directions: {others} rows, but origins has {rays}")));
        }
        let (t_min, t_max) = (limits("t_min", &self.t_min, rays)?, limits("t_max", &self.t_max, rays)?);
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
        work(&batch)
    }
}
