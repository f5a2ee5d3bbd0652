//! Trees in files, with their meshes: docs/format.md.

mod bytes;
mod format;
mod mesh;
mod read;
mod write;

pub use bytes::Bytes;
pub use format::{BYTE_ORDER, MAGIC, SECTIONS, VERSION};
pub use mesh::SavedMesh;
pub use read::{Access, Saved, load, parse};
pub use write::{save, write};

use std::io;
use std::path::Path;

use crate::error::Error;

/// The error of the system about a file.
fn file_error(path: &Path, error: &io::Error) -> Error {
    let text = error.to_string();
    // Python has its own way to give the number.
    let reason = text.split_once(" (os error").map_or(text.as_str(), |(reason, _)| reason).to_owned();
    Error::File { path: path.display().to_string(), kind: error.kind(), code: error.raw_os_error(), reason }
}
