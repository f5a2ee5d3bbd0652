//! The Python module `bihtree`: checks arrays, calls the core, wraps results, maps errors. No algorithm.

#![forbid(unsafe_code)]

mod appearance;
mod arrays;
mod camera;
mod errors;
mod hits;
mod lights;
mod mesh;
mod options;
mod query;
mod render;
mod rows;
mod scene;
mod stats;
mod supervise;
mod tree;

use pyo3::prelude::*;

#[pymodule]
mod _bihtree {
    use pyo3::exceptions::PyImportError;
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::camera::Camera;
    #[pymodule_export]
    use crate::hits::{HitLists, Hits};
    #[pymodule_export]
    use crate::render::render;
    #[pymodule_export]
    use crate::scene::Scene;
    #[pymodule_export]
    use crate::stats::Stats;
    #[pymodule_export]
    use crate::tree::Tree;

    /// The instruction sets that this process runs in, best first.
    #[pyfunction]
    fn cpu_features() -> Vec<&'static str> {
        bih_core::simd::instruction_sets().iter().map(|set| set.name()).collect()
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        bih_core::simd::check_instruction_set().map_err(|error| PyImportError::new_err(error.to_string()))?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
