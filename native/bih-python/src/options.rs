//! The names of options, looked up.

use bih_core::build::{Build, Heuristic, Layout, Precision, Structure};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The structure of that name.
pub fn named_structure(name: &str) -> PyResult<Structure> {
    [Structure::Bih, Structure::KdTree, Structure::Bvh]
        .into_iter()
        .find(|structure| structure.name() == name)
        .ok_or_else(|| unknown("structure", name, "\"bih\", \"kd_tree\" or \"bvh\""))
}

/// The layout of that name.
pub fn named_layout(name: &str) -> PyResult<Layout> {
    [Layout::Wide, Layout::Compact, Layout::Classic]
        .into_iter()
        .find(|layout| layout.name() == name)
        .ok_or_else(|| unknown("layout", name, "\"wide\", \"compact\" or \"classic\""))
}

/// The construction of that name.
pub fn named_build(name: &str) -> PyResult<Build> {
    [Build::Eager, Build::OnDemand]
        .into_iter()
        .find(|build| build.name() == name)
        .ok_or_else(|| unknown("build", name, "\"eager\" or \"on_demand\""))
}

/// The heuristic of that name.
pub fn named_heuristic(name: &str) -> PyResult<Heuristic> {
    [Heuristic::Global, Heuristic::Local, Heuristic::Sah]
        .into_iter()
        .find(|heuristic| heuristic.name() == name)
        .ok_or_else(|| unknown("heuristic", name, "\"global\", \"local\" or \"sah\""))
}

/// The precision of that name.
pub fn named_precision(name: &str) -> PyResult<Precision> {
    [Precision::Watertight, Precision::Exact, Precision::Fast]
        .into_iter()
        .find(|precision| precision.name() == name)
        .ok_or_else(|| unknown("precision", name, "\"watertight\", \"exact\" or \"fast\""))
}

fn unknown(argument: &str, name: &str, choice: &str) -> PyErr {
    PyValueError::new_err(format!("{argument}: {name:?} is unknown; choose {choice}"))
}
