//! Errors of the core as exceptions of the package, where they are defined (they have two bases each).

use bih_core::Error;
use pyo3::exceptions::PyValueError;
use pyo3::import_exception;
use pyo3::prelude::*;

import_exception!(bihtree.errors, BihError);
import_exception!(bihtree.errors, GeometryError);
import_exception!(bihtree.errors, Cancelled);

/// The exception that a person sees for an error of the core.
pub fn to_exception(error: Error) -> PyErr {
    let text = error.to_string();
    match error {
        Error::Cancelled(_) => Cancelled::new_err(text),
        Error::Incompatible { .. } => PyValueError::new_err(text),
        Error::Broken { .. } => BihError::new_err(text),
        Error::VertexOutOfRange { .. } | Error::RaggedSoup { .. } | Error::TooManyTriangles { .. } => {
            GeometryError::new_err(text)
        }
    }
}
