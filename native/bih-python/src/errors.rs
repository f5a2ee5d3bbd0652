//! Errors of the core as exceptions of the package, where they are defined (they have two bases each).

use std::io::{self, ErrorKind};

use bih_core::Error;
use pyo3::exceptions::{PyIsADirectoryError, PyMemoryError, PyOSError, PyValueError};
use pyo3::import_exception;
use pyo3::prelude::*;

import_exception!(bihtree.errors, BihError);
import_exception!(bihtree.errors, FileFormatError);
import_exception!(bihtree.errors, GeometryError);
import_exception!(bihtree.errors, Cancelled);

/// The exception that a person sees for an error of the core.
pub fn to_exception(error: Error) -> PyErr {
    let text = error.to_string();
    match error {
        Error::Cancelled(_) => Cancelled::new_err(text),
        Error::Incompatible { .. } => PyValueError::new_err(text),
        Error::Format { .. } => FileFormatError::new_err(text),
        // Python finds the right kind of OSError by the number.
        Error::File { path, code: Some(code), reason, .. } => PyOSError::new_err((code, reason, path)),
        Error::File { kind: ErrorKind::IsADirectory, .. } => PyIsADirectoryError::new_err(text),
        Error::Memory { .. } | Error::File { kind: ErrorKind::OutOfMemory, .. } => PyMemoryError::new_err(text),
        Error::File { kind, .. } => io::Error::new(kind, text).into(),
        Error::Broken { .. } => BihError::new_err(text),
        Error::VertexOutOfRange { .. }
        | Error::RaggedSoup { .. }
        | Error::TooManyTriangles { .. }
        | Error::TooManyInstances { .. } => GeometryError::new_err(text),
    }
}
