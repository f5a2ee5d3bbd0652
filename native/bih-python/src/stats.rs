//! What a tree is and what it cost.

use std::collections::BTreeMap;

use pyo3::prelude::*;
use pyo3::types::PyDict;

/// What a tree is and what it cost. Times in seconds, sizes in bytes.
#[pyclass(frozen, get_all, module = "bihtree")]
pub struct Stats {
    structure: &'static str,
    layout: &'static str,
    build: &'static str,
    heuristic: &'static str,
    precision: &'static str,
    triangles: usize,
    nodes: usize,
    leaves: usize,
    references: usize,
    unbuilt: usize,
    depth: usize,
    tree_bytes: usize,
    bound_bytes: usize,
    mesh_bytes: usize,
    peak_build_bytes: usize,
    build_seconds: f64,
    presorted: bool,
    left_out: BTreeMap<String, String>,
    rejected: usize,
}

const FIELDS: [&str; 19] = [
    "structure",
    "layout",
    "build",
    "heuristic",
    "precision",
    "triangles",
    "nodes",
    "leaves",
    "references",
    "unbuilt",
    "depth",
    "tree_bytes",
    "bound_bytes",
    "mesh_bytes",
    "peak_build_bytes",
    "build_seconds",
    "presorted",
    "left_out",
    "rejected",
];

impl Stats {
    pub fn new(
        stats: &bih_core::tree::Stats,
        [structure, layout, heuristic, precision]: [&'static str; 4],
        build: &'static str,
        mesh_bytes: usize,
    ) -> Self {
        Self {
            structure,
            layout,
            build,
            heuristic,
            precision,
            triangles: stats.triangles,
            nodes: stats.nodes,
            leaves: stats.leaves,
            references: stats.references,
            unbuilt: stats.unbuilt,
            depth: stats.depth,
            tree_bytes: stats.tree_bytes,
            bound_bytes: stats.bound_bytes,
            mesh_bytes,
            peak_build_bytes: stats.peak_build_bytes,
            build_seconds: stats.build_seconds,
            presorted: stats.presorted,
            left_out: stats.left_out.iter().cloned().collect(),
            rejected: stats.rejected,
        }
    }
}

#[pymethods]
impl Stats {
    /// All of it by name.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(slf.py());
        for name in FIELDS {
            dict.set_item(name, slf.getattr(name)?)?;
        }
        Ok(dict)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let fields: PyResult<Vec<String>> =
            FIELDS.iter().map(|name| Ok(format!("{name}={}", slf.getattr(*name)?.repr()?))).collect();
        Ok(format!("Stats({})", fields?.join(", ")))
    }
}
